"""Properties of each family of smart servo for the doctor: registers, correct values, texts.

Sources: ROBOTIS e-Manual, X series; Feetech, memory table STS3215.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

from gazerig.drivers.dynamixel import control_table as dynamixel
from gazerig.drivers.feetech import memory_table as feetech
from gazerig.features.bringup.doctor.diagnostics import Advice, Level
from gazerig.features.bringup.servo_kinds import DYNAMIXEL, FEETECH, SCS, ServoKind

FIX = "gazerig doctor --fix"

COMMON = (
    *("status_return_level", "torque_enable", "baud_rate", "return_delay_time", "operating_mode"),
    *("temperature_limit", "max_voltage_limit", "min_voltage_limit"),
    *("max_position_limit", "min_position_limit"),
    *("present_position", "present_input_voltage", "present_temperature"),
)
"""Registers of every smart servo that are read."""

DELAY_UNIT_US = 1e6 * dynamixel.RETURN_DELAY_UNIT_S
"""Unit of Return Delay Time, the same for all servos."""


class WantedSetting(NamedTuple):
    """A register that should have one value.

    text: description of a value
    remedy: any text other than ``FIX`` offers no fix; {setup.name} is the joint
    mask: selects its bits
    least, most: values between them are also correct
    """

    register: str
    value: int
    level: Level
    text: Callable[[int], str]
    remedy: str = FIX
    mask: int = ~0
    least: int | None = None
    most: int | None = None

    def accepts(self, value: int) -> bool:
        """Return whether the value of a register is correct."""
        if self.least is None and self.most is None:
            return value & self.mask == self.value
        above = self.least is None or value >= self.least
        return above and (self.most is None or value <= self.most)


class Protection(NamedTuple):
    """Register by which a servo protects motor and gears.

    errors: errors that must switch it off, by the bits of the register
    text: text with {errors} and {value}
    by_hand: remedy by the user, by model; None: missing bits may be set
    """

    register: str
    errors: Mapping[int, str]
    text: str
    by_hand: Callable[[str], str] | None = None


@dataclass(frozen=True)
class ServoChecks:
    """Properties of a kind of servo that the rules need.

    maker_program: program of the maker, for settings that this program cannot write
    maker_manual: manual of the maker
    registers: registers that the rules read
    ping_only: whether Status Return Level 0 means that only pings are answered
    out_of_voltage: effect of a supply outside the limits
    error_remedies: remedies by error; {setup.id} is the servo's id; "" for an error that only its
        measured value shows
    unlimited_at_zero: whether both position limits 0 mean no limits
    firmware_notes: notes by model, each with the firmware below which it applies; the first is used
    """

    kind: ServoKind
    maker_program: str
    maker_manual: str
    registers: tuple[str, ...]
    ping_only: bool
    out_of_voltage: str
    error_remedies: Mapping[str, str]
    unlimited_at_zero: bool
    wanted_settings: tuple[WantedSetting, ...]
    protection: Protection
    firmware_notes: Callable[[str], tuple[tuple[int, Advice], ...]]


def _common(kind: ServoKind, position: int, others: Mapping[int, str]) -> tuple[WantedSetting, ...]:
    """Return settings that every smart servo has.

    position: Operating Mode for goal positions; others: names of the other modes
    """
    level = kind.family.answer_level
    return (
        WantedSetting(
            "return_delay_time", 0, "warn",
            lambda v: f"waits {DELAY_UNIT_US * v:.0f} us before every answer (Return Delay Time "
            f"{v}): the bus is slower",
        ),
        WantedSetting(
            "status_return_level", level, "warn",
            lambda v: f"does not confirm commands (Status Return Level {v}, should be "
            f"{level})",
        ),
        WantedSetting(
            "operating_mode", position, "warn",
            lambda v: f"is in {others.get(v, 'unknown')} mode (Operating Mode {v}), not in "
            "position mode",
        ),
    )  # fmt: skip


# --- Dynamixel X

WIZARD = "Dynamixel Wizard 2.0"


def _drive_mode(value: int) -> str:
    names = {0: "reversed", 2: "profile in milliseconds", 3: "torque on with any goal"}
    named = ", ".join(name for bit, name in names.items() if value >> bit & 1)
    return f"Drive Mode {value} ({named}) instead of 0; direction belongs into the YAML's sign"


def _startup(value: int) -> str:
    what = "switches its torque on by itself" if value & 1 else "restores old settings"
    return f"{what} when power comes (Startup Configuration {value})"


def _firmware_notes(model: str) -> tuple[tuple[int, Advice], ...]:
    series = dynamixel.MODELS[model].series
    slow = "firmware {found.firmware} has no fast sync read: the loop is slower"
    return ((dynamixel.FAST_READ_SINCE[series], Advice("warn", slow, f"update it with {WIZARD}")),)


_DYNAMIXEL = ServoChecks(
    kind=DYNAMIXEL,
    maker_program=WIZARD,
    maker_manual="the e-Manual",
    registers=(
        *COMMON,
        *("hardware_error_status", "bus_watchdog", "drive_mode", "secondary_id", "protocol_type"),
        *("homing_offset", "velocity_limit", "startup_configuration", "shutdown"),
    ),
    ping_only=True,
    out_of_voltage="",
    error_remedies={
        "input voltage": "measure the supply at the last servo under load; keep it inside the "
        "limits",
        "overheating": "let it cool for 20 minutes and find what makes it work so hard",
        "encoder": "replace the servo if it comes again",
        "electrical shock": "check plugs and wires for shorts; the supply may be too weak",
        "overload": "free the joint: something holds it or its range is too wide",
    },
    unlimited_at_zero=False,
    wanted_settings=(
        *_common(DYNAMIXEL, 3, {0: "current", 1: "velocity", 4: "extended position",
                                5: "current-based position", 16: "PWM"}),
        WantedSetting("drive_mode", 0, "warn", _drive_mode),
        WantedSetting(
            "secondary_id", 255, "error",
            lambda v: f"also obeys what is sent to servo {v} (Secondary ID {v})",
            least=dynamixel.SHADOW_OFF,
        ),
        WantedSetting(
            "protocol_type", 2, "warn",
            lambda v: f"Protocol Type {v} instead of 2: after its next start it will not answer",
            f"set it to 2 with {WIZARD}",
        ),
        WantedSetting("startup_configuration", 0, "warn", _startup),
        WantedSetting(
            "homing_offset", 0, "warn",
            lambda v: f"Homing Offset {v}: position mode heeds only -1024..1024 of it, and some "
            "firmware wraps the position by a whole turn when the torque comes on",
            f"set it to 0 with {WIZARD}, then calibrate its zero again: gazerig calibrate",
        ),
    ),
    protection=Protection(
        "shutdown",
        {1 << bit: dynamixel.HARDWARE_ERRORS[bit] for bit in (2, 4, 5)},
        "does not switch off at {errors} (Shutdown {value})",
        lambda model: f"set Shutdown (63) to {dynamixel.MODELS[model].shutdown} with {WIZARD}",
    ),
    firmware_notes=_firmware_notes,
)  # fmt: skip


# --- Feetech STS

FD = "Feetech's program"

HOTTEST_C = 70
"""Factory setting of the temperature limit; the motor's magnets suffer above."""

