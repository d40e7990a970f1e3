"""CSV tables of animation programs: one row per frame or key.

Wide: a column of times and one of angles for each joint. Long: columns time, joint, angle, one row
for each key. Times are in seconds (time, time_s) or numbers of frames (frame), angles in degrees.
Separators are commas, semicolons or tabs; with the latter two a decimal may be a comma, as
spreadsheets write it in half of the world.
"""

import csv
import re
from array import array
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from io import StringIO
from math import isfinite
from pathlib import Path

import numpy as np

from gazerig.drivers.errors import SetupError
from gazerig.features.animation.animation import JointMap, Series, check_count, check_curves

_TIMES = ("time", "time_s", "t", "seconds", "frame")
_JOINTS = ("joint", "bone", "effector", "servo", "motor", "name")
_ANGLES = ("angle", "angle_deg", "value", "degrees", "deg")
_MOST_FAULTS = 10
_LAST_FAULT = 1000
"""Faults after which a file is not read further."""
_PREFACE = re.compile(r"(?:sep=.|#[^\r\n]*|[,; \t]*)(?:\r\n?|\n)", re.IGNORECASE)
"""A line before the names of the columns: an empty one, a comment, or Excel's own ``sep=;``."""
_MOST_PREFACE = 1000


def read_table(path: Path, data: bytes, fps: float | None, names: JointMap) -> dict[str, Series]:
    """Return the keys of every joint of a CSV file.

    Args:
        path: path of the file, for messages.
        data: its content.
        fps: frames per second, for a column of frame numbers.
        names: joints by the names of the columns.

    Raises:
        SetupError: the file is no table, has bad rows, each with its line, or names no joint.
    """
    check_count(str(path), max(data.count(b"\n"), data.count(b"\r")), "lines")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise SetupError(f"{path} is not UTF-8 text: export it as CSV in UTF-8") from None
    line, begin = 1, 0
    while line <= _MOST_PREFACE and (preface := _PREFACE.match(text, begin)):
        line, begin = line + 1, preface.end()
    text = text[begin:]
    first = text.partition("\n")[0]
    separator = max(",;\t", key=first.count)
    check_curves(f"{path}:{line}", first.count(separator), "columns")
    rows = _split_rows(path, text, separator, line)
    head = [name.strip().lower() for name in next(rows, [])]
    time = next((i for i, name in enumerate(head) if name in _TIMES), None)
    if time is None:
        raise SetupError(
            f"{path}:{line}: no column of times: the first row must name the columns, one of them "
            f"{', '.join(_TIMES)}"
        )
    if head[time] == "frame" and fps is None:
        raise SetupError(f"{path}:{line}: times are frame numbers: give --fps, e.g. 24 or 30")
    count = Counter(head)
    twice = next((name for name in head if name and count[name] > 1), None)
    if twice is not None:
        raise SetupError(f"{path}:{line}: two columns are named {twice!r}: remove one")
    unit_s = 1.0 / fps if head[time] == "frame" and fps else 1.0
    table = _Table(path, head, time, unit_s, separator != ",")
    found = table.read_keys(rows, line + 1)
    if table.faults:
        more = len(table.faults) - _MOST_FAULTS
        least = "at least " if len(table.faults) >= _LAST_FAULT else ""
        shown = table.faults[:_MOST_FAULTS] + ([f"and {least}{more} more"] if more > 0 else [])
        raise SetupError("\n".join(shown))
    if not found:
        raise SetupError(f"{path}: no rows below the column names")
    series = {}
    for name, keys in found.items():
        joint = names.find(name)
        if joint is None:
            raise SetupError(f"{path}: no joint {name!r}: {names.hint()}")
        series[joint[0]] = keys[0], joint[1] * keys[1]
    return series


def _split_rows(path: Path, text: str, separator: str, line: int) -> Iterator[list[str]]:
    """Yield the cells of every row; ``line``: number of the first."""
    reader = csv.reader(StringIO(text, newline=None), delimiter=separator)
    try:
        yield from reader
    except csv.Error as error:
        raise SetupError(f"{path}:{line + reader.line_num - 1}: {error}: is it a table?") from None


class _Table:
    """Rows of one file; faults: the invalid lines with their errors."""

    def __init__(
        self, path: Path, head: Sequence[str], time: int, unit_s: float, decimal_comma: bool
    ) -> None:
        self.faults: list[str] = []
        self._path, self._head, self._time, self._unit_s = path, head, time, unit_s
        self._decimal_comma = decimal_comma
        self._joint = next((i for i, name in enumerate(head) if name in _JOINTS), None)
        self._angle = next((i for i, name in enumerate(head) if name in _ANGLES), None)

    def read_keys(self, rows: Iterable[Sequence[str]], first_line: int) -> dict[str, Series]:
        """Return the keys by joint, in the order of their times."""
        found: dict[str, tuple[array[float], array[float]]] = {}
        for line, row in enumerate(rows, start=first_line):
            if not any(cell.strip() for cell in row):
                continue
            if len(self.faults) >= _LAST_FAULT:
                break
            for joint, time_s, angle in self._row_keys(line, row):
                times, angles = found.setdefault(joint, (array("d"), array("d")))
                if times and time_s <= times[-1]:
                    self._add_error(line, f"{joint}: {time_s:g} s is not after {times[-1]:g} s")
                times.append(time_s)
                angles.append(angle)
        return {name: (np.array(keys[0]), np.array(keys[1])) for name, keys in found.items()}

    def _row_keys(self, line: int, row: Sequence[str]) -> Iterator[tuple[str, float, float]]:
        """Yield the keys of one row; an empty cell of a wide table is not a key."""
        if len(row) != len(self._head):
            self._add_error(
                line, f"has {len(row)} columns, but the first row has {len(self._head)}"
            )
            return
        time = self._read_number(line, self._head[self._time], row[self._time])
        if time is None:
            return
        if time < 0.0:
            self._add_error(line, f"{self._head[self._time]} {time:g} is before 0")
            return
        if self._joint is not None and self._angle is not None:
            pairs = [(row[self._joint].strip(), row[self._angle])]
        else:
            pairs = [
                (n, row[i]) for i, n in enumerate(self._head) if i != self._time and row[i].strip()
            ]
        for joint, cell in pairs:
            angle = self._read_number(line, joint, cell)
            if angle is not None:
                yield joint, time * self._unit_s, angle

    def _read_number(self, line: int, what: str, cell: str) -> float | None:
        try:
            value = float(cell.replace(",", ".") if self._decimal_comma else cell)
        except ValueError:
            value = float("nan")
        if isfinite(value):
            return value
        self._add_error(line, f"{what}: {cell.strip()!r:.40} is not a number")
        return None

    def _add_error(self, line: int, text: str) -> None:
        self.faults.append(f"{self._path}:{line}: {text}")
