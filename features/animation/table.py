"""CSV tables of animation programs: one row per frame or key.

Wide: a column of times and one of angles for each joint. Long: columns time, joint, angle, one row
for each key. Times are in seconds (time, time_s) or numbers of frames (frame), angles in degrees.
Separators are commas, semicolons or tabs; with the latter two a decimal may be a comma, as
spreadsheets write it in half of the world.
"""

import csv
from array import array
from collections import Counter, defaultdict
from math import isfinite, nan
from pathlib import Path

import numpy as np

from gazerig.drivers.errors import SetupError
from gazerig.features.animation.animation import JointMap, Series, check_count

_TIMES = ("time", "time_s", "t", "seconds", "frame")
_JOINTS = ("joint", "bone", "effector", "servo", "motor", "name")
_ANGLES = ("angle", "angle_deg", "value", "degrees", "deg")


def read_table(path: Path, data: bytes, fps: float | None, names: JointMap) -> dict[str, Series]:
    """Return the keys of every joint of a CSV file; an empty cell of a wide table is no key.

    Args:
        path: path of the file, for messages.
        data: its content.
        fps: frames per second, for a column of frame numbers.
        names: joints by the names of the columns.

    Raises:
        SetupError: the file is no table, has a bad row, with its line, or names no joint.
    """
    try:
        lines = data.decode("utf-8-sig").splitlines() or [""]
    except UnicodeDecodeError:
        raise SetupError(f"{path} is not UTF-8 text: export it as CSV in UTF-8") from None
    check_count(str(path), len(lines), "lines")
    begin = next((i for i, line in enumerate(lines) if not _is_preface(line)), 0)
    separator = max(",;\t", key=lines[begin].count)
    rows = csv.reader(lines[begin:], delimiter=separator)
    head = [name.strip().lower() for name in next(rows, [])]
    unit_s = _check_head(f"{path}:{begin + 1}", head, fps)
    time = next(i for i, name in enumerate(head) if name in _TIMES)
    joint = next((i for i, name in enumerate(head) if name in _JOINTS), None)
    angle = next((i for i, name in enumerate(head) if name in _ANGLES), None)
    keys: dict[str, tuple[array[float], array[float]]] = defaultdict(
        lambda: (array("d"), array("d"))
    )
    for line, row in enumerate(rows, begin + 2):
        where = f"{path}:{line}"
        if not "".join(row).strip():
            continue
        if len(row) != len(head):
            raise SetupError(
                f"{where}: has {len(row)} columns, but the first row has {len(head)}: export it again"
            )
        cells = [(name, row[i]) for i, name in enumerate(head) if i != time and row[i].strip()]
        if joint is not None and angle is not None:
            cells = [(row[joint].strip(), row[angle])]
        time_s = unit_s * _number(f"{where}: {head[time]}", row[time], separator)
        for name, cell in cells:
            times, angles = keys[name]
            if time_s < 0.0 or (times and time_s <= times[-1]):
                raise SetupError(
                    f"{where}: {name}: {time_s:g} s is not after {times[-1] if times else 0:g} s: "
                    "sort the rows by time"
                )
            times.append(time_s)
            angles.append(_number(f"{where}: {name}", cell, separator))
    if not keys:
        raise SetupError(f"{path}: no rows below the column names: export it again")
    series = {}
    for name, (times, angles) in keys.items():
        moved, sign = names.require(f"{path}: ", name)
        series[moved] = np.array(times), sign * np.array(angles)
    return series


def _is_preface(line: str) -> bool:
    """Return whether a line is empty, a comment, or Excel's own ``sep=;``."""
    return not line.strip(",; \t") or line.startswith(("#", "sep="))


def _check_head(where: str, head: list[str], fps: float | None) -> float:
    """Return the seconds of a unit of time.

    Raises:
        SetupError: there is no column of times, two columns have one name, or frames have no rate.
    """
    time = next((name for name in head if name in _TIMES), None)
    if time is None:
        raise SetupError(
            f"{where}: no column of times: the first row must name the columns, one of them "
            f"{', '.join(_TIMES)}"
        )
    twice = next((name for name, count in Counter(head).items() if name and count > 1), None)
    if twice is not None:
        raise SetupError(f"{where}: two columns are named {twice!r}: remove one")
    if time != "frame":
        return 1.0
    if fps is None:
        raise SetupError(f"{where}: times are frame numbers: give --fps, e.g. 24 or 30")
    return 1.0 / fps


def _number(where: str, cell: str, separator: str) -> float:
    try:
        value = float(cell if separator == "," else cell.replace(",", "."))
    except ValueError:
        value = nan
    if not isfinite(value):
        raise SetupError(f"{where}: {cell.strip()!r:.40} is not a number: correct it")
    return value
