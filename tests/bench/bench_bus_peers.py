"""The servo bus and clients of other projects in one run: python tests/bench/bench_bus_peers.py

Nine servos; a cycle is one (fast) sync read of all and one sync write of goals, cycle after
cycle without a pause, over pseudo-terminals with the emulator in a process of its own. Rounds
of all clients take turns, so that what else the machine does strikes them alike; of rounds the
least and the median are given, and ratios of medians. "bare" is a loop of select and read in a
few lines, with the same checks: what is lost against it is the driver's. Nothing here passes or
fails: compare figures of one run with each other, on a machine that has nothing else to do.

    processor time    without the bytes' time on the wire, against rustypot and ROBOTIS' SDK
    rate              with it, at 1 and 4 Mbaud, against the bare client
    lost values       of all cycles; --only ours --rounds 100 --cycles 1000 counts long
"""

import argparse
import json
import os
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from statistics import median
from typing import NamedTuple

from bus_clients import IDS, MODELS, Client, Cycle, clients, ours
from rich.console import Console
from rich.table import Table

from gazerig.sim_mock.devices import DynamixelLine, Emulated, FeetechLine
from gazerig.sim_mock.pty.client import PtyBus
from gazerig.sim_mock.smart_servo.physics import ServoSpec

WIRES = {
    "dynamixel": ("dynamixel", None),
    "dynamixel-1M": ("dynamixel", 1_000_000),
    "dynamixel-4M": ("dynamixel", 4_000_000),
    "feetech": ("feetech", None),
    "feetech-1M": ("feetech", 1_000_000),
}
"""What is measured: the kind of bus, and its baud rate where bytes take their time."""

out = Console(width=110)


class Spans(NamedTuple):
    """Of one round: time and processor time a cycle, values lost."""

    cycle_us: float
    cpu_us: float
    lost: int


def emulated(kind: str, baud: int | None) -> Emulated:
    """Return nine servos of one kind."""
    specs = tuple(ServoSpec(i, MODELS[kind], 2048) for i in IDS)
    return FeetechLine(specs, baud) if kind == "feetech" else DynamixelLine(specs, baud)


@contextmanager
def opened(kind: str, wire: int | None, chosen: Sequence[Client]) -> Iterator[dict[str, Cycle]]:
    """Open every client on a bus of its own, whose servos answer at once."""
    baud = wire or 1_000_000
    with ExitStack() as stack:
        cycles = {}
        for client in chosen:
            server = stack.enter_context(PtyBus())
            path = server.start_device(emulated(kind, wire), wire_time=wire is not None)
            with ours(kind, path, baud):  # sets the servos up, for all clients alike
                pass
            cycles[client.name] = stack.enter_context(client.opened(path, baud))
        yield cycles


def a_round(cycle: Cycle, count: int) -> Spans:
    """Run one round."""
    values = 0
    cpu, start = time.process_time(), time.perf_counter()
    for k in range(count):
        values += cycle(k)
    spent, used = time.perf_counter() - start, time.process_time() - cpu
    return Spans(1e6 * spent / count, 1e6 * used / count, len(IDS) * count - values)


def in_turns(cycles: Mapping[str, Cycle], rounds: int, count: int) -> dict[str, list[Spans]]:
    """Run rounds of all alternately; the first, to warm up, is not counted."""
    found: dict[str, list[Spans]] = {name: [] for name in cycles}
    for nth in range(rounds + 1):
        for name, cycle in cycles.items():
            spans = a_round(cycle, count)
            if nth:
                found[name].append(spans)
    return found


def tell(wired: str, chosen: Sequence[Client], found: Mapping[str, Sequence[Spans]]) -> None:
    """Print a table, and its figures as one line of JSON."""
    table = Table(title=f"{wired}, {len(IDS)} servos: least / median of rounds")
    for head in ("client", "reads", "Hz", "CPU us", "rate of bare", "CPU of rustypot", "lost"):
        table.add_column(head)
    cycle = {name: median(s.cycle_us for s in rounds) for name, rounds in found.items()}
    cpu = {name: median(s.cpu_us for s in rounds) for name, rounds in found.items()}
    figures = {}
    for name, reads, _ in chosen:
        rate = cycle["bare"] / cycle[name] if "bare" in cycle else 0.0
        work = cpu[name] / cpu["rustypot"] if "rustypot" in cpu else 0.0
        lost = sum(spans.lost for spans in found[name])
        least = min(spans.cycle_us for spans in found[name])
        least_cpu = min(spans.cpu_us for spans in found[name])
        table.add_row(
            name,
            reads,
            f"{1e6 / least:.0f} / {1e6 / cycle[name]:.0f}",
            f"{least_cpu:.1f} / {cpu[name]:.1f}",
            f"{rate:.1%}" if rate else "-",
            f"x {work:.2f}" if work else "-",
            str(lost),
        )
        figures[name] = {
            "cycle_us": round(cycle[name], 1),
            "cpu_us": round(cpu[name], 1),
            "lost": lost,
        }
    out.print(table)
    print(json.dumps({"wired": wired, "load": os.getloadavg()[0], "clients": figures}))


def main() -> None:
    """Measure, and print tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--cycles", type=int, default=200, help="in each round")
    parser.add_argument("--only", nargs="*", default=(), help="clients by name")
    parser.add_argument("--wired", nargs="*", default=tuple(WIRES), choices=tuple(WIRES))
    args = parser.parse_args()
    out.print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.2f} at the start")
    for wired in args.wired:
        kind, baud = WIRES[wired]
        chosen = [c for c in clients(kind) if not args.only or c.name in args.only]
        with opened(kind, baud, chosen) as cycles:
            found = in_turns(cycles, args.rounds, args.cycles)
        tell(wired, chosen, found)


if __name__ == "__main__":
    main()
