"""Gaze and perception against people and bands: judge.py [--short] [--rows human/1]

Measures the rows of human (the running product, from a scene to the joints of byte-true emulated
servos, in simulated time) and of seeing (perception), side by side, and prints
what is wanted, what was measured, and whether it is inside. The exit status is 1 if a figure is
outside its band or a row fails. With --short: one seed, short runs, the rows of SHORT alone.

A row is a module row_NN_name with a title (the first line of its docstring), WANTED, the band of
each figure, and a function measure that returns figures by name.
"""

import argparse
import importlib
import os
import sys
import time
import traceback
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

# Rows run side by side, one on each processor, and without files that the user has fetched.
for threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "OPENCV_FOR_THREADS_NUM"):
    os.environ.setdefault(threads, "1")
os.environ["GAZERIG_MODELS"] = os.path.join(os.devnull, "models")

TESTS = Path(__file__).parent
sys.path.insert(0, str(TESTS.parent / "helpers"))
LONG_S, LONG_SEEDS = 300.0, 3
SHORT_S = 60.0
SHORT = (
    *(f"human/{number}" for number in (44, 1, 2, 42, 14, 4, 6, 9, 10, 11, 13, 15, 17, 48)),
    *(f"seeing/{number}" for number in (2, 3, 5, 11)),
)
"""Rows whose figures settle in a short run; the gain of human/35 scatters by .01 between seeds."""


@dataclass
class Row:
    """What a row measured."""

    name: str
    title: str
    wanted: dict[str, tuple[float, float]] = field(default_factory=dict)
    figures: dict[str, float] = field(default_factory=dict)
    failed: str = ""
    processor_s: float = 0.0

    def verdict(self, figure: str) -> str:
        """Return whether a figure is inside its band; nothing without a band or a value."""
        value = self.figures.get(figure)
        if figure not in self.wanted or value is None:
            return ""
        low, high = self.wanted[figure]
        return "inside" if low <= value <= high else "OUTSIDE"

    def lines(self) -> Iterator[str]:
        """Yield the row's part of the table."""
        yield f"\n{self.name:10} {self.title}  ({self.processor_s:.0f} s of processor)"
        if self.failed:
            yield self.failed
        for figure, value in self.figures.items():
            low, high = self.wanted.get(figure, (None, None))
            band = "" if low is None else f"{low:g} .. {high:g}"
            yield f"    {figure:64.64} {band:>16} {value:9.3f}  {self.verdict(figure)}"


def row_files() -> dict[str, str]:
    """Return the modules of all rows by name, "human/1"."""
    return {
        f"{file.parent.name}/{int(file.stem.split('_')[1])}": f"{file.parent.name}.{file.stem}"
        for folder in ("human", "seeing")
        for file in sorted((TESTS / folder).glob("row_*.py"))
    }


def measure(name: str, options: tuple[float, int, bool]) -> Row:
    """Measure a row; options: seconds and seeds of runs, whether on all material that is there."""
    seconds, seeds, full = options
    module = importlib.import_module(row_files()[name])
    row = Row(name, (module.__doc__ or "").splitlines()[0], dict(module.WANTED))
    began_s = time.process_time()
    try:
        if name.startswith("human/"):
            from human.measured_run import Runs

            figures = module.measure(Runs(seconds, range(seeds)))
        else:
            figures = module.measure(full)
        row.figures = {figure: float(value) for figure, value in figures.items()}
    except Exception:
        row.failed = traceback.format_exc(limit=-3)
    row.processor_s = time.process_time() - began_s
    return row


def main() -> int:
    """Measure and print; return the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--short", action="store_true", help="one seed, short runs, some rows")
    parser.add_argument("--rows", nargs="+", choices=row_files(), help="only these rows")
    parser.add_argument("--seconds", type=float, help="of a run of the rows of human/")
    args = parser.parse_args()
    seconds = args.seconds or (SHORT_S if args.short else LONG_S)
    given = seconds, 1 if args.short else LONG_SEEDS, not args.short
    names = args.rows or (SHORT if args.short else row_files())
    rows = []
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        for row in pool.map(partial(measure, options=given), names):
            rows.append(row)
            print("\n".join(row.lines()), flush=True)
    verdicts = [row.verdict(figure) for row in rows for figure in row.figures]
    failed = [row.name for row in rows if row.failed]
    outside = [row.name for row in rows if "OUTSIDE" in map(row.verdict, row.figures)]
    print(f"\n{verdicts.count('inside')} figures inside, {verdicts.count('OUTSIDE')} OUTSIDE")
    for words, which in (("outside", outside), ("failed", failed)):
        if which:
            print(f"{words}: {', '.join(which)}")
    return 1 if outside or failed else 0


if __name__ == "__main__":
    sys.exit(main())
