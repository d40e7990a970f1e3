"""Reader of an eye tracker's table: gaze samples or fixations; refuses ambiguous files.

The first line names the columns, in any order and case; other columns are ignored:

samples    time, x, y             one line per sample; a missing x or y is a lost eye
fixations  start, duration, part  one line per fixation, already labelled; or x, y for part

Exports of Tobii Pro Lab and of Pupil Labs' Neon are read by their own names. The name of a column
may have a unit: time_ms, time [us]. Without one, the size of the steps decides, and the note
states the choice.
"""

import csv
import re
from collections.abc import Callable, Mapping
from math import isfinite, nan
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_input import read_limited
from gazerig.gaze.scanpath.fit import PartFixation
from gazerig.gaze.types import PART_NAMES, PARTS, Floats

NAMES = {
    "time": ("time", "t", "timestamp", "recording timestamp", "recordingtimestamp"),
    "start": ("start", "onset", "start timestamp"),
    "duration": ("duration",),
    "x": ("x", "gaze position in reference image x", "gaze x", "gaze point x", "gazepointx",
          "fixation x"),
    "y": ("y", "gaze position in reference image y", "gaze y", "gaze point y", "gazepointy",
          "fixation y"),
    "part": ("part", "label", "aoi"),
}  # fmt: skip
"""Columns that are read, with the names that are known for each."""

_NAME = re.compile(r"(?P<name>.+?)(?:\s*[\[(](?P<unit>[^\])]*)[\])]|_(?P<ending>s|ms|us|ns|px))?")
_UNITS_S = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_SENSOR, _EYES = "sensor", "eye tracker"
"""Tobii's rows of mouse, keyboard and events have another sensor, or none."""

_LOST = ("", "nan", "na", "n/a", "none", "null", ".", "-")
_OUTSIDE = (*_LOST, "outside", "other", "elsewhere")
# Trackers take 20-2000 samples a second: steps are 0.0005-0.05 s. Fixations last 0.05-2 s.
_LONGEST_STEP_S, _LONGEST_FIXATION_S = 0.2, 5.0
_LARGEST = 200_000_000  # largest size, bytes; an hour at 1000 Hz has about 100 MB


def read_number(cell: str) -> float:
    """Return the number in a cell, with a decimal point or comma; NaN if it is missing.

    Raises:
        ValueError: It is neither.
    """
    if cell.lower() in _LOST:
        return nan
    try:
        number = float(cell.replace(",", "."))
    except ValueError:
        number = nan
    if not isfinite(number):
        raise ValueError(f"{cell[:40]!r} is not a finite number")
    return number


class Samples(NamedTuple):
    """Gaze samples: time_s, x and y (n,) each, x and y NaN while the eye was lost."""

    time_s: Floats
    x: Floats
    y: Floats
    note: str


def read_recording(
    path: Path,
    mapping: Mapping[str, str],
    part_at: Callable[[float, float], str | None] | None = None,
) -> Samples | tuple[list[PartFixation], str]:
    """Read samples, or fixations with a note on their units.

    Args:
        path: Table with commas, semicolons or tabs.
        mapping: Names of the file's columns by those of ``NAMES``.
        part_at: Returns the part at a place, for fixations without parts.

    Raises:
        SetupError: The message has the file, line, column and fault.
    """
    table = _Table(path, mapping)
    kind = "start" if table.find("start") is not None else "time"
    times = table.numbers(kind, required=True)
    late = np.flatnonzero(np.diff(times) <= 0.0)
    if len(late):
        now = times[late[0] + 1]
        raise table.fault(kind, int(late[0]) + 1, f"{now:g} does not come after {times[late[0]]:g}:"
                          " sort by time, one recording a file")  # fmt: skip
    if kind == "time":
        unit_s, note = table.unit_s(kind, np.diff(times), _LONGEST_STEP_S)
        x, y = table.numbers("x"), table.numbers("y")
        lost = ~(np.isfinite(x) & np.isfinite(y))
        if lost.all():
            raise SetupError(f"{path}: the eye is lost in all {len(lost)} samples; nothing to fit")
        x[lost] = y[lost] = nan
        return Samples(times * unit_s, x, y, note)
    durations = table.numbers("duration", required=True)
    for row in np.flatnonzero(durations <= 0.0)[:1]:
        raise table.fault("duration", row, f"{durations[row]:g} is not above 0")
    unit_s, note = table.unit_s("duration", durations, _LONGEST_FIXATION_S)
    start_s, _ = table.unit_s("start", durations, _LONGEST_FIXATION_S)
    if table.find("part") is not None or table.find("x") is None:
        parts = [table.part(row) for row in range(len(times))]
    elif part_at is None:
        raise SetupError(f"{path}: fixations without parts need their rectangles (--parts)")
    else:
        parts = [
            part_at(*place) for place in zip(table.numbers("x"), table.numbers("y"), strict=True)
        ]
    rows = zip(parts, (times * start_s).tolist(), (durations * unit_s).tolist(), strict=True)
    return [PartFixation(*row) for row in rows], note