_FEETECH = ServoChecks(
    kind=FEETECH,
    maker_program=FD,
    maker_manual="Feetech's manual",
    registers=(
        *COMMON,
        *("status", "lock", "angular_resolution", "phase", "position_offset", "max_torque"),
        *("unloading_condition", "overload_torque", "protection_time"),
    ),
    ping_only=False,
    out_of_voltage=": it complains in every answer",
    error_remedies={
        "input voltage": "",
        "encoder": "its angle sensor fails: replace the servo if it comes again",
        "overheating": "let it cool for 20 minutes and find what makes it work so hard",
        "overcurrent": "free the joint and check plugs and wires for shorts; then switch its "
        "power off and on",
        "overload": "free the joint: something holds it or its range is too wide; then "
        "switch its power off and on",
    },
    unlimited_at_zero=True,
    wanted_settings=(
        *_common(FEETECH, 0, {1: "wheel", 2: "open loop", 3: "stepwise"}),
        WantedSetting(
            "angular_resolution", 1, "warn",
            lambda v: f"counts {v} turns for one (Angular Resolution {v}, should be 1)",
        ),
        WantedSetting(
            "phase", 0, "warn", lambda v: f"goes on counting beyond one turn (Phase {v})",
            mask=feetech.MULTI_TURN,
        ),
        WantedSetting(
            "position_offset", 0, "note",
            lambda v: f"its positions are shifted by {v} steps (Offset): the calibration counts "
            "on that",
            "leave it so; after a change of it run gazerig calibrate --joint {setup.name}",
        ),
        WantedSetting(
            "temperature_limit", HOTTEST_C, "warn",
            lambda v: f"switches off above {v} degC only (Max Temperature)",
            most=HOTTEST_C,
        ),
        WantedSetting(
            "max_torque", feetech.TORQUE_FULL, "note",
            lambda v: f"gives {v / feetech.TORQUE_FULL:.0%} of its torque at most (Max Torque {v})",
            f"if that was not on purpose, set Max Torque (16) to 1000 with {FD}",
            least=feetech.TORQUE_FULL,
        ),
    ),
    protection=Protection(
        "unloading_condition",
        {bit: feetech.STATUS_ERRORS[bit] for bit in (0x04, 0x08, 0x20)},
        "does not protect itself at {errors} (Unload Conditions {value})",
    ),
    firmware_notes=lambda model: (),
)  # fmt: skip

_SCS = replace(
    _FEETECH,
    kind=SCS,
    registers=tuple(name for name in _FEETECH.registers if name in SCS.family.registers),
    wanted_settings=tuple(
        one for one in _FEETECH.wanted_settings if one.register in SCS.family.registers
    ),
    protection=_FEETECH.protection._replace(
        errors={bit: feetech.STATUS_ERRORS[bit] for bit in (0x04, 0x20)}
    ),
)

CHECKS: dict[str, ServoChecks] = {one.kind.family.name: one for one in (_DYNAMIXEL, _FEETECH, _SCS)}
"""Checks by the name of the family."""
