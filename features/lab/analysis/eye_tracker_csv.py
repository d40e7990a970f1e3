"""Reader of an eye tracker's CSV file: gaze samples or fixations; refuses ambiguous files.

The first line names the columns, in any order and case; other columns are ignored:

samples    time, x, y             one line per sample; an empty or NaN x or y is a lost eye
fixations  start, duration, part  one line per fixation, already labelled; or x, y for part

The name of a time column may end in its unit (time_s, time_ms, start_ms, ...). Without a unit, the
size of the steps decides between seconds and milliseconds, and the note states the choice.
"""

import csv
from collections.abc import Callable, Sequence
from math import inf, isfinite, nan
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_input import read_limited
from gazerig.gaze.types import PART_NAMES, PARTS, Floats

_NAMES = {
    "time": ("time", "t", "timestamp"),
    "start": ("start", "onset"),
    "duration": ("duration",),
    "x": ("x", "x_px", "gaze_x"),
    "y": ("y", "y_px", "gaze_y"),
    "part": ("part", "label", "aoi"),
}
_UNITS = {"_s": 1.0, "_ms": 1e-3}
_LOST = ("", "nan", "na", "n/a", "none", "null", ".", "-")
_OUTSIDE = (*_LOST, "outside", "other", "elsewhere")
# Trackers take 20-2000 samples a second: steps of 0.0005-0.05 in seconds, 0.5-50 in milliseconds.
_STEP_MS, _STEP_TOO_LARGE = 0.2, 200.0
# Fixations last 0.05-2 s: a median above this is in milliseconds.
_DURATION_MS = 5.0


class Samples(NamedTuple):
    """Gaze samples: time_s, x and y (n,) each, x and y NaN while the eye was lost."""

    time_s: Floats
    x: Floats
    y: Floats
    note: str


class FixationRow(NamedTuple):
    """One fixation of a table: part None outside all parts; p NaN without a position."""

    line: int
    start_s: float
    duration_s: float
    part: str | None
    p: tuple[float, float]


class FixationTable(NamedTuple):
    """Fixations of a table; labelled: the table has a part column."""

    rows: tuple[FixationRow, ...]
    labelled: bool
    note: str


class _TrackerTable(NamedTuple):
    """A CSV file: column names as written, and (line number, cells) of every row."""

    path: Path
    names: tuple[str, ...]
    header_line: int
    rows: tuple[tuple[int, list[str]], ...]


class _Column(NamedTuple):
    """Index of a column, its name as written, and its unit in seconds if the name has one."""

    at: int
    name: str
    unit_s: float | None


def read_recording(path: Path) -> Samples | FixationTable:
    """Read samples or fixations.

    Raises:
        SetupError: the message has the file, line, column and fault.
    """
    table = _read(path)
    if _find(table, "duration") is not None:
        return _fixations(table)
    return _samples(table)


def _samples(table: _TrackerTable) -> Samples:
    time = _require_column(table, "time")
    x, y = _require_column(table, "x"), _require_column(table, "y")
    raw = _numbers(table, time, _finite)
    _refuse_unsorted(table, time, raw)
    xs, ys = _numbers(table, x, _parse_or_lost), _numbers(table, y, _parse_or_lost)
    lost = ~(np.isfinite(xs) & np.isfinite(ys))
    if lost.all():
        raise SetupError(
            f"{table.path}: columns {x.name} and {y.name}: the eye is lost in all"
            f" {len(lost)} samples; nothing to fit"
        )
    unit_s, said = time.unit_s, "from its name"
    if unit_s is None:
        step = float(np.median(np.diff(raw))) if len(raw) > 1 else 0.0
        if step > _STEP_TOO_LARGE:
            raise SetupError(
                f"{table.path}: column {time.name}: steps of {step:g} are neither seconds nor"
                " milliseconds of a tracker; convert it and name it time_s or time_ms"
            )
        unit_s = 1e-3 if step > _STEP_MS else 1.0
        said = f"from its steps of {step:g}"
    note = f"column {time.name} is in {'s' if unit_s == 1.0 else 'ms'} ({said})"
    return Samples(raw * unit_s, np.where(lost, nan, xs), np.where(lost, nan, ys), note)


def _fixations(table: _TrackerTable) -> FixationTable:
    start, duration = _require_column(table, "start"), _require_column(table, "duration")
    part = _find(table, "part")
    starts, durations = _numbers(table, start, _finite), _numbers(table, duration, _is_positive)
    _refuse_unsorted(table, start, starts)
    if part is None and (_find(table, "x") is None or _find(table, "y") is None):
        raise _missing_column_error(table, "part")
    places = [(nan, nan)] * len(table.rows)
    parts: list[str | None] = [None] * len(table.rows)
    if part is None:
        x, y = _require_column(table, "x"), _require_column(table, "y")
        xs, ys = _numbers(table, x, _parse_or_lost), _numbers(table, y, _parse_or_lost)
        places = list(zip(xs.tolist(), ys.tolist(), strict=True))
    else:
        parts = [_part(table, part, line, row[part.at]) for line, row in table.rows]
    guess = 1e-3 if np.median(durations) > _DURATION_MS else 1.0
    unit_d = duration.unit_s or guess
    unit_t = start.unit_s or unit_d
    rows = zip(table.rows, starts * unit_t, durations * unit_d, parts, places, strict=True)
    known = start.unit_s is not None and duration.unit_s is not None
    said = "from their names" if known else f"from a median duration of {np.median(durations):g}"
    note = f"times are in {'s' if unit_d == 1.0 else 'ms'} ({said})"
    return FixationTable(
        tuple(FixationRow(row[0], float(t), float(d), p, at) for row, t, d, p, at in rows),
        part is not None,
        note,
    )