class _Column(NamedTuple):
    """Index of a column, its name as written, and its unit, "" without one."""

    at: int
    name: str
    unit: str


class _Table:
    """A file of cells under column names."""

    def __init__(self, path: Path, mapping: Mapping[str, str]) -> None:
        self._path, self._mapping = path, mapping
        try:
            data = read_limited(path, _LARGEST)
            wide = data[:2] in (b"\xff\xfe", b"\xfe\xff")
            lines = data.decode("utf-16" if wide else "utf-8-sig").splitlines()
        except OSError as error:
            raise SetupError(f"{path}: {error.strerror or error}; check the name") from None
        except UnicodeDecodeError:
            raise SetupError(f"{path}: not UTF-8 text; export the recording as CSV") from None
        first = next((line for line in lines if line.strip()), "")
        reader = csv.reader(lines, delimiter=max(",;\t", key=first.count), skipinitialspace=True)
        rows = [(reader.line_num, [cell.strip() for cell in row]) for row in reader]
        (self._header_line, self._names), *body = [one for one in rows if any(one[1])] or [(1, [])]
        for line, row in body:
            if len(row) != len(self._names):
                raise SetupError(
                    f"{path}:{line}: {len(row)} cells under {len(self._names)} column names"
                )
        self._columns = {
            _split(name)[0]: _Column(at, name, _split(name)[1])
            for at, name in enumerate(self._names)
        }
        if _SENSOR in self._columns:
            at = self._columns[_SENSOR].at
            body = [one for one in body if one[1][at].lower() == _EYES]
        if not body:
            raise SetupError(f"{path}: is empty, or has no line after the column names")
        self._rows = body

    def find(self, wanted: str) -> _Column | None:
        """Return a column, by the name given for it or by one that is known."""
        given = self._mapping.get(wanted)
        if given is None:
            known = (self._columns[name] for name in NAMES[wanted] if name in self._columns)
            return next(known, None)
        name, unit = _split(given)
        if name not in self._columns:
            raise self._missing(f"{given} for {wanted}")
        column = self._columns[name]
        return column._replace(unit=unit or column.unit)

    def numbers(self, wanted: str, required: bool = False) -> Floats:
        """Return a column as numbers, NaN for missing ones unless they are required."""
        column = self._require(wanted)
        out = np.empty(len(self._rows))
        for at, (_, row) in enumerate(self._rows):
            try:
                out[at] = read_number(row[column.at])
            except ValueError as error:
                raise self.fault(wanted, at, str(error)) from None
        for at in np.flatnonzero(np.isnan(out))[: int(required)]:
            raise self.fault(wanted, at, "the number is missing")
        return out

    def unit_s(self, wanted: str, spans: Floats, longest_s: float) -> tuple[float, str]:
        """Return the unit of a column in seconds, and a note on it.

        Args:
            wanted: The column.
            spans: Times whose median decides if the column has no unit.
            longest_s: Longest plausible median.
        """
        column = self._require(wanted)
        if column.unit:
            if column.unit not in _UNITS_S:
                raise self.fault(
                    wanted, 0, f"{column.unit} is no unit of time; known: {', '.join(_UNITS_S)}"
                )
            return _UNITS_S[
                column.unit
            ], f"column {column.name} is in {column.unit} (from its name)"
        middle = float(np.median(spans)) if len(spans) else 0.0
        fits = (unit for unit, s in _UNITS_S.items() if middle * s <= longest_s)
        unit = next(fits, "ns")
        return _UNITS_S[unit], f"column {column.name} is in {unit} (from a median of {middle:g})"

    def part(self, row: int) -> str | None:
        """Return the part in a row, by its code or name; None for a fixation outside."""
        cell = self._rows[row][1][self._require("part").at]
        for part in PARTS:
            if cell.lower() in (part.lower(), PART_NAMES[part]):
                return part
        if cell.lower() in _OUTSIDE:
            return None
        known = ", ".join(f"{part} ({PART_NAMES[part]})" for part in PARTS)
        raise self.fault("part", row, f"no part {cell[:40]!r}; known: {known}, outside")

    def fault(self, wanted: str, row: int, why: str) -> SetupError:
        name = self._require(wanted).name
        return SetupError(f"{self._path}:{self._rows[row][0]}: column {name}: {why}")

    def _require(self, wanted: str) -> _Column:
        column = self.find(wanted)
        if column is None:
            raise self._missing(wanted)
        return column

    def _missing(self, wanted: str) -> SetupError:
        found = ", ".join(name or "(no name)" for name in self._names[:8])
        return SetupError(
            f"{self._path}:{self._header_line}: no column {wanted}; found: {found}; wanted: time, x,"
            " y of samples, or start, duration, part of fixations; or name it with --map"
        )


def _split(name: str) -> tuple[str, str]:
    """Return a column's name in lower case without its unit, and the unit."""
    found = _NAME.fullmatch(name.strip().lower().replace("\u00b5", "u").replace("\u03bc", "u"))
    if found is None:
        return "", ""
    return found["name"].replace("_", " "), found["unit"] or found["ending"] or ""
