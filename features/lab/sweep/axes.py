"""Axes of a sweep: the parameters to vary, their values, and the points of these.

A point is a mapping from keys of the rig's YAML to values, as ``changed`` takes it.
"""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod

import numpy as np

from gazerig.config.load import ConfigError, ConfigFault
from gazerig.config.parameters import apply_changes, parameters, value_of
from gazerig.config.rig import Rig
from gazerig.drivers.errors import SetupError
from gazerig.gaze.types import Floats
from gazerig.robot.model.commands import Value
from gazerig.robot.model.parameter import Parameter

Point = Mapping[str, Value]

MAX_POINTS = 100_000
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_SPACED = re.compile(rf"({_NUMBER}):({_NUMBER}):(\d+)")
_RANGE = re.compile(rf"({_NUMBER})(?::|\.\.)({_NUMBER})")
_FORMS = "LOW:HIGH:STEPS, LOW:HIGH or A,B,C"
_OPTIONS = {"profile": "--profile", "character": "--character", "name": "RIG"}
"""Keys that act only while the rig's files are read, and the option to use instead."""


@dataclass(frozen=True)
class Axis:
    """One parameter and its values.

    Attributes:
        key: dotted path in the rig's YAML.
        values: its levels; empty for a range.
        low, high: ends of a range, both included.
        whole: the parameter takes whole numbers.
        unit: of the parameter, "" without one.
    """

    key: str
    values: tuple[Value, ...] = ()
    low: float = 0.0
    high: float = 0.0
    whole: bool = False
    unit: str = ""

    @property
    def is_range(self) -> bool:
        """Return whether the axis is a continuous range."""
        return not self.values

    def contains(self, value: Value) -> bool:
        """Return whether a value is on the axis."""
        if self.values:
            return _freeze(value) in self.values
        return isinstance(value, int | float) and self.low <= value <= self.high

    def index(self, value: Value) -> int:
        """Return the index of a level."""
        return self.values.index(_freeze(value))

    def value_at(self, share: float) -> Value:
        """Return the value at a share 0 <= share <= 1 of the axis."""
        if self.values:
            return self.values[min(int(share * len(self.values)), len(self.values) - 1)]
        if self.whole:
            low, high = int(self.low), int(self.high)
            return min(low + int(share * (high - low + 1)), high)
        value = float(f"{self.low + share * (self.high - self.low):.6g}")
        return min(max(value, self.low), self.high)

    def share(self, value: Value) -> float:
        """Return the position of a value on the axis, 0..1; for a level, the middle of its part."""
        if self.values:
            return (self.index(value) + 0.5) / len(self.values)
        assert isinstance(value, int | float)
        width = self.high - self.low
        if self.whole:
            return (value - self.low + 0.5) / (width + 1.0)
        return (value - self.low) / width

    @property
    def label(self) -> str:
        """Return key and unit as text."""
        return f"{self.key}, {self.unit}" if self.unit else self.key


def _freeze(value: Value) -> Value:
    """Return lists as tuples: points become JSON on the disk."""
    return tuple(map(_freeze, value)) if isinstance(value, list | tuple) else value


def make_axes(rig: Rig, settings: Sequence[str], read: Callable[[str, str], Value]) -> list[Axis]:
    """Return the axes of ``--set KEY=VALUES`` options.

    Args:
        rig: rig with the parameters.
        settings: KEY=LOW:HIGH:STEPS, KEY=LOW:HIGH (or LOW..HIGH), KEY=A,B,C.
        read: reads a key's value as written in YAML.

    Raises:
        SetupError: a setting has none of these forms, or a key is repeated.
        ConfigError: with every unknown key and every end of a range out of its bounds.
    """
    known = {param.key: param for param in parameters(rig, rig)}
    axes, faults = list[Axis](), list[ConfigFault]()
    for setting in settings:
        key, equals, text = setting.partition("=")
        key = key.strip()
        if not equals or not text.strip():
            raise SetupError(f"--set {setting}: not KEY=VALUES; values are {_FORMS}")
        if any(axis.key == key for axis in axes):
            raise SetupError(f"--set {key}: is given twice; give all values in one option")
        if key in _OPTIONS:
            raise SetupError(f"--set {key}: it acts while files are read; give {_OPTIONS[key]}")
        try:
            if key not in known:
                held = value_of(rig, key)
                inside = [one for one in known if one.startswith(f"{key}.")]
                near = f"for example {inside[0]}" if inside else f"it is {held!r}"
                raise SetupError(f"--set {key}: is no single value; name one, {near}")
            axes.append(_axis(rig, known[key], text.strip(), read))
        except ConfigError as error:
            faults += error.faults
    if faults:
        raise ConfigError(faults)
    return axes


