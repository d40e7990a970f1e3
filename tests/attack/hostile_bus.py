"""Faults of a running servo bus and during torque-on: python tests/attack/hostile_bus.py

Each row is one run of 1000 cycles on simulated time, or one brown-out with every packet of
torque-on, one after the other. Wrong: false values reported as fresh. Outside: ticks in which a
joint was beyond its range. Recover: time until all is well after the end of the fault.
A bus that does not run before its fault ends the script.
"""

import sys
from itertools import count
from pathlib import Path

from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parents[1]))

from line_noise import BOARDS, KINDS, Noisy, Outcome  # noqa: E402

from gazerig.drivers.errors import DriverError  # noqa: E402

FAULTS = (
    "babble on", "noise before", "noise after", "echo on", "unplug for 0.5", "block on for 0.3",
    "brown-out 3", "collide 3", "delay all 15",
)  # fmt: skip
SMART_ONLY = ("collide 3", "echo on")


def run(kind: str, fault: str, cycles: int) -> Outcome:
    """Strike a running bus."""
    noisy = Noisy(kind, 2)
    noisy.start()
    return noisy.run(brown_out(kind) if fault.startswith("brown-out") else fault, 0.0, cycles)


def is_board(kind: str) -> bool:
    """Return whether one board moves all servos."""
    return kind.split()[0] in BOARDS


def brown_out(kind: str) -> str:
    """Return the fault in which one servo loses its supply, or the board."""
    return "brown-out" if is_board(kind) else "brown-out 3"


def torque_on(kind: str) -> tuple[int, int, int, float, float]:
    """Let servo 3 brown out at each packet of torque-on, one packet per run.

    Returns: packets, times refused, ticks outside, farthest outside, slowest recovery
    """
    refused = outside = 0
    farthest = slowest = 0.0
    for packet in count(1):
        noisy = Noisy(kind, packet)
        noisy.bus.open()
        noisy.strike(packet, brown_out(kind))
        try:
            noisy.enable_torque()
        except DriverError:
            refused += 1
            noisy.now += 1.0
            noisy.enable_torque()
        if not noisy.struck:
            return packet - 1, refused, outside, farthest, slowest
        outcome = noisy.run("clear", 0.0, 300)
        outside += outcome.outside
        farthest = max(farthest, outcome.farthest)
        slowest = max(slowest, outcome.recover_s if outcome.recover_s is not None else 99.0)
    raise AssertionError("packets come to an end")


def main() -> None:
    """Run the rows and print both tables."""
    table = Table(title="a running bus")
    for head in ("kind", "fault", "missing", "fresh", "wrong", "outside", "ended", "recover s"):
        table.add_column(head)
    for kind in KINDS:
        for fault in FAULTS:
            if is_board(kind) and fault in SMART_ONLY:
                continue
            one = run(kind, fault, 1000)
            recover = "never" if one.recover_s is None else f"{one.recover_s:.2f}"
            table.add_row(
                kind, fault, str(one.damaged), str(one.fresh), str(one.wrong), str(one.outside),
                one.ended[:40] or "no", recover,
            )  # fmt: skip
            print(kind, fault, one.errors, one.said[:4], file=sys.stderr)
    Console(width=130).print(table)
    table = Table(title="brown-out with each packet of torque-on")
    for head in ("kind", "packets", "refused once", "outside", "by steps", "slowest recovery s"):
        table.add_column(head)
    for kind in KINDS:
        packets, refused, outside, farthest, slowest = torque_on(kind)
        how = (str(refused), str(outside), f"{farthest:.0f}", f"{slowest:.2f}")
        table.add_row(kind, str(packets), *how)
    Console(width=130).print(table)


if __name__ == "__main__":
    main()
