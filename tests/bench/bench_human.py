"""How human the running product is: python tests/bench/bench_human.py [--rows 1 7] [--save FILE]

Measures every row of tests/human (from the shipped scene to measured joints of byte-true emulated
servos, in simulated time) and prints what is wanted, what was measured, and whether it is inside;
with --against a file that --save wrote, also what it was before. Nothing here passes or fails.

Each run (scene, profile, seed, overrides) is made once for all rows of a process.
"""

import argparse
import importlib
import json
import sys
import time
import traceback
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))

from human.measured_run import MeasuredRun, measured_run  # noqa: E402

ROWS = HERE.parent / "human"
Figures = dict[str, dict[str, Any]]


def rows() -> dict[int, ModuleType]:
    """Return the modules of all rows by number."""
    files = sorted(ROWS.glob("row_*.py"))
    return {
        int(file.stem.split("_")[1]): importlib.import_module(f"human.{file.stem}")
        for file in files
    }


def told(*args: Any, **named: Any) -> MeasuredRun:
    """Return a measured run, and say on standard error that it is made."""
    scene = args[0] if isinstance(args[0], str) else args[0].name
    rest = ", ".join(map(str, (*args[1:], *(f"{k}={v}" for k, v in named.items()))))
    progress(f"  {scene} ({rest})")
    return measured_run(*args, **named)


def progress(text: str) -> None:
    """Write over the line of progress."""
    if sys.stderr.isatty():
        print(f"\r\x1b[K{text[:150]}", end="", file=sys.stderr, flush=True)
    elif text:
        print(text, file=sys.stderr, flush=True)


def measure(row: ModuleType, seconds: float, seeds: range) -> dict[str, Any]:
    """Return the figures of a row, or why there are none."""
    began_s = time.process_time()
    try:
        figures, failed = row.measure(told, seconds, seeds), ""
    except Exception:
        figures, failed = {}, traceback.format_exc(limit=-3)
    return {
        "title": (row.__doc__ or "").splitlines()[0],
        "figures": {name: float(value) for name, value in figures.items()},
        "wanted": {name: list(band) for name, band in row.WANTED.items()},
        "processor_s": time.process_time() - began_s,
        "failed": failed,
    }


def shown(number: int, row: dict[str, Any], before: dict[str, Any]) -> Iterator[str]:
    """Yield the lines of one row."""
    yield f"\n{number:2d}  {row['title']}  ({row['processor_s']:.0f} s of processor)"
    if row["failed"]:
        yield f"    failed: {row['failed'].strip().splitlines()[-1]}"
    names = [*row["wanted"], *(n for n in row["figures"] if n not in row["wanted"])]
    for name in names:
        value = row["figures"].get(name)
        was = before.get("figures", {}).get(name)
        yield (
            f"    {name:52.52} {band(row['wanted'].get(name)):>16} "
            f"{'' if was is None else f'{was:.3f} ->':>12} "
            f"{'-' if value is None else f'{value:.3f}':>9}  {word(row, name)}"
        )


def band(wanted: list[float] | None) -> str:
    """Return a band as text."""
    return "" if wanted is None else f"{wanted[0]:g} .. {wanted[1]:g}"


def word(row: dict[str, Any], name: str) -> str:
    """Return whether a figure is inside its band."""
    if name not in row["wanted"]:
        return ""
    low, high = row["wanted"][name]
    value = row["figures"].get(name)
    if value is None or value != value:
        return "NOT MEASURED"
    return "inside" if low <= value <= high else "OUTSIDE"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rows", type=int, nargs="+", help="only these rows")
    parser.add_argument("--seconds", type=float, default=300.0)
    parser.add_argument("--seeds", type=int, default=3, help="number of seeds, from 0")
    parser.add_argument("--save", type=Path)
    parser.add_argument("--against", type=Path)
    args = parser.parse_args()
    known = rows()
    if unknown := sorted(set(args.rows or ()) - set(known)):
        parser.error(
            f"--rows {unknown[0]}: there is no such row; there is {', '.join(map(str, known))}"
        )
    before = json.loads(args.against.read_text(encoding="utf-8"))["rows"] if args.against else {}
    numbers = args.rows or list(known)
    out: Figures = {}
    for done, number in enumerate(numbers):
        progress(f"row {number}, {done + 1} of {len(numbers)}")
        out[str(number)] = measure(known[number], args.seconds, range(args.seeds))
        progress("")
        print("\n".join(shown(number, out[str(number)], before.get(str(number), {}))), flush=True)
        if out[str(number)]["failed"]:
            print(out[str(number)]["failed"], file=sys.stderr)
    words = [word(row, name) for row in out.values() for name in row["wanted"]]
    print(f"\n{words.count('inside')} of {len(words)} figures inside "
          f"({args.seconds:g} s, {args.seeds} seeds)")  # fmt: skip
    if args.save:
        held = {"seconds": args.seconds, "seeds": args.seeds, "rows": out}
        args.save.write_text(json.dumps(held, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
