"""Whether a servo is set as the rig wants it: the registers it keeps without power.

Source: ROBOTIS e-Manual, X series.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

from drivers.dynamixel.control_table import (
    BAUD_RATES,
    FAST_READ_SINCE,
    HARDWARE_ERRORS,
    SHADOW_OFF,
    VELOCITY_UNIT_STEPS_S,
    X330_WIDE_INDIRECT_SINCE,
)
from robot.bringup.doctor.findings import Level
from robot.bringup.doctor.subject import Patient, Rule, Verdict

POSITION_MODE = 3
GUARDING = (2, 4, 5)
"""Bits of Shutdown that protect motor and gears: overheating, electrical shock, overload."""

VELOCITY_UNIT_DEG_S = 0.229 * 6.0


def _firmware(patient: Patient) -> Iterator[Verdict]:
    firmware, family = patient.found.firmware, patient.model.family
    update = "update it with Dynamixel Wizard 2.0"
    if firmware < patient.setup.firmware_min:
        yield Verdict(
            "error", f"firmware {firmware}, the YAML wants {patient.setup.firmware_min}", update
        )
    elif firmware < FAST_READ_SINCE[family]:
        yield Verdict(
            "warn", f"firmware {firmware} has no fast sync read: the loop is slower", update
        )
    elif family == "x330" and firmware < X330_WIDE_INDIRECT_SINCE:
        yield Verdict(
            "note", f"firmware {firmware} keeps its indirect data elsewhere (208); that is known"
        )


class Wish(NamedTuple):
    """A register that should have one value; ``cure`` is said where ``--fix`` does not help."""

    register: str
    value: int
    level: Level
    says: Callable[[int], str]
    fixable: bool = True
    cure: str = "gazerig doctor --fix"


def _return_delay(value: int) -> str:
    return (
        f"waits {2 * value} us before every answer (Return Delay Time {value}): the bus is slower"
    )


def _return_level(value: int) -> str:
    return f"does not confirm what it is told (Status Return Level {value}, should be 2)"


def _drive_mode(value: int) -> str:
    names = {0: "reversed", 2: "profile in milliseconds", 3: "torque on with any goal"}
    named = ", ".join(name for bit, name in names.items() if value >> bit & 1)
    return f"Drive Mode {value} ({named}) instead of 0; direction belongs into the YAML's sign"


def _operating_mode(value: int) -> str:
    names = {
        0: "current",
        1: "velocity",
        4: "extended position",
        5: "current-based position",
        16: "PWM",
    }
    return (
        f"is in {names.get(value, 'unknown')} mode (Operating Mode {value}), not in position mode"
    )


def _protocol(value: int) -> str:
    return f"Protocol Type {value} instead of 2: after its next start it will not answer"


def _startup(value: int) -> str:
    what = "switches its torque on by itself" if value & 1 else "restores old settings"
    return f"{what} when power comes (Startup Configuration {value})"


def _homing(value: int) -> str:
    return (
        f"Homing Offset {value}: position mode heeds only -1024..1024 of it, and some firmware "
        "wraps the position by a whole turn when the torque comes on"
    )


WISHES = (
    Wish("return_delay_time", 0, "warn", _return_delay),
    Wish("status_return_level", 2, "warn", _return_level),
    Wish("drive_mode", 0, "warn", _drive_mode),
    Wish("operating_mode", POSITION_MODE, "warn", _operating_mode),
    Wish("protocol_type", 2, "warn", _protocol, False, "set it to 2 with Dynamixel Wizard 2.0"),
    Wish("startup_configuration", 0, "warn", _startup),
    Wish(
        "homing_offset", 0, "warn", _homing, False,
        "set it to 0 with Dynamixel Wizard 2.0, then calibrate its zero anew: gazerig calibrate",
    ),
)  # fmt: skip


def _wishes(patient: Patient) -> Iterator[Verdict]:
    for wish in WISHES:
        value = patient.values[wish.register]
        if value is not None and value != wish.value:
            fixes = ((wish.register, wish.value),) if wish.fixable else ()
            yield Verdict(wish.level, wish.says(value), wish.cure, fixes)


def _baud(patient: Patient) -> Iterator[Verdict]:
    value = patient.values["baud_rate"]
    if value is None or value >= len(BAUD_RATES) or BAUD_RATES[value] == patient.found.baud:
        return
    yield Verdict(
        "warn",
        f"answers at {patient.found.baud} bit/s, but its Baud Rate is {BAUD_RATES[value]}: after "
        "its next start it will not be heard here",
        f"gazerig setup --joint {patient.setup.name}",
    )


def _shadow(patient: Patient) -> Iterator[Verdict]:
    value = patient.values["secondary_id"]
    if value is not None and value < SHADOW_OFF:
        yield Verdict(
            "error",
            f"also obeys what is sent to servo {value} (Secondary ID {value})",
            "gazerig doctor --fix",
            (("secondary_id", 255),),
        )


def _limits(patient: Patient) -> Iterator[Verdict]:
    low, high = patient.values["min_position_limit"], patient.values["max_position_limit"]
    setup = patient.setup
    if low is None or high is None or (low, high) == (setup.min_steps, setup.max_steps):
        return
    fixes = (("min_position_limit", setup.min_steps), ("max_position_limit", setup.max_steps))
    own = f"its own position limits {low}..{high}"
    if low > setup.min_steps or high < setup.max_steps:
        wanted = f"{setup.min_steps}..{setup.max_steps}"
        yield Verdict("warn", f"{own} cut the YAML's range {wanted}", "gazerig doctor --fix", fixes)
    else:
        yield Verdict(
            "note", f"{own} are wider than the YAML's range", "gazerig doctor --fix", fixes
        )


def _velocity(patient: Patient) -> Iterator[Verdict]:
    limit = patient.values["velocity_limit"]
    needed = int(patient.setup.max_speed_steps_s / VELOCITY_UNIT_STEPS_S)
    if limit is not None and limit < needed:
        yield Verdict(
            "note",
            f"its Velocity Limit is {limit * VELOCITY_UNIT_DEG_S:.0f} deg/s, the YAML asks for "
            f"{needed * VELOCITY_UNIT_DEG_S:.0f}",
            "lower max_speed_deg_s in the YAML or raise the limit with Dynamixel Wizard 2.0",
        )


def _shutdown(patient: Patient) -> Iterator[Verdict]:
    value = patient.values["shutdown"]
    if value is None:
        return
    off = [HARDWARE_ERRORS[bit] for bit in GUARDING if not value >> bit & 1]
    if off:
        yield Verdict(
            "warn",
            f"does not switch off at {', '.join(off)} (Shutdown {value})",
            f"set Shutdown (63) to {patient.model.shutdown} with Dynamixel Wizard 2.0",
        )
    if value & 1:
        low, high = patient.values["min_voltage_limit"], patient.values["max_voltage_limit"]
        limits = f"{(low or 0) / 10.0:.1f}..{(high or 0) / 10.0:.1f} V"
        yield Verdict(
            "note",
            f"a moment outside {limits} makes it limp until it is restarted (Shutdown {value})",
            "size the supply for all servos at once, and feed long chains at both ends; "
            "gazerig reboot brings a latched servo back",
        )


SETTINGS: tuple[Rule, ...] = (_firmware, _baud, _shadow, _wishes, _limits, _velocity, _shutdown)
