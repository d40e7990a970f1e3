"""Whether an STS servo is set as the rig wants it: the registers it keeps without power.

Source: Feetech, memory table STS3215.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

from drivers.feetech.memory_table import (
    BAUD_RATES,
    MULTI_TURN,
    RETURN_DELAY_UNIT_S,
    STATUS_ERRORS,
    STEPS_PER_TURN,
    TORQUE_FULL,
)
from robot.bringup.doctor.feetech_subject import StsPatient, StsRule
from robot.bringup.doctor.findings import Level
from robot.bringup.doctor.subject import Verdict

POSITION_MODE = 0
GUARDING = 0x04 | 0x08 | 0x20
"""Bits of Unload Conditions that protect motor and gears: overheating, overcurrent, overload."""
HOTTEST_C = 70
"""Temperature limit as from the factory; the motor's magnets suffer above."""

FIX = "gazerig doctor --fix"
MODES = {1: "wheel", 2: "open loop", 3: "stepwise"}


def _firmware(patient: StsPatient) -> Iterator[Verdict]:
    if patient.found.firmware < patient.setup.firmware_min:
        yield Verdict(
            "error",
            f"firmware {patient.found.firmware}, the YAML wants {patient.setup.firmware_min}",
            "update it with Feetech's program",
        )


class Wish(NamedTuple):
    """A register that should have one value."""

    register: str
    value: int
    level: Level
    says: Callable[[int], str]


def _delay(value: int) -> str:
    wait_us = value * RETURN_DELAY_UNIT_S * 1e6
    return f"waits {wait_us:.0f} us before every answer (Return Delay {value}): the bus is slower"


WISHES = (
    Wish("return_delay_time", 0, "warn", _delay),
    Wish(
        "status_return_level", 1, "warn",
        lambda v: f"does not confirm what it is told (Status Return Level {v}, should be 1)",
    ),
    Wish(
        "operating_mode", POSITION_MODE, "warn",
        lambda v: f"is in {MODES.get(v, 'unknown')} mode (Mode {v}), not in position mode",
    ),
    Wish(
        "angular_resolution", 1, "warn",
        lambda v: f"counts {v} turns for one (Angular Resolution {v}, should be 1)",
    ),
)  # fmt: skip


def _wishes(patient: StsPatient) -> Iterator[Verdict]:
    for wish in WISHES:
        value = patient.values[wish.register]
        if value != wish.value:
            yield Verdict(wish.level, wish.says(value), FIX, ((wish.register, wish.value),))


def _baud(patient: StsPatient) -> Iterator[Verdict]:
    value = patient.values["baud_rate"]
    if value < len(BAUD_RATES) and BAUD_RATES[value] != patient.found.baud:
        yield Verdict(
            "warn",
            f"answers at {patient.found.baud} bit/s, but its Baud Rate is {BAUD_RATES[value]}: "
            "after its next start it will not be heard here",
            f"gazerig setup --joint {patient.setup.name}",
        )


def _turns(patient: StsPatient) -> Iterator[Verdict]:
    phase = patient.values["phase"]
    if phase & MULTI_TURN:
        yield Verdict(
            "warn",
            f"goes on counting beyond one turn (Phase {phase})",
            FIX,
            (("phase", phase & ~MULTI_TURN),),
        )


def _limits(patient: StsPatient) -> Iterator[Verdict]:
    low, high = patient.values["min_position_limit"], patient.values["max_position_limit"]
    setup = patient.setup
    # Both limits 0 would mean none at all.
    least, most = max(0, setup.min_steps), max(1, setup.max_steps)
    if (low, high) == (least, most):
        return
    fixes = (("min_position_limit", least), ("max_position_limit", most))
    if low == high == 0:
        yield Verdict("warn", "has no position limits of its own and many turns", FIX, fixes)
    elif low > least or high < most:
        yield Verdict(
            "warn",
            f"its own position limits {low}..{high} cut the YAML's range {least}..{most}",
            FIX,
            fixes,
        )
    else:
        yield Verdict(
            "note", f"its own position limits {low}..{high} are wider than the YAML's range", FIX,
            fixes,
        )  # fmt: skip


def _offset(patient: StsPatient) -> Iterator[Verdict]:
    offset = patient.values["position_offset"]
    if offset:
        yield Verdict(
            "note",
            f"its places are shifted by {offset} steps (Offset): the calibration counts on that",
            f"leave it so; after a change of it run gazerig calibrate --joint {patient.setup.name}",
        )


def _force(patient: StsPatient) -> Iterator[Verdict]:
    most = patient.values["max_torque"]
    if most < TORQUE_FULL:
        yield Verdict(
            "note",
            f"gives {most / TORQUE_FULL:.0%} of its torque at most (Max Torque {most})",
            "where that was not on purpose set Max Torque (16) to 1000 with Feetech's program",
        )


def _speed(patient: StsPatient) -> Iterator[Verdict]:
    turns_s = patient.setup.max_speed_steps_s / STEPS_PER_TURN
    fastest_s = patient.model.no_load_rpm / 60.0
    if turns_s > fastest_s:
        yield Verdict(
            "note",
            f"the YAML asks its shaft for {360.0 * turns_s:.0f} deg/s; without load and at "
            f"{patient.model.rated_v:g} V it turns {360.0 * fastest_s:.0f}",
            "lower max_speed_deg_s in the YAML",
        )


def _protection(patient: StsPatient) -> Iterator[Verdict]:
    values = patient.values
    unload = values["unloading_condition"]
    off = [name for bit, name in STATUS_ERRORS.items() if bit & GUARDING and not bit & unload]
    if off:
        yield Verdict(
            "warn",
            f"does not protect itself at {', '.join(off)} (Unload Conditions {unload})",
            FIX,
            (("unloading_condition", unload | GUARDING),),
        )
    hottest = values["temperature_limit"]
    if hottest > HOTTEST_C:
        yield Verdict(
            "warn",
            f"switches off above {hottest} degC only (Max Temperature)",
            FIX,
            (("temperature_limit", HOTTEST_C),),
        )
    share, after_s = values["overload_torque"], values["protection_time"] / 100.0
    if share >= 100 or not after_s:
        yield Verdict(
            "warn",
            "its overload protection cannot act as meant "
            f"(Overload Torque {share} %, Protection Time {after_s:g} s)",
            "set Overload Torque (36) to 80 and Protection Time (35) to 200 with Feetech's program",
        )


SETTINGS: tuple[StsRule, ...] = (
    _firmware,
    _baud,
    _wishes,
    _turns,
    _limits,
    _offset,
    _force,
    _speed,
    _protection,
)
