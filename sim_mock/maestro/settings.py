"""What an emulated Maestro is set to: what Pololu's own program sets over USB on a real one.

Source: Pololu Maestro User's Guide (0J40), sections 4.b and 5.a. On a real board one
setting per channel says what happens at start and on an error; here all channels have the
same, and the two can differ.
"""

from dataclasses import dataclass, replace
from typing import Literal, get_args

Mode = Literal["usb-dual-port", "usb-chained", "uart-detect", "uart-fixed", "mute"]
OnError = Literal["off", "home", "ignore"]
Startup = Literal["off", "home"]

FIXED_BAUD = 9600
"""Rate of the serial pins where none was chosen."""
LONGEST_TIMEOUT_MS = 655_350.0
LOWEST_US, HIGHEST_US = 64.0, 3280.0
US = 4


@dataclass(frozen=True)
class Settings:
    """The choices.

    mode: where the host is and what the board makes of it. At its USB command port with
        usb-dual-port or usb-chained any rate works; at its serial pins with
        uart-fixed only one at its rate, with uart-detect one that has sent AA; mute is the
        USB command port of a board in either uart mode: what is sent there is ignored.
    crc: a CRC is expected behind every command but those of the Mini SSC protocol
    timeout_s: so long without a valid command is an error; 0: never
    on_error, startup: what all channels do then; home_steps: where home is
    baud: of uart-fixed
    speed, acceleration: limits of every channel from the start on, in the board's units
    """

    mode: Mode = "usb-dual-port"
    crc: bool = False
    timeout_s: float = 0.0
    on_error: OnError = "off"
    startup: Startup = "off"
    home_steps: int = 1500 * US
    baud: int = FIXED_BAUD
    speed: int = 0
    acceleration: int = 0


MOST = {"speed": 3968, "acceleration": 255}
"""Largest limits that a board keeps; 0: none."""

_WORDS: dict[str, tuple[str, ...]] = {
    "mode": get_args(Mode),
    "on-error": get_args(OnError),
    "startup": get_args(Startup),
}
LIMITS = ("min-us", "max-us")
"""Cases that are set in the channels."""


def cases() -> dict[str, str]:
    """Return the name of every case, as it is typed, and its possible values."""
    named = {name: "|".join(values) for name, values in _WORDS.items()}
    return {
        "mode": named["mode"],
        "crc": "on|off",
        "timeout-ms": "MS",
        "on-error": named["on-error"],
        "startup": named["startup"],
        **{name: "US" for name in ("home-us", *LIMITS)},
        **dict.fromkeys(MOST, "UNITS"),
    }


def chosen(settings: Settings, case: str, value: str) -> Settings:
    """Return the settings with one case decided otherwise.

    Raises:
        ValueError: there is no such case or value.
    """
    if case in _WORDS:
        if value not in _WORDS[case]:
            raise ValueError(f"{case} {value!r}: it can be {', '.join(_WORDS[case])}")
        return replace(settings, **{case.replace("-", "_"): value})  # type: ignore[arg-type]
    if case == "crc":
        if value not in ("on", "off"):
            raise ValueError(f"crc {value!r}: it can be on, off")
        return replace(settings, crc=value == "on")
    if case == "timeout-ms":
        return replace(settings, timeout_s=_timeout_ms(value) / 1000.0)
    if case == "home-us":
        return replace(settings, home_steps=width_steps(case, value))
    if case in MOST:
        if not value.isdecimal() or int(value) > MOST[case]:
            raise ValueError(f"{case} {value!r}: not a whole number from 0 to {MOST[case]}")
        return replace(settings, **{case: int(value)})  # type: ignore[arg-type]
    raise ValueError(f"set {case!r}: unknown; there is {', '.join(cases())}")


def _timeout_ms(value: str) -> float:
    number = _number(value)
    if not 0.0 <= number <= LONGEST_TIMEOUT_MS:
        raise ValueError(
            f"timeout-ms {value!r}: not a number of milliseconds from 0 to {LONGEST_TIMEOUT_MS:g}"
        )
    # The board counts in hundredths of a second.
    return round(number / 10.0) * 10.0


def width_steps(case: str, value: str) -> int:
    """Read a pulse width in microseconds; return quarter microseconds.

    Raises:
        ValueError: it is none that the board can send.
    """
    number = _number(value)
    if not LOWEST_US <= number <= HIGHEST_US:
        raise ValueError(
            f"{case} {value!r}: not a pulse width from {LOWEST_US:g} to {HIGHEST_US:g} us"
        )
    return round(number * US)


def _number(value: str) -> float:
    try:
        return float(value)
    except ValueError:
        return float("nan")
