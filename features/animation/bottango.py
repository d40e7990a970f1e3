"""JSON exports of Bottango: curves with Bezier handles, as commands of its driver protocol.

A list of controllers, each with its animations: lines ``sC,effector,start ms,duration ms,start
movement,its handle x ms,y,end movement,its handle x ms,y``. Movements are whole numbers from 0 to
8192 of the effector's range; handles are relative to their end of the curve. Sources: the commands
of docs.bottango.com; github.com/EvanBottango/Bottango, BottangoNetworkedDriver/src/BezierCurve.py.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from msgspec import Struct, field

from gazerig.config.rig import Rig
from gazerig.drivers.errors import SetupError
from gazerig.features.animation.animation import (
    SAMPLE_S,
    ImportedAnimation,
    JointMap,
    Series,
    check_count,
    check_keys,
    decode,
    listed,
)
from gazerig.gaze.types import Floats

_FULL = 8192.0
_EVENTS = ("sCO", "sCT", "sCC")
"""Curves of on/off, trigger and colour events."""
_U = np.linspace(0.0, 1.0, 129)
_WEIGHTS = np.stack(
    ((1.0 - _U) ** 3, 3.0 * (1.0 - _U) ** 2 * _U, 3.0 * (1.0 - _U) * _U**2, _U**3), 1
)
"""Bernstein polynomials at points of a curve."""


class _Clip(Struct):
    name: str = field(name="Animation Name")
    commands: str = field(name="Animation Commands", default="")


class _Controller(Struct):
    clips: list[_Clip] = field(name="Animations")


def read(path: Path, data: bytes, rig: Rig, names: JointMap, clip: str) -> ImportedAnimation:
    """Return one animation of an export.

    Args:
        path: path of the file, for messages.
        data: its content.
        rig: rig; the full movement of an effector is the range of its joint.
        names: joints by the identifiers of effectors: the name of a custom motor, the pin of a
            servo.
        clip: name of the animation; "" for the only one.

    Raises:
        SetupError: the file is invalid, or an effector is no joint.
    """
    controllers = decode(path, data, list[_Controller], "a JSON export of Bottango")
    clips = [one for controller in controllers for one in controller.clips]
    there = list(dict.fromkeys(one.name for one in clips))
    if not there:
        raise SetupError(f"{path}: no animations: select them in Bottango's export")
    if clip not in there and (clip or len(there) > 1):
        wrong = f"no animation {clip!r}" if clip else "several animations"
        raise SetupError(f"{path}: {wrong}: add --clip NAME with one of: {listed(there)}")
    curves: dict[str, list[list[float]]] = {}
    events = 0
    for one in (one for one in clips if one.name == (clip or there[0])):
        check_count(f"{path}: {one.name}", one.commands.count("\n"))
        for line, words in _commands(one.commands):
            events += words[0] in _EVENTS
            if words[0] == "sC":
                numbers = _numbers(f"{path}: {one.name}, command {line}", words)
                curves.setdefault(words[1], []).append(numbers)
    series: dict[str, Series] = {}
    for effector, them in curves.items():
        joint, sign = names.require(f"{path}: effector ", effector)
        times, movement = _sample(f"{path}: {effector}", them)
        low, high = rig.joints[joint].min_deg, rig.joints[joint].max_deg
        share = movement if sign > 0 else 1.0 - movement
        series[joint] = times, low + share * (high - low)
    notes = (f"{events} on/off, trigger and colour events are left out",) if events else ()
    return ImportedAnimation(series, notes)


def _commands(text: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the number and the words of each command, without its hash."""
    for number, line in enumerate(text.splitlines(), start=1):
        words = [word.strip() for word in line.split(",")]
        yield number, words[:-1] if len(words) > 1 and words[-1].startswith("h") else words


def _numbers(where: str, words: Sequence[str]) -> list[float]:
    """Return the eight numbers of a curve."""
    try:
        numbers = [float(word) for word in words[2:]]
    except ValueError:
        numbers = []
    if len(numbers) != 8 or not np.isfinite(numbers).all() or numbers[1] < 0.0:
        raise SetupError(
            f"{where}: {','.join(words)!r:.80} is not sC,effector and eight numbers: export it again"
        )
    return numbers


def _sample(where: str, curves: Sequence[Sequence[float]]) -> Series:
    """Return samples of an effector's curves, the share of its range; between curves it holds."""
    table = np.array(sorted(curves, key=lambda one: one[0]))
    start_s = table[:, 0] / 1e3
    check_keys(where, start_s, table)
    check_keys(where, np.maximum.accumulate(start_s + table[:, 1] / 1e3)[-1:], table[-1:])
    until_s = np.append(start_s[1:] - start_s[:-1] - 1e-3, np.inf)
    times: list[Floats] = []
    values: list[Floats] = []
    for begin_s, most_s, (_, span, y0, x1, y1, y3, x2, y2) in zip(
        start_s, until_s, table, strict=True
    ):
        end_s = max(0.0, min(span / 1e3, most_s))
        at_s = np.append(np.arange(0.0, end_s - 1e-3, SAMPLE_S), end_s)
        # Handles that cross in time would turn back; the latest point counts, as in the driver.
        x_s = np.maximum.accumulate(_WEIGHTS @ (0.0, x1, span + x2, span)) / 1e3
        times.append(begin_s + at_s)
        values.append(np.interp(at_s, x_s, _WEIGHTS @ (y0, y0 + y1, y3 + y2, y3)) / _FULL)
    return np.concatenate(times), np.concatenate(values)
