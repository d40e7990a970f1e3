"""Noise on every kind of servo bus: python tests/attack/line_noise.py [--cycles 100000]

Each row is one run on simulated time: n cycles in which a share of all bytes, to the
servos and back, is changed, lost or doubled; or in which earlier answers arrive again
first. Wrong: values given as fresh that were not true. Outside: ticks in which a joint was
beyond its range. Recover: time until all is well once the line is quiet.
"""

import argparse
import sys
import time
from pathlib import Path

from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parents[1]))

from line_noise import KINDS, Noisy, Outcome  # noqa: E402

RATES = (0.2, 1.0, 5.0)


def main() -> None:
    """Run the rows and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cycles", type=int, default=100_000)
    parser.add_argument("--kinds", nargs="+", default=KINDS)
    parser.add_argument("--rates", nargs="+", type=float, default=RATES, help="percent of bytes")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--no-repeat", action="store_true")
    chosen = parser.parse_args()
    table = Table(title=f"{chosen.cycles} cycles a row, six servos, 200 Hz")
    for head in ("kind", "fault", "cycles", "missing", "fresh", "wrong", "worst", "outside", "by",
                 "speed", "ended", "recover s", "cpu us"):  # fmt: skip
        table.add_column(head)
    for kind in chosen.kinds:
        faults = [(f"static {rate}", rate) for rate in chosen.rates]
        for fault, rate in faults + ([] if chosen.no_repeat else [("repeat", 0.0)]):
            noisy = Noisy(kind, chosen.seed)
            noisy.start()
            began = time.process_time()
            outcome = noisy.run(fault, rate, chosen.cycles)
            _add(table, fault, outcome, time.process_time() - began)
    Console(width=150).print(table)


def _add(table: Table, fault: str, one: Outcome, cpu_s: float) -> None:
    recover = "never" if one.recover_s is None else f"{one.recover_s:.2f}"
    table.add_row(
        one.kind, fault, str(one.cycles), str(one.damaged), str(one.fresh), str(one.wrong),
        f"{one.worst:.0f}", str(one.outside), f"{one.farthest:.0f}", f"x{one.fastest:.2f}",
        one.ended[:40] or "no", recover, f"{cpu_s / max(1, one.cycles) * 1e6:.0f}",
    )  # fmt: skip
    print(one.kind, fault, one.errors, one.said[:6], file=sys.stderr)


if __name__ == "__main__":
    main()
