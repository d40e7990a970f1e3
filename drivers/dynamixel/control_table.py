"""Control tables of the Dynamixel X servos (Protocol 2.0) as data.

Units of the registers: position 1 step = 1/4096 turn; velocity 0.229 rev/min;
profile acceleration 214.577 rev/min^2; PWM 0.113 %; voltage 0.1 V; temperature 1 degC;
bus watchdog 20 ms; return delay 2 us; current ``DynamixelModel.current_unit_ma``.
Source: ROBOTIS e-Manual, X series.
"""

from math import ceil
from typing import Literal, NamedTuple

from gazerig.drivers.servo_bus.family import Register as Register

Family = Literal["x330", "x430"]

STEPS_PER_TURN = 4096
VELOCITY_UNIT_STEPS_S = 0.229 / 60.0 * STEPS_PER_TURN
ACCELERATION_UNIT_STEPS_S2 = 214.577 / 3600.0 * STEPS_PER_TURN
WATCHDOG_UNIT_S = 0.02
PWM_FULL = 885
"""PWM register value for 100 %."""
P_UNIT = 128.0
"""P gain that adds one unit of PWM per step of position error [A: the unit of the error]."""

BAUD_RATES = (9600, 57600, 115200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000)
"""Bit/s by the value of Baud Rate (8); the last one only on the X430."""

RETURN_DELAY_UNIT_S = 2e-6
SHADOW_OFF = 253
"""Smallest value of Secondary ID (12) that disables it."""

EEPROM_END = 64
"""Addresses below keep their values without power and are locked while torque is on."""

FAST_READ_SINCE: dict[Family, int] = {"x330": 46, "x430": 45}
"""First firmware with Fast Sync Read and Fast Bulk Read."""

X330_WIDE_INDIRECT_SINCE = 53
"""First X330 firmware whose indirect data starts at 224 instead of 208."""

HARDWARE_ERRORS = {
    0: "input voltage",
    2: "overheating",
    3: "encoder",
    4: "electrical shock",
    5: "overload",
}
"""Bits of Hardware Error Status (70) and Shutdown (63)."""


GAINS = (
    "velocity_i_gain",
    "velocity_p_gain",
    "position_d_gain",
    "position_i_gain",
    "position_p_gain",
)


class DynamixelModel(NamedTuple):
    """Properties of a servo model.

    temperature_limit .. shutdown: factory values of the registers with these names
    current_limit: None if the model measures load instead of current
    gains: factory values of velocity I and P, position D, I and P
    stall_torque_nm, stall_current_a, no_load_rpm: values at rated_v
    """

    name: str
    number: int
    family: Family
    temperature_limit: int
    max_voltage: int
    min_voltage: int
    current_limit: int | None
    velocity_limit: int
    shutdown: int
    gains: tuple[int, int, int, int, int]
    stall_torque_nm: float
    rated_v: float
    stall_current_a: float
    no_load_rpm: float

    @property
    def steps_per_turn(self) -> int:
        """Return the number of steps of the encoder."""
        return STEPS_PER_TURN

    @property
    def no_load_steps_s(self) -> float:
        """Return the no-load speed at the rated voltage."""
        return self.no_load_rpm / 60.0 * STEPS_PER_TURN

    @property
    def current_unit_ma(self) -> float:
        """Return the unit of Present Current, 0 if the model has none."""
        if self.current_limit is None:
            return 0.0
        if self.family == "x330":
            return 1.0
        return 1.34 if self.name.startswith("xh430-v") else 2.69

    @property
    def load_unit(self) -> float:
        """Return the share of the stall torque per unit of Present Current.

        Models without a current sensor report load in 0.1 % in that register.
        """
        if not self.current_unit_ma:
            return 0.001
        return self.current_unit_ma / (1000.0 * self.stall_current_a)


