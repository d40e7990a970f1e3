"""The result of one run of a sweep: figures of the summary and of the report as flat columns."""

import csv
import io
import json
from collections.abc import Iterator, Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple

from gazerig.drivers.files.file_output import write_file
from gazerig.features.lab.analysis.human_norms import BANDS, BY_KEY
from gazerig.features.lab.report.gaze_trace import GazeTrace
from gazerig.features.lab.report.measures import measure_run
from gazerig.features.lab.report.statistics import MeasureResult, judge_without_interval
from gazerig.features.lab.sweep.axes import Point

Column = float | int | str | bool | None
Figures = Mapping[str, Column]

OUTSIDE, DISTANCE = "report.outside", "report.distance"
"""Columns: measures outside their bands, and the same graded (see ``result_grade``)."""
VERDICT = "verdict."
REPORT = "report."
_HALF = 0.25
_NOT_REPRODUCED = ("wall_seconds",)


class Outcome(NamedTuple):
    """The result of one run.

    Attributes:
        point: its parameters.
        seed: seed of its random generators.
        figures: columns; empty if it failed.
        failure: reason of a failure, "" otherwise.
    """

    point: Point
    seed: int
    figures: Figures
    failure: str = ""


def run_figures(figures: Mapping[str, object], trace: GazeTrace) -> dict[str, Column]:
    """Return the columns of a run, in the order of a table.

    A measure KEY of the report is in ``report.KEY``, its verdict in ``verdict.KEY``.
    """
    results = [judge_without_interval(one, BY_KEY[one.key]) for one in measure_run(trace)]
    words = [result.verdict for result in results]
    columns: dict[str, Column] = {
        OUTSIDE: words.count("outside"),
        "report.pass": words.count("pass"),
        "report.too_few_events": words.count("too few events"),
        DISTANCE: sum(result_grade(result) for result in results),
    }
    for result in results:
        columns[REPORT + result.band.key] = result.value if isfinite(result.value) else None
        columns[VERDICT + result.band.key] = result.verdict
    shown = {key: held for key, held in figures.items() if key not in _NOT_REPRODUCED}
    return columns | dict(_flat(shown))


def result_grade(result: MeasureResult) -> float:
    """Return the distance of a measure from its band: 0 inside, 1 far away, 0.5 at a quarter."""
    if result.verdict != "outside":
        return 0.0
    return grade(result.value, result.band.low, result.band.high)


def grade(value: float, low: float, high: float) -> float:
    """Return the distance of a value from a band, in widths of the band w: w / (w + 0.25)."""
    widths = max(low - value, value - high, 0.0) / (high - low)
    return widths / (widths + _HALF)


def table_columns(outcomes: Sequence[Outcome]) -> list[str]:
    """Return all columns of the runs' figures, those of the report first."""
    names = {name: None for one in outcomes for name in one.figures}
    known = [OUTSIDE, "report.pass", "report.too_few_events", DISTANCE]
    known += [f"{kind}{band.key}" for band in BANDS for kind in (REPORT, VERDICT)]
    return [name for name in known if name in names] + [n for n in names if n not in set(known)]


def _flat(held: Mapping[str, object], above: str = "") -> Iterator[tuple[str, Column]]:
    """Yield nested figures as columns with dotted names; for a list, its length."""
    for name, value in held.items():
        key = f"{above}{name}"
        if isinstance(value, Mapping):
            yield from _flat(value, f"{key}.")
        elif isinstance(value, list | tuple):
            yield key, len(value)
        elif isinstance(value, float) and not isfinite(value):
            yield key, None
        elif value is None or isinstance(value, float | int | str | bool):
            yield key, value
        else:
            yield key, str(value)


SEED, FAILED = "seed", "failed"
CSV = "table.csv"


def table_rows(outcomes: Sequence[Outcome]) -> tuple[list[str], list[list[Any]]]:
    """Return the columns (parameters, seed, failure, figures) and one row for each run."""
    keys = list({key: None for one in outcomes for key in one.point})
    figures = table_columns(outcomes)
    rows = [
        [
            *(
                json.dumps(v) if isinstance(v, list | tuple | dict) else v  # lists as JSON
                for v in map(one.point.get, keys)
            ),
            one.seed,
            one.failure,
            *(one.figures.get(name) for name in figures),
        ]
        for one in outcomes
    ]
    return [*keys, SEED, FAILED, *figures], rows


def write_table(folder: Path, outcomes: Sequence[Outcome]) -> Path:
    """Write ``CSV``; return the file.

    Raises:
        SetupError: it cannot be written.
    """
    columns, rows = table_rows(outcomes)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(rows)
    write_file(folder / CSV, text.getvalue(), force=True)
    return folder / CSV
