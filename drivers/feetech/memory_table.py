"""Control tables of the Feetech STS and SCS servos as data.

Units: position 1 step = 1/4096 turn; speed steps/s; acceleration 100 steps/s^2; load and
torque limits 0.1 %; voltage 0.1 V; temperature 1 degC; current 6.5 mA; return delay 2 us;
protection times 10 ms. Signed numbers have a sign bit and a magnitude. Of two bytes the low one
comes first.

Sources: Feetech memory table STS3215, and for missing entries the tables of public clients.
"""

from dataclasses import dataclass
from typing import Annotated, Any

from gazerig.drivers.servo_bus.family import Register as Register
from gazerig.drivers.servo_bus.family import ServoModel
from gazerig.params import Choices

STEPS_PER_TURN = 4096
ACCELERATION_UNIT_STEPS_S2 = 100.0
CURRENT_UNIT_MA = 6.5
TORQUE_FULL = 1000
"""Register value of Torque Limit and Max Torque for 100 %."""

FACTORY_P_GAIN, P_FULL_STEPS = 32, 1600.0
"""P gain as delivered, and steps of error (4096 a turn) times P gain at which the duty is full.
Assumed: owners measure 20-30 steps of error at half the stall torque with factory gains."""

FASTEST, HARDEST = 32767, 254
"""Largest values of Goal Speed and Acceleration; 0 in either means no limit."""

BAUD_RATES = (1_000_000, 500_000, 250_000, 128_000, 115_200, 76_800, 57_600, 38_400)
"""Bit/s by the value of Baud Rate (6)."""


@dataclass(frozen=True, slots=True)
class FeetechParams:
    """Communication parameters of the servos, set in a rig file."""

    # fmt: off
    baud: Annotated[int, Choices(*BAUD_RATES[::-1]), "Speed of the bus; the servos must be set to the same speed."] = 1_000_000
    # fmt: on


HIGHEST_ID = 253

EEPROM_END = 40
"""Addresses below keep their values without power, if the lock (55) was open during the write."""

SET_MIDDLE = 128
"""Value of Torque Enable (40) that sets the present position to 2048 by the offset (31)."""

MULTI_TURN = 0x10
"""Bit of Phase (18): positions continue to count beyond a turn."""

STATUS_ERRORS = {
    0x01: "input voltage",
    0x02: "encoder",
    0x04: "overheating",
    0x08: "overcurrent",
    0x20: "overload",
}
"""Bits of the error byte in every answer, and of Status (65). They are transient: nothing latches.
Overload protection reduces torque to a share (34) until a goal moves the joint away from the
obstacle."""


MODELS = {
    model.name: model
    for model in (
        ServoModel("sts3215", 777, 4096, 70, 40, 80, 1.91, 7.4, 2.7, 55.0),
        ServoModel("sts3215-12v", 777, 4096, 70, 40, 140, 2.94, 12.0, 2.7, 45.0),
    )
}

