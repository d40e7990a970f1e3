"""What the doctor must know of Dynamixel X servos. Source: ROBOTIS e-Manual, X series."""

from collections.abc import Iterator

from gazerig.drivers.dynamixel.control_table import (
    FAST_READ_SINCE,
    HARDWARE_ERRORS,
    MODELS,
    SHADOW_OFF,
    VELOCITY_UNIT_STEPS_S,
    X330_WIDE_INDIRECT_SINCE,
)
from gazerig.drivers.servo_bus.registers import Registers
from gazerig.robot.bringup.doctor.subject import (
    FIX,
    FirmwareNote,
    Protection,
    ServoChecks,
    ServoState,
    Verdict,
    WantedSetting,
)
from gazerig.robot.bringup.servo_families import DYNAMIXEL as KIND

GUARDING = (2, 4, 5)
"""Bits of Shutdown that protect motor and gears: overheating, electrical shock, overload."""

VELOCITY_UNIT_DEG_S = 0.229 * 6.0
PROGRAM = "Dynamixel Wizard 2.0"

READ = (
    "status_return_level",
    "torque_enable",
    "hardware_error_status",
    "bus_watchdog",
    "baud_rate",
    "return_delay_time",
    "drive_mode",
    "operating_mode",
    "secondary_id",
    "protocol_type",
    "homing_offset",
    "temperature_limit",
    "max_voltage_limit",
    "min_voltage_limit",
    "velocity_limit",
    "max_position_limit",
    "min_position_limit",
    "startup_configuration",
    "shutdown",
    "present_position",
    "present_input_voltage",
    "present_temperature",
)
"""The registers that are looked at."""


def read(registers: Registers, servo_id: int) -> dict[str, int | None]:
    """Read a servo's registers one by one."""
    first = registers.read(servo_id, READ[0])
    if first is None:  # answers pings alone: every further question would wait in vain
        return dict.fromkeys(READ)
    return {READ[0]: first, **{name: registers.read(servo_id, name) for name in READ[1:]}}


def _drive_mode(value: int) -> str:
    names = {0: "reversed", 2: "profile in milliseconds", 3: "torque on with any goal"}
    named = ", ".join(name for bit, name in names.items() if value >> bit & 1)
    return f"Drive Mode {value} ({named}) instead of 0; direction belongs into the YAML's sign"


MODES = {
    0: "current",
    1: "velocity",
    4: "extended position",
    5: "current-based position",
    16: "PWM",
}


def _startup(value: int) -> str:
    what = "switches its torque on by itself" if value & 1 else "restores old settings"
    return f"{what} when power comes (Startup Configuration {value})"


WANTED = (
    WantedSetting(
        "return_delay_time", 0, "warn",
        lambda v: f"waits {2 * v} us before every answer (Return Delay Time {v}): the bus is "
        "slower",
    ),
    WantedSetting(
        "status_return_level", 2, "warn",
        lambda v: f"does not confirm what it is told (Status Return Level {v}, should be 2)",
    ),
    WantedSetting("drive_mode", 0, "warn", _drive_mode),
    WantedSetting(
        "operating_mode", 3, "warn",
        lambda v: f"is in {MODES.get(v, 'unknown')} mode (Operating Mode {v}), not in position "
        "mode",
    ),
    WantedSetting(
        "protocol_type", 2, "warn",
        lambda v: f"Protocol Type {v} instead of 2: after its next start it will not answer",
        f"set it to 2 with {PROGRAM}",
    ),
    WantedSetting("startup_configuration", 0, "warn", _startup),
    WantedSetting(
        "homing_offset", 0, "warn",
        lambda v: f"Homing Offset {v}: position mode heeds only -1024..1024 of it, and some "
        "firmware wraps the position by a whole turn when the torque comes on",
        f"set it to 0 with {PROGRAM}, then calibrate its zero anew: gazerig calibrate",
    ),
)  # fmt: skip


def _firmware_notes(model: str) -> tuple[FirmwareNote, ...]:
    family = MODELS[model].family
    slow = FirmwareNote(
        FAST_READ_SINCE[family],
        "warn",
        "has no fast sync read: the loop is slower",
        f"update it with {PROGRAM}",
    )
    moved = FirmwareNote(
        X330_WIDE_INDIRECT_SINCE, "note", "keeps its indirect data elsewhere (208); that is known"
    )
    return (slow, moved) if family == "x330" else (slow,)


def _shadow(state: ServoState) -> Iterator[Verdict]:
    value = state.values["secondary_id"]
    if value is not None and value < SHADOW_OFF:
        yield Verdict(
            "error",
            f"also obeys what is sent to servo {value} (Secondary ID {value})",
            FIX,
            (("secondary_id", 255),),
        )


def _velocity(state: ServoState) -> Iterator[Verdict]:
    limit = state.values["velocity_limit"]
    needed = int(state.setup.max_speed_steps_s / VELOCITY_UNIT_STEPS_S)
    if limit is not None and limit < needed:
        yield Verdict(
            "note",
            f"its Velocity Limit is {limit * VELOCITY_UNIT_DEG_S:.0f} deg/s, the YAML asks for "
            f"{needed * VELOCITY_UNIT_DEG_S:.0f}",
            f"lower max_speed_deg_s in the YAML or raise the limit with {PROGRAM}",
        )


def _voltage_latch(state: ServoState) -> Iterator[Verdict]:
    value = state.values["shutdown"]
    if value is not None and value & 1:
        low, high = state.values["min_voltage_limit"], state.values["max_voltage_limit"]
        limits = f"{(low or 0) / 10.0:.1f}..{(high or 0) / 10.0:.1f} V"
        yield Verdict(
            "note",
            f"a moment outside {limits} makes it limp until it is restarted (Shutdown {value})",
            "size the supply for all servos at once, and feed long chains at both ends; "
            "gazerig reboot brings a latched servo back",
        )


DYNAMIXEL = ServoChecks(
    kind=KIND,
    program=PROGRAM,
    manual="the e-Manual",
    read=read,
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
    wanted=WANTED,
    protection=Protection(
        "shutdown",
        {1 << bit: HARDWARE_ERRORS[bit] for bit in GUARDING},
        "does not switch off at {errors} (Shutdown {value})",
        lambda model: f"set Shutdown (63) to {MODELS[model].shutdown} with {PROGRAM}",
    ),
    firmware_notes=_firmware_notes,
    rules=(_shadow, _velocity, _voltage_latch),
)
