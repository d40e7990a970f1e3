"""Faults injected and survived, by kind of bus: python tests/bench/bench_faults.py [--rates 100]

Every fault of tests/struck_rigs.py strikes the shipped rig of each kind with all its joints
for a second while it moves under its guard, in simulated time. A fault is survived if no
servo left its limits, none was faster than it may, and in the end all joints move as before
or those that do not are limp or still and named with their cause.
"""

import argparse
import importlib
import json
import sys
from collections import Counter
from pathlib import Path

from rich.console import Console
from rich.table import Table

from gazerig.config.schema import load_rig
from gazerig.drivers.errors import DriverError
from gazerig.testing.fault_machine import Machine, pair_of

TESTS = Path(__file__).parents[1]
HEADS = (
    "rig",
    "Hz",
    "faults",
    "survived",
    "came back",
    "left, named",
    "longest read",
    "back after",
)

out = Console(width=110)


def main() -> None:
    """Run all faults and print the counts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rates", type=float, nargs="*", default=[100.0, 200.0], metavar="HZ")
    parser.add_argument("--kinds", nargs="*", default=["dynamixel", "feetech", "maestro"])
    chosen = parser.parse_args()
    table = Table("kind", *HEADS, title="each fault for 1 s in a moving head, simulated time")
    rows = [row for kind in chosen.kinds for row in of_kind(kind, chosen.rates)]
    for row in rows:
        table.add_row(*map(str, row.values()))
    out.print(table)
    print(json.dumps(rows))


def of_kind(kind: str, rates: list[float]) -> list[dict[str, object]]:
    """Strike one kind's rig at every rate; gives the counts."""
    sys.path.insert(0, str(TESTS))
    struck = importlib.import_module("struck_rigs")
    rig = load_rig(struck.RIGS[kind])
    rows = []
    for rate_hz in rates:
        ends: Counter[str] = Counter()
        longest_s, after_s = 0.0, []
        for case in struck.CASES[kind]:
            machine = Machine(rig, rate_hz)
            machine.volts = struck.VOLTS[kind]
            try:
                machine.start()
                outcome = machine.apply_fault(*pair_of(rig, kind), case)
            except (AssertionError, DriverError) as error:
                ends["broken"] += 1
                out.print(f"{kind}, {rate_hz:g} Hz, {case.name}: {error}")
                continue
            ends[outcome.end if outcome.survived else "broken"] += 1
            longest_s = max(longest_s, outcome.longest_s)
            if outcome.end == "came back":
                after_s.append(outcome.after_s)
            elif not outcome.survived:
                out.print(f"{kind}, {rate_hz:g} Hz, {case.name}: {outcome.end}")
        total = len(struck.CASES[kind])
        values = (
            kind,
            f"{rig.name}, {len(rig.names)} joints",
            f"{rate_hz:g}",
            total,
            total - ends["broken"],
            ends["came back"],
            ends["left, named"],
            f"{longest_s * 1e3:.0f} ms",
            f"{max(after_s):.1f} s",
        )
        rows.append(dict(zip(("kind", *HEADS), values, strict=True)))
    return rows


if __name__ == "__main__":
    main()
