"""What befalls a running servo bus, and torque-on itself: python tests/attack/hostile_bus.py

Each row is one run of 1000 cycles on simulated time, or one brown-out with every packet of
torque-on in turn. Wrong: values given as fresh that were not true. Outside: ticks in which a
joint was beyond its range. Recover: time until all is well after the end of the fault.
"""

import sys
from pathlib import Path

from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parents[1]))

from line_noise import KINDS, Noisy, Outcome  # noqa: E402

from gazerig.drivers.errors import DriverError  # noqa: E402

FAULTS = (
    "babble on", "noise before", "noise after", "echo on", "unplug for 0.5", "block on for 0.3",
    "brown-out 3", "collide 3", "delay all 15",
)  # fmt: skip
SMART_ONLY = ("collide 3", "echo on")
PACKETS = 30


def run(kind: str, fault: str, cycles: int) -> Outcome:
    """Strike a running bus."""
    noisy = Noisy(kind, 2)
    noisy.start()
    board = fault.split()[0] == "brown-out" and kind.startswith("maestro")
    return noisy.run("brown-out" if board else fault, 0.0, cycles)


def torque_on(kind: str) -> tuple[int, int, float, float]:
    """Let servo 3 brown out with each packet of torque-on; refused, outside, farthest, slowest."""
    refused = outside = 0
    farthest = slowest = 0.0
    for packet in range(1, PACKETS):
        noisy = Noisy(kind, packet)
        noisy.bus.open()
        board = kind.startswith("maestro")
        noisy.strike(packet, "brown-out" if board else "brown-out 3")
        try:
            noisy.enable_torque()
        except DriverError:
            refused += 1
            noisy.now += 1.0
            noisy.enable_torque()
        outcome = noisy.run("clear", 0.0, 300)
        outside += outcome.outside
        farthest = max(farthest, outcome.farthest)
        slowest = max(slowest, outcome.recover_s if outcome.recover_s is not None else 99.0)
    return refused, outside, farthest, slowest


def main() -> None:
    """Run the rows and print both tables."""
    table = Table(title="a running bus")
    for head in ("kind", "fault", "missing", "fresh", "wrong", "outside", "ended", "recover s"):
        table.add_column(head)
    for kind in KINDS:
        for fault in FAULTS:
            if kind.startswith("maestro") and fault in SMART_ONLY:
                continue
            one = run(kind, fault, 1000)
            recover = "never" if one.recover_s is None else f"{one.recover_s:.2f}"
            table.add_row(
                kind, fault, str(one.damaged), str(one.fresh), str(one.wrong), str(one.outside),
                one.ended[:40] or "no", recover,
            )  # fmt: skip
            print(kind, fault, one.errors, one.said[:4], file=sys.stderr)
    Console(width=130).print(table)
    table = Table(title=f"brown-out with each of the first {PACKETS - 1} packets of torque-on")
    for head in ("kind", "refused once", "outside", "by steps", "slowest recovery s"):
        table.add_column(head)
    for kind in KINDS:
        refused, outside, farthest, slowest = torque_on(kind)
        table.add_row(kind, str(refused), str(outside), f"{farthest:.0f}", f"{slowest:.2f}")
    Console(width=130).print(table)


if __name__ == "__main__":
    main()
