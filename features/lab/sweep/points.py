"""Points of a sweep: every combination of the values of ``--set KEY=VALUES``."""

import re
from collections.abc import Callable, Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np

from gazerig.config.faults import ConfigError, ConfigFault
from gazerig.config.parameters import apply_changes
from gazerig.config.rig import Rig
from gazerig.drivers.errors import SetupError
from gazerig.robot.model.commands import Value

Point = Mapping[str, Value]
"""Values by keys of the rig's YAML."""

_FORMS = "LOW:HIGH:STEPS or A,B,C"
_STEPS = re.compile(r"([^:,]+):([^:,]+):(\d+)")
_OPTIONS = {"profile": "--profile", "character": "--character", "name": "RIG"}
"""Keys that act only while the rig's files are read, and the option to use instead."""


def grid(settings: Sequence[str], read: Callable[[str, str], Any]) -> list[Point]:
    """Return every combination of the values, the last key fastest.

    Args:
        settings: KEY=LOW:HIGH:STEPS or KEY=A,B,C.
        read: Reads the values of a key as written in YAML.

    Raises:
        SetupError: A setting has neither form, or a key is repeated.
    """
    axes: dict[str, Sequence[Value]] = {}
    for setting in settings:
        key, _, text = map(str.strip, setting.partition("="))
        if key in axes:
            raise SetupError(f"--set {key}: is given twice; give all values in one option")
        if key in _OPTIONS:
            raise SetupError(f"--set {key}: it acts while files are read; give {_OPTIONS[key]}")
        if not text:
            raise SetupError(f"--set {setting}: not KEY=VALUES; values are {_FORMS}")
        axes[key] = read(key, f"[{_listed(setting, text)}]")
    return [dict(zip(axes, row, strict=True)) for row in product(*axes.values())]


def check_points(rig: Rig, points: Sequence[Point]) -> None:
    """Refuse points of which the rig's rules allow none; another bad one is a failed run.

    Raises:
        ConfigError: With the faults of all.
    """
    faults = list[ConfigFault]()
    for point in points:
        try:
            apply_changes(rig, point)
        except ConfigError as error:
            faults += error.faults
        else:
            return
    raise ConfigError(dict.fromkeys(faults))


def _listed(setting: str, text: str) -> str:
    """Return LOW:HIGH:STEPS as a list of values, and a list as it is."""
    steps = _STEPS.fullmatch(text)
    if steps is None:
        return text
    try:
        low, high, count = float(steps[1]), float(steps[2]), int(steps[3])
    except ValueError:
        raise SetupError(f"--set {setting}: LOW:HIGH:STEPS needs numbers") from None
    if not (low < high and count > 1):
        raise SetupError(f"--set {setting}: LOW must be below HIGH, and STEPS at least 2")
    return ",".join(f"{value:.9g}" for value in np.linspace(low, high, count))
