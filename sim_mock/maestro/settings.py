"""Configuration of an emulated Maestro, which Pololu's own program sets over USB on a real one.

Source: Pololu Maestro User's Guide (0J40), sections 4.b and 5.a. On a real board one setting per
channel defines its reaction to start and error; here all channels have the same, and the two can
differ.
"""

from dataclasses import dataclass, replace
from typing import Literal, get_args

Mode = Literal["usb-dual-port", "mute"]
OnError = Literal["off", "home", "ignore"]
Startup = Literal["off", "home"]

LONGEST_TIMEOUT_MS = 655_350.0
LOWEST_US, HIGHEST_US = 64.0, 3280.0
US = 4


@dataclass(frozen=True)
class Settings:
    """Settings of a board.

    mode: mute is the USB command port of a board in a UART mode, which ignores all bytes
    crc: whether a CRC is expected after every command except those of the Mini SSC protocol
    timeout_s: time without a valid command that is an error; 0: never
    on_error, startup: reaction of all channels; home_steps: the home position
    speed, acceleration: initial limits of every channel, in the board's units
    """

    mode: Mode = "usb-dual-port"
    crc: bool = False
    timeout_s: float = 0.0
    on_error: OnError = "off"
    startup: Startup = "off"
    home_steps: int = 1500 * US
    speed: int = 0
    acceleration: int = 0


MOST = {"speed": 3968, "acceleration": 255}
"""Largest limits of a board; 0: none."""

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


def change_setting(settings: Settings, case: str, value: str) -> Settings:
    """Return the settings with a new value for one case.

    Raises:
        ValueError: the case or value is unknown.
    """
    if case in _WORDS:
        if value not in _WORDS[case]:
            raise ValueError(f"{case} {value!r}: expected {', '.join(_WORDS[case])}")
        return replace(settings, **{case.replace("-", "_"): value})  # type: ignore[arg-type]
    if case == "crc":
        if value not in ("on", "off"):
            raise ValueError(f"crc {value!r}: expected on or off")
        return replace(settings, crc=value == "on")
    if case == "timeout-ms":
        number = _number(value)
        if not 0.0 <= number <= LONGEST_TIMEOUT_MS:
            raise ValueError(
                f"timeout-ms {value!r}: not a number of milliseconds from 0 to {LONGEST_TIMEOUT_MS:g}"
            )
        # The board counts in hundredths of a second.
        return replace(settings, timeout_s=round(number / 10.0) * 10.0 / 1000.0)
    if case == "home-us":
        return replace(settings, home_steps=width_steps(case, value))
    if case in MOST:
        if not value.isdecimal() or int(value) > MOST[case]:
            raise ValueError(f"{case} {value!r}: not a whole number from 0 to {MOST[case]}")
        return replace(settings, **{case: int(value)})  # type: ignore[arg-type]
    raise ValueError(f"set {case!r}: unknown; expected {', '.join(cases())}")


def width_steps(case: str, value: str) -> int:
    """Parse a pulse width in microseconds; return quarter microseconds.

    Raises:
        ValueError: the board cannot send it.
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