def _axis(rig: Rig, param: Parameter, text: str, read: Callable[[str, str], Value]) -> Axis:
    """Return the axis of one parameter.

    Raises:
        ConfigError: an end of a range is out of the parameter's bounds.
        SetupError: the text has none of the forms.
    """
    if spaced := _SPACED.fullmatch(text):
        low, high = _ends(param, text, spaced)
        steps = int(spaced[3])
        if not 2 <= steps <= MAX_POINTS:
            raise SetupError(f"--set {param.key}={text}: {steps} steps; wanted 2 to {MAX_POINTS}")
        values = tuple(float(f"{x:.9g}") for x in np.linspace(low, high, steps))
        if param.kind != "whole":
            return Axis(param.key, values, unit=param.unit)
        uneven = next((x for x in values if not x.is_integer()), None)
        if uneven is not None:
            raise SetupError(f"--set {param.key}={text}: {uneven:g} is no whole number")
        return Axis(param.key, tuple(map(int, values)), unit=param.unit)
    if ends := _RANGE.fullmatch(text):
        low, high = _ends(param, text, ends)
        faults = [f for end in (low, high) for f in _out_of_bounds(rig, param, end)]
        if faults:
            raise ConfigError(faults)
        return Axis(param.key, (), low, high, param.kind == "whole", param.unit)
    listed = read(param.key, f"[{text}]")
    if not isinstance(listed, tuple | list) or not listed:
        raise SetupError(f"--set {param.key}={text}: no values; write {_FORMS}")
    if len(set(map(repr, listed))) < len(listed):
        raise SetupError(f"--set {param.key}={text}: a value is given twice")
    return Axis(param.key, tuple(map(_freeze, listed)), unit=param.unit)


def _ends(param: Parameter, text: str, found: re.Match[str]) -> tuple[float, float]:
    """Return both ends of a range."""
    if param.kind not in ("number", "whole"):
        values = ",".join(map(str, param.choices)) or "A,B"
        raise SetupError(
            f"--set {param.key}={text}: a range is for numbers; write {param.key}={values}"
        )
    low, high = float(found[1]), float(found[2])
    if not low < high:
        raise SetupError(f"--set {param.key}={text}: {low:g} is not below {high:g}")
    return low, high


def _out_of_bounds(rig: Rig, param: Parameter, end: float) -> Sequence[ConfigFault]:
    """Return the faults of one end of a range alone, from the check of the YAML."""
    inside = (param.low is None or end >= param.low) and (param.high is None or end <= param.high)
    whole = param.kind == "whole" and end.is_integer()
    if inside and (whole or param.kind == "number"):
        return ()
    try:
        apply_changes(rig, {param.key: int(end) if whole else end})
    except ConfigError as error:
        return [fault for fault in error.faults if fault.key == param.key]
    return ()


def grid(axes: Sequence[Axis]) -> list[Point]:
    """Return every combination of the axes' levels, the last axis fastest.

    Raises:
        SetupError: an axis is a range, or there are more than ``MAX_POINTS``.
    """
    for axis in axes:
        if axis.is_range:
            text = f"{axis.key}={axis.low:g}:{axis.high:g}"
            raise SetupError(
                f"--set {text}: a range needs --samples N or --fit; for a grid write {text}:STEPS"
            )
    count = prod(len(axis.values) for axis in axes)
    if count > MAX_POINTS:
        raise SetupError(f"{count} combinations; at most {MAX_POINTS}: take fewer steps")
    keys = [axis.key for axis in axes]
    return [dict(zip(keys, row, strict=True)) for row in product(*(a.values for a in axes))]


def vary_one_by_one(axes: Sequence[Axis]) -> list[Point]:
    """Return the rig's own values, and each level with the rig's own values of all other axes."""
    return [{}, *({axis.key: value} for axis in axes for value in axis.values)]


def latin_hypercube(axes: Sequence[Axis], samples: int, seed: int) -> list[Point]:
    """Return samples, each in its own part of every axis (McKay 1979).

    The result is the same on every machine and with every version of a library, so that a sweep can
    be continued.

    Args:
        axes: ranges and levels.
        samples: number of points; each axis is cut into as many parts of equal width.
        seed: of the sample.
    """
    shares = latin_shares(len(axes), samples, np.random.default_rng(seed))
    return [point_at(axes, row) for row in shares]


def latin_shares(dimensions: int, samples: int, rng: np.random.Generator) -> Floats:
    """Return a Latin hypercube in the unit cube, (samples, dimensions)."""
    parts = rng.permuted(np.tile(np.arange(samples), (dimensions, 1)), axis=1)
    return np.asarray(((parts + rng.random(parts.shape)) / samples).T)


def point_at(axes: Sequence[Axis], shares: Iterable[float]) -> Point:
    """Return the point at shares 0..1 of the axes."""
    return {axis.key: axis.value_at(float(share)) for axis, share in zip(axes, shares, strict=True)}


def check_points(rig: Rig, axes: Sequence[Axis], points: Sequence[Point]) -> None:
    """Refuse levels that the rig's rules allow at no point.

    A point that breaks a rule between two parameters is kept: its runs report the fault.

    Raises:
        ConfigError: with one fault for each such level.
    """
    allowed, refused = set[tuple[str, str]](), dict[tuple[str, str], ConfigFault]()
    for point in points:
        levels = [(key, repr(value)) for key, value in point.items()]
        try:
            apply_changes(rig, point)
        except ConfigError as error:
            named = {fault.key: fault for fault in reversed(error.faults)}
            refused |= {level: named[level[0]] for level in levels if level[0] in named}
        else:
            allowed.update(levels)
    faults = [fault for level, fault in refused.items() if level not in allowed]
    if faults:
        raise ConfigError(dict.fromkeys(faults))
    if not allowed:
        apply_changes(rig, points[0])
