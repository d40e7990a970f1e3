"""Likeness to people of a run: python tests/bench/bench_human.py [--rows 1 7] [--save FILE]

Measures every row of tests/human (from the shipped scene to measured joints of byte-true emulated
servos, in simulated time) and prints what is wanted, what was measured, and whether it is inside;
with --against a file that --save wrote, also what it was before. Nothing here passes or fails.

Each run (scene, profile, seed, overrides) is made once for all rows of a process.
"""

from types import ModuleType
from typing import Any

from measured_rows import arguments, measure_all, progress

from human.measured_run import MeasuredRun, measured_run  # isort: skip


def told(*args: Any, **named: Any) -> MeasuredRun:
    """Return a measured run, and report its start on standard error."""
    scene = args[0] if isinstance(args[0], str) else args[0].name
    rest = ", ".join(map(str, (*args[1:], *(f"{k}={v}" for k, v in named.items()))))
    progress(f"  {scene} ({rest})")
    return measured_run(*args, **named)


def main() -> None:
    """Measure and print."""
    parser = arguments(__doc__)
    parser.add_argument("--seconds", type=float, default=300.0)
    parser.add_argument("--seeds", type=int, default=3, help="number of seeds, from 0")
    parser.add_argument("--each", action="store_true", help="also the value of each seed")
    args = parser.parse_args()

    def measure(row: ModuleType) -> dict[str, float]:
        found: dict[str, float] = row.measure(told, args.seconds, range(args.seeds))
        for seed in range(args.seeds) if args.each else ():
            alone = row.measure(told, args.seconds, [seed])
            progress("")
            print(f"    seed {seed}: " + "; ".join(f"{k} {v:.3f}" for k, v in alone.items()))
        return found

    inside = measure_all("human", args, parser, measure)
    print(f"\n{inside} ({args.seconds:g} s, {args.seeds} seeds)")


if __name__ == "__main__":
    main()
