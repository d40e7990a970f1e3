"""Rows of a bench: what is wanted, what was measured, and whether it is inside; before and after.

A row is a module ``row_NN_name`` with a title (first line of its docstring), a function ``measure``
that returns figures by name, and WANTED, the band of each. A bench calls ``measure_all``.
"""

import argparse
import importlib
import json
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

TESTS = Path(__file__).parents[1]
sys.path.insert(0, str(TESTS))

Measure = Callable[[ModuleType], dict[str, float]]


def arguments(doc: str) -> argparse.ArgumentParser:
    """Return the options that all such benches share."""
    parser = argparse.ArgumentParser(description=doc.splitlines()[0])
    parser.add_argument("--rows", type=int, nargs="+", help="only these rows")
    parser.add_argument("--save", type=Path)
    parser.add_argument("--against", type=Path, help="a file that --save wrote before")
    return parser


def rows(folder: str) -> dict[int, ModuleType]:
    """Return the modules of all rows in a folder of the tests, by number."""
    return {
        int(file.stem.split("_")[1]): importlib.import_module(f"{folder}.{file.stem}")
        for file in sorted((TESTS / folder).glob("row_*.py"))
    }


def progress(text: str) -> None:
    """Write over the line of progress."""
    if sys.stderr.isatty():
        print(f"\r\x1b[K{text[:150]}", end="", file=sys.stderr, flush=True)
    elif text:
        print(text, file=sys.stderr, flush=True)


def measured(row: ModuleType, measure: Measure) -> dict[str, Any]:
    """Return the figures of a row, or why there are none."""
    began_s = time.process_time()
    try:
        figures, failed = measure(row), ""
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


def measure_all(
    folder: str, args: argparse.Namespace, parser: argparse.ArgumentParser, measure: Measure
) -> str:
    """Measure and print the requested rows; return how many figures are inside.

    Args:
        folder: of the tests with the rows.
        args: what the parser of ``arguments`` read.
        parser: of the command line; a row that is not there ends it.
        measure: calls a row's own function.
    """
    known = rows(folder)
    if unknown := sorted(set(args.rows or ()) - set(known)):
        there = ", ".join(map(str, known))
        parser.error(f"--rows {unknown[0]}: there is no such row; there is {there}")
    before = json.loads(args.against.read_text(encoding="utf-8"))["rows"] if args.against else {}
    numbers = args.rows or list(known)
    out: dict[str, dict[str, Any]] = {}
    for done, number in enumerate(numbers):
        progress(f"row {number}, {done + 1} of {len(numbers)}")
        out[str(number)] = measured(known[number], measure)
        progress("")
        print("\n".join(shown(number, out[str(number)], before.get(str(number), {}))), flush=True)
        if out[str(number)]["failed"]:
            print(out[str(number)]["failed"], file=sys.stderr)
    if args.save:
        options = {k: v for k, v in vars(args).items() if isinstance(v, bool | int | float)}
        args.save.write_text(
            json.dumps({**options, "rows": out}, indent=1) + "\n", encoding="utf-8"
        )
    words = [word(row, name) for row in out.values() for name in row["wanted"]]
    return f"{words.count('inside')} of {len(words)} figures inside"
