"""Control tables of the Dynamixel X servos (Protocol 2.0) as data.

Units of the registers: position 1 step = 1/4096 turn; velocity 0.229 rev/min;
profile acceleration 214.577 rev/min^2; PWM 0.113 %; voltage 0.1 V; temperature 1 degC;
bus watchdog 20 ms; return delay 2 us; current ``DynamixelModel.current_unit_ma``.
Source: ROBOTIS e-Manual, X series.
"""

from dataclasses import dataclass
from math import ceil
from typing import Annotated, Literal

from gazerig.drivers.servo_bus.family import Register as Register
from gazerig.drivers.servo_bus.family import ServoModel

Series = Literal["x330", "x430"]


@dataclass(frozen=True, slots=True)
class DynamixelParams:
    """Communication parameters of the servos, set in a rig file."""

    # fmt: off
    baud: Annotated[Literal[57600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000],
        "Speed of the bus; the servos must be set to the same speed."] = 1_000_000
    # fmt: on


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

EEPROM_END = 64
"""Addresses below keep their values without power and are locked while torque is on."""

FAST_READ_SINCE: dict[Series, int] = {"x330": 46, "x430": 45}
"""First firmware with Fast Sync Read and Fast Bulk Read."""

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


@dataclass(frozen=True)
class DynamixelModel(ServoModel):
    """A Dynamixel model.

    current_limit: None if the model measures load instead of current
    current_limit .. shutdown: factory values of the registers with these names
    gains: factory values of the registers ``GAINS``
    """

    series: Series
    current_limit: int | None
    velocity_limit: int
    shutdown: int
    gains: tuple[int, int, int, int, int]

    @property
    def current_unit_ma(self) -> float:
        """Return the unit of Present Current, 0 if the model has none."""
        if self.current_limit is None:
            return 0.0
        if self.series == "x330":
            return 1.0
        return 1.34 if self.name.startswith("xh430-v") else 2.69

    @property
    def load_unit(self) -> float:
        """Return the share of the stall torque per unit of Present Current.

        Models without a current sensor report load in 0.1 % in that register.
        """
        if not self.current_unit_ma:
            return super().load_unit
        return self.current_unit_ma / (1000.0 * self.stall_current_a)


# fmt: off
MODELS: dict[str, DynamixelModel] = {m.name: m for m in (
    # Gains: ROBOTIS-GIT/docs (2026); older e-Manual pages exchange the D and I of this model.
    DynamixelModel("xl330-m077", 1190, 4096, 70, 35, 70, 0.215, 5.0, 1.47, 383.0,
          "x330", 1750, 1620, 53, (400, 40, 400, 0, 400)),
    DynamixelModel("xl330-m288", 1200, 4096, 70, 35, 70, 0.52, 5.0, 1.47, 103.0,
          "x330", 1750, 445, 53, (1600, 180, 0, 0, 400)),
    DynamixelModel("xc330-m181", 1230, 4096, 70, 35, 70, 0.60, 5.0, 1.80, 129.0,
          "x330", 2352, 545, 52, (1400, 100, 500, 0, 1200)),
    DynamixelModel("xc330-m288", 1240, 4096, 70, 35, 70, 0.93, 5.0, 1.80, 81.0,
          "x330", 2352, 350, 52, (1600, 50, 500, 0, 1100)),
    DynamixelModel("xc330-t181", 1210, 4096, 70, 55, 140, 0.80, 12.0, 0.88, 113.0,
          "x330", 910, 510, 52, (1200, 40, 0, 0, 900)),
    DynamixelModel("xc330-t288", 1220, 4096, 70, 55, 140, 1.00, 12.0, 0.88, 71.0,
          "x330", 910, 320, 52, (1200, 40, 0, 0, 900)),
    DynamixelModel("xl430-w250", 1060, 4096, 72, 60, 140, 1.5, 12.0, 1.4, 61.0,
          "x430", None, 265, 52, (1000, 100, 4000, 0, 640)),
    DynamixelModel("xm430-w350", 1020, 4096, 80, 95, 160, 4.1, 12.0, 2.3, 46.0,
          "x430", 1193, 200, 52, (1920, 100, 0, 0, 800)),
    DynamixelModel("xm430-w210", 1030, 4096, 80, 95, 160, 3.0, 12.0, 2.3, 77.0,
          "x430", 1193, 330, 52, (1920, 100, 0, 0, 800)),
    DynamixelModel("xh430-w350", 1000, 4096, 80, 95, 160, 3.4, 12.0, 1.3, 30.0,
          "x430", 648, 130, 52, (1920, 100, 0, 0, 900)),
    DynamixelModel("xh430-w210", 1010, 4096, 80, 95, 160, 2.5, 12.0, 1.3, 50.0,
          "x430", 648, 210, 52, (1920, 100, 0, 0, 900)),
    DynamixelModel("xh430-v350", 1040, 4096, 80, 110, 300, 3.3, 24.0, 0.7, 31.0,
          "x430", 689, 135, 52, (1920, 100, 0, 0, 800)),
    DynamixelModel("xh430-v210", 1050, 4096, 80, 110, 300, 2.6, 24.0, 0.7, 52.0,
          "x430", 689, 230, 52, (1920, 100, 0, 0, 800)),
)}

_BASE = (
    Register("model_number",            0, 2),
    Register("firmware_version",        6, 1),
    Register("id",                      7, 1, "rw", 1, 0, 252),
    Register("baud_rate",               8, 1, "rw", 1, 0, 7),
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
    Register("velocity_limit",         44, 4, "rw", None, 0, 2047),
    Register("max_position_limit",     48, 4, "rw", 4095, 0, 4095),
    Register("min_position_limit",     52, 4, "rw", 0, 0, 4095),
    Register("startup_configuration",  60, 1, "rw", 0, 0, 3),
    Register("pwm_slope",              62, 1, "rw", 140, 1, 255),
    Register("shutdown",               63, 1, "rw", None, 0, 63),
    Register("torque_enable",          64, 1, "rw", 0, 0, 1),
    Register("led",                    65, 1, "rw", 0, 0, 1),
    Register("status_return_level",    68, 1, "rw", 2, 0, 2),
    Register("hardware_error_status",  70, 1, "r", 0),
    Register("velocity_i_gain",        76, 2, "rw", None, 0, 16383),
    Register("velocity_p_gain",        78, 2, "rw", None, 0, 16383),
    Register("position_d_gain",        80, 2, "rw", None, 0, 16383),
    Register("position_i_gain",        82, 2, "rw", None, 0, 16383),
    Register("position_p_gain",        84, 2, "rw", None, 0, 16383),
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
)
# fmt: on

REGISTERS: dict[str, Register] = {register.name: register for register in _BASE}
"""Registers by name, with values common to all models; addresses are the same in every model."""


def acceleration_units(accel_steps_s2: float | None) -> int:
    """Return an acceleration in units of Profile Acceleration; 0 (no limit) for None."""
    if accel_steps_s2 is None:
        return 0
    return min(32767, max(1, ceil(accel_steps_s2 / ACCELERATION_UNIT_STEPS_S2)))
