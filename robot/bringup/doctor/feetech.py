"""What the doctor must know of Feetech STS servos. Source: Feetech, memory table STS3215."""

from collections.abc import Iterator

from gazerig.drivers.feetech.memory_table import (
    EEPROM_END,
    MODELS,
    MULTI_TURN,
    REGISTERS,
    RETURN_DELAY_UNIT_S,
    STATUS_ERRORS,
    STEPS_PER_TURN,
    TORQUE_FULL,
)
from gazerig.drivers.servo_bus.registers import Registers
from gazerig.robot.bringup.doctor.subject import (
    FIX,
    Protection,
    ServoChecks,
    ServoState,
    Verdict,
    WantedSetting,
)
from gazerig.robot.bringup.servo_families import FEETECH as KIND

SPANS = ((0, EEPROM_END), (EEPROM_END, 71 - EEPROM_END))
"""First address and length of what is read at once: all that is kept, and all that lives."""

GUARDING = 0x04 | 0x08 | 0x20
"""Bits of Unload Conditions that protect motor and gears: overheating, overcurrent, overload."""
HOTTEST_C = 70
"""Temperature limit as from the factory; the motor's magnets suffer above."""

PROGRAM = "Feetech's program"
MODES = {1: "wheel", 2: "open loop", 3: "stepwise"}


def read(registers: Registers, servo_id: int) -> dict[str, int | None]:
    """Read a servo's memory in two pieces."""
    values: dict[str, int | None] = {}
    for first, length in SPANS:
        data = registers.read_bytes(servo_id, first, length)
        for name, register in REGISTERS.items():
            at = register.address - first
            if at >= 0 and at + register.size <= length:
                piece = None if data is None else data[at : at + register.size]
                values[name] = None if piece is None else register.decode(piece)
    return values


def _delay(value: int) -> str:
    wait_us = value * RETURN_DELAY_UNIT_S * 1e6
    return f"waits {wait_us:.0f} us before every answer (Return Delay {value}): the bus is slower"


WANTED = (
    WantedSetting("return_delay_time", 0, "warn", _delay),
    WantedSetting(
        "status_return_level", 1, "warn",
        lambda v: f"does not confirm what it is told (Status Return Level {v}, should be 1)",
    ),
    WantedSetting(
        "operating_mode", 0, "warn",
        lambda v: f"is in {MODES.get(v, 'unknown')} mode (Mode {v}), not in position mode",
    ),
    WantedSetting(
        "angular_resolution", 1, "warn",
        lambda v: f"counts {v} turns for one (Angular Resolution {v}, should be 1)",
    ),
    WantedSetting(
        "phase", 0, "warn", lambda v: f"goes on counting beyond one turn (Phase {v})",
        mask=MULTI_TURN,
    ),
    WantedSetting(
        "position_offset", 0, "note",
        lambda v: f"its places are shifted by {v} steps (Offset): the calibration counts on that",
        "leave it so; after a change of it run gazerig calibrate --joint {joint}",
    ),
)  # fmt: skip


def _force(state: ServoState) -> Iterator[Verdict]:
    most = state.values["max_torque"]
    if most is not None and most < TORQUE_FULL:
        yield Verdict(
            "note",
            f"gives {most / TORQUE_FULL:.0%} of its torque at most (Max Torque {most})",
            f"where that was not on purpose set Max Torque (16) to 1000 with {PROGRAM}",
        )


def _speed(state: ServoState) -> Iterator[Verdict]:
    model = MODELS[state.setup.model]
    turns_s = state.setup.max_speed_steps_s / STEPS_PER_TURN
    fastest_s = model.no_load_rpm / 60.0
    if turns_s > fastest_s:
        yield Verdict(
            "note",
            f"the YAML asks its shaft for {360.0 * turns_s:.0f} deg/s; without load and at "
            f"{model.rated_v:g} V it turns {360.0 * fastest_s:.0f}",
            "lower max_speed_deg_s in the YAML",
        )


def _heat(state: ServoState) -> Iterator[Verdict]:
    hottest = state.values["temperature_limit"]
    if hottest is not None and hottest > HOTTEST_C:
        yield Verdict(
            "warn",
            f"switches off above {hottest} degC only (Max Temperature)",
            FIX,
            (("temperature_limit", HOTTEST_C),),
        )


def _overload(state: ServoState) -> Iterator[Verdict]:
    share, after = state.values["overload_torque"], state.values["protection_time"]
    if share is not None and after is not None and (share >= 100 or not after):
        yield Verdict(
            "warn",
            "its overload protection cannot act as meant "
            f"(Overload Torque {share} %, Protection Time {after / 100.0:g} s)",
            f"set Overload Torque (36) to 80 and Protection Time (35) to 200 with {PROGRAM}",
        )


FEETECH = ServoChecks(
    kind=KIND,
    program=PROGRAM,
    manual="Feetech's manual",
    read=read,
    ping_only=False,
    out_of_voltage=": it complains in every answer",
    error_remedies={
        "input voltage": "",
        "encoder": "its angle sensor fails: replace the servo if it comes again",
        "overheating": "let it cool for 20 minutes and find what makes it work so hard",
        "overcurrent": "free the joint and check plugs and wires for shorts; gazerig reboot {id} "
        "ends it",
        "overload": "free the joint: something holds it or its range is too wide; gazerig reboot "
        "{id} ends it",
    },
    unlimited_at_zero=True,
    wanted=WANTED,
    protection=Protection(
        "unloading_condition",
        {bit: name for bit, name in STATUS_ERRORS.items() if bit & GUARDING},
        "does not protect itself at {errors} (Unload Conditions {value})",
    ),
    firmware_notes=lambda model: (),
    rules=(_force, _speed, _heat, _overload),
)