# fmt: off
MODELS: dict[str, DynamixelModel] = {m.name: m for m in (
    # Gains: ROBOTIS-GIT/docs (2026) has D 400, I 0, older e-Manual pages D 0, I 400. That these
    # exchanged D and I is inferred: it would be the only I gain of the series.
    DynamixelModel("xl330-m077", 1190, "x330", 70, 70, 35, 1750, 1620, 53,
          (400, 40, 400, 0, 400), 0.215, 5.0, 1.47, 383.0),
    DynamixelModel("xl330-m288", 1200, "x330", 70, 70, 35, 1750, 445, 53,
          (1600, 180, 0, 0, 400), 0.52, 5.0, 1.47, 103.0),
    DynamixelModel("xc330-m181", 1230, "x330", 70, 70, 35, 2352, 545, 52,
          (1400, 100, 500, 0, 1200), 0.60, 5.0, 1.80, 129.0),
    DynamixelModel("xc330-m288", 1240, "x330", 70, 70, 35, 2352, 350, 52,
          (1600, 50, 500, 0, 1100), 0.93, 5.0, 1.80, 81.0),
    DynamixelModel("xc330-t181", 1210, "x330", 70, 140, 55, 910, 510, 52,
          (1200, 40, 0, 0, 900), 0.80, 12.0, 0.88, 113.0),
    DynamixelModel("xc330-t288", 1220, "x330", 70, 140, 55, 910, 320, 52,
          (1200, 40, 0, 0, 900), 1.00, 12.0, 0.88, 71.0),
    DynamixelModel("xl430-w250", 1060, "x430", 72, 140, 60, None, 265, 52,
          (1000, 100, 4000, 0, 640), 1.5, 12.0, 1.4, 61.0),
    DynamixelModel("xm430-w350", 1020, "x430", 80, 160, 95, 1193, 200, 52,
          (1920, 100, 0, 0, 800), 4.1, 12.0, 2.3, 46.0),
    DynamixelModel("xm430-w210", 1030, "x430", 80, 160, 95, 1193, 330, 52,
          (1920, 100, 0, 0, 800), 3.0, 12.0, 2.3, 77.0),
    DynamixelModel("xh430-w350", 1000, "x430", 80, 160, 95, 648, 130, 52,
          (1920, 100, 0, 0, 900), 3.4, 12.0, 1.3, 30.0),
    DynamixelModel("xh430-w210", 1010, "x430", 80, 160, 95, 648, 210, 52,
          (1920, 100, 0, 0, 900), 2.5, 12.0, 1.3, 50.0),
    DynamixelModel("xh430-v350", 1040, "x430", 80, 300, 110, 689, 135, 52,
          (1920, 100, 0, 0, 800), 3.3, 24.0, 0.7, 31.0),
    DynamixelModel("xh430-v210", 1050, "x430", 80, 300, 110, 689, 230, 52,
          (1920, 100, 0, 0, 800), 2.6, 24.0, 0.7, 52.0),
)}

_BASE = (
    Register("model_number",            0, 2),
    Register("model_information",       2, 4),
    Register("firmware_version",        6, 1),
    Register("id",                      7, 1, "rw", 1, 0, 252),
    Register("baud_rate",               8, 1, "rw", 1, 0, 6),
    Register("return_delay_time",       9, 1, "rw", 250, 0, 254),
    Register("drive_mode",             10, 1, "rw", 0, 0, 13),
    Register("operating_mode",         11, 1, "rw", 3, 0, 16),
    Register("secondary_id",           12, 1, "rw", 255, 0, 255),
    Register("protocol_type",          13, 1, "rw", 2, 1, 22),
    Register("homing_offset",          20, 4, "rw", 0, -1_044_479, 1_044_479, True),
    Register("moving_threshold",       24, 4, "rw", 10, 0, 1023),
    Register("temperature_limit",      31, 1, "rw", None, 0, 100),
    Register("max_voltage_limit",      32, 2, "rw"),
    Register("min_voltage_limit",      34, 2, "rw"),
    Register("pwm_limit",              36, 2, "rw", 885, 0, 885),
    Register("current_limit",          38, 2, "rw"),
    Register("velocity_limit",         44, 4, "rw"),
    Register("max_position_limit",     48, 4, "rw", 4095, 0, 4095),
    Register("min_position_limit",     52, 4, "rw", 0, 0, 4095),
    Register("startup_configuration",  60, 1, "rw", 0, 0, 3),
    Register("pwm_slope",              62, 1, "rw", 140, 1, 255),
    Register("shutdown",               63, 1, "rw", None, 0, 63),
    Register("torque_enable",          64, 1, "rw", 0, 0, 1),
    Register("led",                    65, 1, "rw", 0, 0, 1),
    Register("status_return_level",    68, 1, "rw", 2, 0, 2),
    Register("registered_instruction", 69, 1, "r", 0),
    Register("hardware_error_status",  70, 1, "r", 0),
    Register("velocity_i_gain",        76, 2, "rw", None, 0, 16383),
    Register("velocity_p_gain",        78, 2, "rw", None, 0, 16383),
    Register("position_d_gain",        80, 2, "rw", None, 0, 16383),
    Register("position_i_gain",        82, 2, "rw", None, 0, 16383),
    Register("position_p_gain",        84, 2, "rw", None, 0, 16383),
    Register("feedforward_2nd_gain",   88, 2, "rw", 0, 0, 16383),
    Register("feedforward_1st_gain",   90, 2, "rw", 0, 0, 16383),
    # Range of written values: 0 off or clear, 1..127 armed. It reads 255 once tripped.
    Register("bus_watchdog",           98, 1, "rw", 0, 0, 127),
    Register("goal_pwm",              100, 2, "rw", None, None, None, True),
    Register("goal_current",          102, 2, "rw", None, None, None, True),
    Register("goal_velocity",         104, 4, "rw", None, None, None, True),
    Register("profile_acceleration",  108, 4, "rw", 0, 0, 32767),
    Register("profile_velocity",      112, 4, "rw", 0, 0, 32767),
    Register("goal_position",         116, 4, "rw", None, None, None, True),
    Register("realtime_tick",         120, 2),
    Register("moving",                122, 1),
    Register("moving_status",         123, 1),
    Register("present_pwm",           124, 2, signed=True),
    Register("present_current",       126, 2, signed=True),
    Register("present_velocity",      128, 4, signed=True),
    Register("present_position",      132, 4, signed=True),
    Register("velocity_trajectory",   136, 4, signed=True),
    Register("position_trajectory",   140, 4, signed=True),
    Register("present_input_voltage", 144, 2),
    Register("present_temperature",   146, 1),
    Register("backup_ready",          147, 1),
)
# fmt: on

