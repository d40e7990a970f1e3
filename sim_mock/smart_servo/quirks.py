"""Behaviour of emulated servos that is undocumented, noise of readings, and long pauses.

Logic analyser traces published by users of ROBOTIS' SDK show that later servos of a group
wait for a missing one. Times marked [A] are assumed.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

PAUSE_MS = 10_000
"""Longest time without a packet that is simulated millisecond by millisecond."""
_BEFORE_MS, _AFTER_MS = 3_000, 1_000
"""Simulated start and end of a pause: motions end in the first, readings vary in the second."""


def long_pause(now_ms: int, until_ms: int, unit_ms: int) -> tuple[int, int]:
    """Return start and length of the skipped part of a pause; (until, 0) for short pauses.

    unit_ms: the skipped time is a multiple of it.
    """
    if until_ms - now_ms <= PAUSE_MS:
        return until_ms, 0
    between_ms = until_ms - now_ms - _BEFORE_MS - _AFTER_MS
    return now_ms + _BEFORE_MS, between_ms // unit_ms * unit_ms


LENGTH = 4096
"""Period in milliseconds; a power of 2."""
SEED_APART_MS = 1009
"""Offset in time between servos of consecutive seeds."""


@lru_cache(maxsize=8)
def noise_table(current: int, velocity: int) -> tuple[tuple[int, int], ...]:
    """Return the noise of current and velocity for each of ``LENGTH`` milliseconds.

    It depends on the time only, so that reading does not change it; velocity is mostly 0.
    """
    return tuple(_noise(now_ms, current, velocity) for now_ms in range(LENGTH))


def _noise(now_ms: int, current: int, velocity: int) -> tuple[int, int]:
    mixed = (now_ms * 0x9E3779B1) & 0xFFFFFFFF
    mixed = ((mixed ^ mixed >> 15) * 0x85EBCA6B) & 0xFFFFFFFF
    mixed ^= mixed >> 13
    amps = mixed % (2 * current + 1) - current
    if mixed >> 24 & 3:
        return amps, 0
    return amps, (mixed >> 8) % (2 * velocity + 1) - velocity


AfterMissing = Literal["silence", "skip", "timeout"]
WrongBaud = Literal["silence", "garbage"]

TIMES = {"slot_timeout_ms": "slot_timeout_s", "packet_gap_ms": "packet_gap_s"}
"""Cases that are times, and their fields."""


@dataclass(frozen=True, kw_only=True)
class ChainQuirks:
    """Choices of behaviour of every chain; a field that is a Literal is a case.

    after_missing: reaction of the servos after a silent one in a plain group read: never answer,
        answer immediately, or answer after ``slot_timeout_s`` [A]
    wrong_baud: a client at another baud rate receives nothing, or garbage
    packet_gap_s: time after which an unfinished packet is dropped [A]
    """

    after_missing: AfterMissing = "silence"
    wrong_baud: WrongBaud = "silence"
    slot_timeout_s: float = 0.001
    packet_gap_s: float = 0.0015


Q = TypeVar("Q", bound=ChainQuirks)


def _choices(kind: type[ChainQuirks]) -> dict[str, tuple[str, ...]]:
    """Return the fields that are a Literal, with their values."""
    hints = get_type_hints(kind).items()
    return {name: get_args(hint) for name, hint in hints if get_origin(hint) is Literal}


def cases_of(kind: type[ChainQuirks]) -> dict[str, str]:
    """Return the name of every case, as it is typed, and its possible values."""
    choices = _choices(kind).items()
    named = {name.replace("_", "-"): "|".join(values) for name, values in choices}
    return named | {name.replace("_", "-"): "MS" for name in TIMES} | {"baud": "heed|any"}


def change_quirk(quirks: Q, case: str, value: str) -> Q:
    """Return the quirks with one case changed.

    Raises:
        ValueError: the case or value is unknown.
    """
    name, choices = case.replace("-", "_"), _choices(type(quirks))
    change: dict[str, Any] = {name: value}
    if name in TIMES:
        try:
            number = float(value)
        except ValueError:
            number = -1.0
        if not 0.0 <= number < 1e6:
            raise ValueError(f"{case} {value!r}: not a number of milliseconds of 0 or more")
        change = {TIMES[name]: number / 1000.0}
    elif name not in choices:
        raise ValueError(f"set {case!r}: unknown; expected {', '.join(cases_of(type(quirks)))}")
    elif value not in choices[name]:
        raise ValueError(f"{case} {value!r}: expected {', '.join(choices[name])}")
    return replace(quirks, **change)