_LARGEST = 200_000_000  # largest size, bytes; an hour at 1000 Hz has about 100 MB


def _read(path: Path) -> _TrackerTable:
    try:
        text = read_limited(path, _LARGEST).decode("utf-8-sig")
    except OSError as error:
        raise SetupError(f"{path}: {error.strerror or error}; check the name") from None
    except UnicodeDecodeError:
        raise SetupError(f"{path}: not UTF-8 text; export the recording as CSV") from None
    first = next((line for line in text.splitlines() if line.strip()), "")
    if not first:
        raise SetupError(f"{path}: is empty")
    separator = max(",;\t", key=first.count)
    reader = csv.reader(text.splitlines(), delimiter=separator, skipinitialspace=True)
    rows: list[tuple[int, list[str]]] = []
    try:
        rows.extend((reader.line_num, row) for row in reader if any(cell.strip() for cell in row))
    except csv.Error as error:
        raise SetupError(f"{path}:{reader.line_num}: {error}") from None
    (header_line, header), *body = rows
    names = tuple(cell.strip() for cell in header)
    for line, row in body:
        if len(row) != len(names):
            raise SetupError(f"{path}:{line}: {len(row)} cells under {len(names)} column names")
    if not body:
        raise SetupError(f"{path}: no line after the column names")
    return _TrackerTable(path, names, header_line, tuple(body))


def _find(table: _TrackerTable, wanted: str) -> _Column | None:
    """Find a column by one of its names, with or without a unit."""
    for at, name in enumerate(table.names):
        plain = name.lower()
        if plain in _NAMES[wanted]:
            return _Column(at, name, None)
        for ending, unit_s in _UNITS.items():
            if plain.endswith(ending) and plain.removesuffix(ending) in _NAMES[wanted]:
                return _Column(at, name, unit_s)
    return None


def _require_column(table: _TrackerTable, wanted: str) -> _Column:
    column = _find(table, wanted)
    if column is None:
        raise _missing_column_error(table, wanted)
    return column


def _missing_column_error(table: _TrackerTable, wanted: str) -> SetupError:
    found = ", ".join(name or "(no name)" for name in table.names[:8])
    return SetupError(
        f"{table.path}:{table.header_line}: no column {wanted}; found: {found}; wanted: time, x, y"
        " of samples, or start, duration, part of fixations"
    )


def _numbers(table: _TrackerTable, column: _Column, read: Callable[[str], float]) -> Floats:
    """Read a column as numbers."""
    out = np.empty(len(table.rows))
    for i, (line, row) in enumerate(table.rows):
        try:
            out[i] = read(row[column.at].strip())
        except ValueError as error:
            raise SetupError(f"{_place(table, line, column)}: {error}") from None
    return out


def _finite(cell: str) -> float:
    try:
        number = float(cell)
    except ValueError:
        raise ValueError(f"{cell[:40]!r} is not a number") from None
    if not isfinite(number):
        raise ValueError(f"{cell[:40]!r} is not a finite number")
    return number


def _is_positive(cell: str) -> float:
    number = _finite(cell)
    if number <= 0.0:
        raise ValueError(f"{cell} is not above 0")
    return number


def _parse_or_lost(cell: str) -> float:
    return nan if cell.lower() in _LOST else _finite(cell)


def _part(table: _TrackerTable, column: _Column, line: int, cell: str) -> str | None:
    """Parse a part's code or name; None for a fixation outside."""
    word = cell.strip().lower()
    if word in _OUTSIDE:
        return None
    for part in PARTS:
        if word in (part.lower(), PART_NAMES[part]):
            return part
    known = ", ".join(f"{part} ({PART_NAMES[part]})" for part in PARTS)
    raise SetupError(
        f"{_place(table, line, column)}: no part {cell.strip()[:40]!r}; known: {known}, outside"
    )


def _refuse_unsorted(
    table: _TrackerTable, column: _Column, times: Sequence[float] | Floats
) -> None:
    before = -inf
    for (line, _), now in zip(table.rows, times, strict=True):
        if now <= before:
            raise SetupError(
                f"{_place(table, line, column)}: {now:g} does not come after {before:g}:"
                " sort by time, one recording a file"
            )
        before = now


def _place(table: _TrackerTable, line: int, column: _Column) -> str:
    return f"{table.path}:{line}: column {column.name}"