REGISTERS: dict[str, Register] = {
    r.name: r._replace(area="eeprom") if r.address < EEPROM_END else r for r in _BASE
}
"""Registers by name, with values common to all models; addresses are the same in every model."""


class IndirectBlock(NamedTuple):
    """A window of RAM whose bytes mirror other bytes, selected by two-byte addresses.

    Entry i has its address at ``address_base + 2 i`` and its byte at ``data_base + i``; addresses
    must be within target_low .. target_high.
    """

    address_base: int
    data_base: int
    entries: int
    target_low: int
    target_high: int


def indirect_blocks(model: DynamixelModel, firmware: int) -> tuple[IndirectBlock, ...]:
    """Return the indirect windows of a model with a firmware version."""
    if model.family == "x430":
        return (IndirectBlock(168, 224, 28, 64, 661), IndirectBlock(578, 634, 28, 64, 661))
    if firmware >= X330_WIDE_INDIRECT_SINCE:
        return (IndirectBlock(168, 224, 28, 64, 251),)
    return (IndirectBlock(168, 208, 20, 64, 227),)


def registers_of(model: DynamixelModel) -> tuple[Register, ...]:
    """Return a model's registers with its initial values and ranges (no indirect windows)."""
    absent = {"pwm_slope"} if model.family == "x430" else set[str]()
    if model.current_limit is None:
        absent |= {"current_limit", "goal_current"}
    initial: dict[str, int | None] = {
        "model_number": model.number,
        "temperature_limit": model.temperature_limit,
        "max_voltage_limit": model.max_voltage,
        "min_voltage_limit": model.min_voltage,
        "current_limit": model.current_limit,
        "velocity_limit": model.velocity_limit,
        "pwm_slope": 255 if model.name.startswith("xc330-t") else 140,
        "shutdown": model.shutdown,
        **dict(zip(GAINS, model.gains, strict=True)),
    }
    small = model.family == "x330"
    ranges = {
        "baud_rate": (0, 6 if small else 7),
        "protocol_type": (2, 22) if small else (1, 2),
        "max_voltage_limit": (_lowest_voltage(model), model.max_voltage),
        "min_voltage_limit": (_lowest_voltage(model), model.max_voltage),
        "current_limit": (0, model.current_limit or 0),
        "velocity_limit": (0, 2047 if small else 1023),
    }
    fitted = []
    for one in REGISTERS.values():
        if one.name not in absent:
            low, high = ranges.get(one.name, (one.low, one.high))
            first = initial.get(one.name, one.initial)
            fitted.append(one._replace(initial=first, low=low, high=high))
    return tuple(fitted)


def _lowest_voltage(model: DynamixelModel) -> int:
    """Return the lower bound of both voltage limits, 0.1 V; below the initial one on 5 V models."""
    return 31 if model.rated_v == 5.0 else model.min_voltage


def name_errors(status: int) -> tuple[str, ...]:
    """Return the names of the set bits of Hardware Error Status."""
    bits = [bit for bit in range(8) if status >> bit & 1]
    return tuple(HARDWARE_ERRORS.get(bit, f"error bit {bit}") for bit in bits)


def speed_units(speed_steps_s: float) -> int:
    """Return a speed in units of Profile Velocity, at least 1, as 0 means no limit."""
    return max(1, int(speed_steps_s / VELOCITY_UNIT_STEPS_S))


MOST_ACCELERATION = 32767
"""Largest Profile Acceleration."""


def acceleration_units(accel_steps_s2: float | None) -> int:
    """Return an acceleration in units of Profile Acceleration; 0 (no limit) for None."""
    if accel_steps_s2 is None:
        return 0
    return min(MOST_ACCELERATION, max(1, ceil(accel_steps_s2 / ACCELERATION_UNIT_STEPS_S2)))
