"""How a frozen set of choices is made otherwise, case by case, as typed by a person."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeVar

H = TypeVar("H")

TIMES = {"slot_timeout_ms": "slot_timeout_s", "packet_gap_ms": "packet_gap_s"}
"""Cases that are times, and the fields that hold them."""


def cases_of(choices: Mapping[str, tuple[str, ...]]) -> dict[str, str]:
    """Give the name of every case, as it is typed, and its possible values.

    choices: field -> its possible words
    """
    named = {name.replace("_", "-"): "|".join(values) for name, values in choices.items()}
    return named | {name.replace("_", "-"): "MS" for name in TIMES} | {"baud": "heed|any"}


def decided(quirks: H, choices: Mapping[str, tuple[str, ...]], case: str, value: str) -> H:
    """Give the quirks, a frozen dataclass, with one case decided otherwise.

    Raises:
        ValueError: there is no such case or value.
    """
    name = case.replace("-", "_")
    if name in TIMES:
        time_s = _milliseconds(case, value) / 1000.0
        return replace(quirks, **{TIMES[name]: time_s})  # type: ignore[type-var]
    if name not in choices:
        raise ValueError(f"set {case!r}: unknown; there is {', '.join(cases_of(choices))}")
    if value not in choices[name]:
        raise ValueError(f"{case} {value!r}: it can be {', '.join(choices[name])}")
    return replace(quirks, **{name: value})  # type: ignore[type-var]


def _milliseconds(case: str, value: str) -> float:
    try:
        number = float(value)
    except ValueError:
        number = -1.0
    if not 0.0 <= number < 1e6:
        raise ValueError(f"{case} {value!r}: not a number of milliseconds of 0 or more")
    return number