# fmt: off
_ALL: tuple[Register, ...] = (
    Register("firmware_major",           0, 1, initial=3),
    Register("firmware_minor",           1, 1, initial=10),
    Register("endianness",               2, 1, initial=0),
    Register("model_number",             3, 2),
    Register("id",                       5, 1, "rw", 1),
    Register("baud_rate",                6, 1, "rw", 0),
    Register("return_delay_time",        7, 1, "rw", 0),
    # 0: only pings and reads are answered; 1: every instruction.
    Register("status_return_level",      8, 1, "rw", 1),
    # Both 0: no limits and multi-turn.
    Register("min_position_limit",       9, 2, "rw", 0),
    Register("max_position_limit",      11, 2, "rw", 4095),
    Register("temperature_limit",       13, 1, "rw", 70),
    Register("max_voltage_limit",       14, 1, "rw", 80),
    Register("min_voltage_limit",       15, 1, "rw", 40),
    # Copied to Torque Limit (48) at power-up.
    Register("max_torque",              16, 2, "rw", 1000),
    Register("phase",                   18, 1, "rw", 12),
    # Bits as in STATUS_ERRORS: errors that switch torque off.
    Register("unloading_condition",     19, 1, "rw", 44),
    Register("position_p_gain",         21, 1, "rw", 32),
    Register("position_d_gain",         22, 1, "rw", 32),
    Register("position_i_gain",         23, 1, "rw", 0),
    Register("protection_current",      28, 2, "rw", 500),
    Register("angular_resolution",      30, 1, "rw", 1),
    Register("position_offset",         31, 2, "rw", 0, sign=11),
    # 0 position, 1 speed, 2 open loop, 3 stepwise.
    Register("operating_mode",          33, 1, "rw", 0),
    Register("protective_torque",       34, 1, "rw", 20),
    Register("protection_time",         35, 1, "rw", 200),
    Register("overload_torque",         36, 1, "rw", 80),
    Register("velocity_p_gain",         37, 1, "rw", 10),
    Register("overcurrent_time",        38, 1, "rw", 200),
    Register("velocity_i_gain",         39, 1, "rw", 10),
    Register("torque_enable",           40, 1, "rw", 0),
    Register("acceleration",            41, 1, "rw", 0),
    Register("goal_position",           42, 2, "rw", sign=15),
    Register("goal_time",               44, 2, "rw", 0),
    Register("goal_speed",              46, 2, "rw", 0, sign=15),
    Register("torque_limit",            48, 2, "rw"),
    Register("lock",                    55, 1, "rw", 1),
    Register("present_position",        56, 2, sign=15),
    Register("present_velocity",        58, 2, sign=15),
    Register("present_load",            60, 2, sign=10),
    Register("present_input_voltage",   62, 1),
    Register("present_temperature",     63, 1),
    Register("registered_instruction",  64, 1),
    Register("status",                  65, 1),
    Register("moving",                  66, 1),
    Register("present_current",         69, 2, sign=15),
)
# fmt: on

REGISTERS: dict[str, Register] = {register.name: register for register in _ALL}
"""Registers by name, with values common to all models; addresses are the same in every model."""


# --- SCS servos
#
# They use the packets of the STS series with the high byte first. Their position comes from a
# potentiometer of 1024 steps over less than a turn, so no position is ambiguous. They have no sync
# read (each is read alone), no offset, no volatile torque limit, and no present current. Values
# marked [A] are assumptions, as they are not documented. Sources: Feetech, SCSCL of its SDK
# (addresses); rustypot's table of the SCS0009.

SCS_STEPS = 1024
"""Steps of the potentiometer of an SCS servo."""

SCS_BAUD_RATES = (1_000_000, 500_000, 250_000, 128_000, 115_200, 57_600, 38_400, 19_200)
"""Bit/s by the value of an SCS servo's Baud Rate (6)."""

SCS_MODELS = {
    model.name: model
    for model in (
        # 1024 steps cover 300 and 200 deg; the number is extrapolated to a full turn.
        ServoModel("scs0009", 1284, 1229, 70, 40, 80, 0.226, 6.0, 1.0, 100.0),
        # Number and stall current of the SCS15 are assumed.
        ServoModel("scs15", 1295, 1843, 70, 40, 80, 1.47, 6.0, 2.0, 62.5),
    )
}


_ABSENT = {
    *("protection_current", "angular_resolution", "position_offset", "operating_mode"),
    *("velocity_p_gain", "velocity_i_gain", "overcurrent_time", "torque_limit", "present_current"),
    "phase",
}
_ELSEWHERE = {"protective_torque": 37, "protection_time": 38, "overload_torque": 39, "lock": 48}
_OTHERWISE: dict[str, dict[str, Any]] = {
    "max_position_limit": {"initial": SCS_STEPS - 1},
    "unloading_condition": {"initial": 0x24},  # [A]: overheating, overload
}

SCS_REGISTERS: dict[str, Register] = {
    name: register._replace(
        address=_ELSEWHERE.get(name, register.address), order="big", **_OTHERWISE.get(name, {})
    )
    for name, register in REGISTERS.items()
    if name not in _ABSENT
}
"""Registers of an SCS servo by name."""


def acceleration_units(accel_steps_s2: float | None) -> int:
    """Return an acceleration in units of Acceleration, rounded down but at least 1.

    It is 0, which means no limit, for None and for more than the register can hold: its greatest
    value, 2232 deg/s2, would double the duration of a 10 deg saccade. Goals are planned within the
    joint's own acceleration anyway.
    """
    if accel_steps_s2 is None or accel_steps_s2 > HARDEST * ACCELERATION_UNIT_STEPS_S2:
        return 0
    return max(1, int(accel_steps_s2 / ACCELERATION_UNIT_STEPS_S2))
