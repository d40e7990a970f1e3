"""The series of Feetech servos that can be emulated: STS by the driver's models, and SCS.

SCS servos speak the same packets with the high byte of two first. Their position comes from a
potentiometer of 1024 steps over less than a turn; with both angle limits 0 they are driven by the
duty in Goal Time (44). They answer no sync read and have no offset, torque limit or current.
Sources: Feetech, SCSCL of its SDK (addresses); rustypot's table of the SCS0009. What is marked [A]
is assumed: no public document tells.
"""

from gazerig.drivers.feetech.memory_table import MODELS, FeetechModel
from gazerig.sim_mock.feetech.memory import STS, Register, Table

_EEPROM = (
    Register("id", 5, initial=1),
    Register("baud_rate", 6),
    Register("return_delay", 7, initial=250),  # [A]
    Register("status_level", 8, initial=1),
    Register("min_angle", 9, 2),
    Register("max_angle", 11, 2, 1023),
    Register("temperature_limit", 13, initial=70),
    Register("max_voltage", 14, initial=80),
    Register("min_voltage", 15, initial=40),
    Register("max_torque", 16, 2, 1000),
    Register("phase", 18, initial=12),  # [A]: as STS
    Register("unload_conditions", 19, initial=0x24),  # [A]: overheat, overload
    Register("led_conditions", 20, initial=0x25),  # [A]
    Register("p_gain", 21, initial=32),  # [A]: gains as STS
    Register("d_gain", 22, initial=32),  # [A]
    Register("i_gain", 23),
    Register("minimum_force", 24, 2, 16),
    Register("dead_zone_cw", 26, initial=1),
    Register("dead_zone_ccw", 27, initial=1),
    Register("protective_torque", 37, initial=20),
    Register("protection_time", 38, initial=200),
    Register("overload_torque", 39, initial=80),
)
_FACTORY = (
    Register("pwm_step", 78),
    Register("moving_threshold", 79, initial=1),  # [A]
    Register("dts", 80),
    Register("min_speed", 81),
    Register("max_speed", 82),  # 50 steps/s, as the model is
)
_RAM = (
    Register("torque", 40),
    Register("acceleration", 41),
    Register("goal_position", 42, 2, sign=15),
    Register("goal_time", 44, 2),  # with both limits 0 the duty, its sign in bit 10
    Register("goal_speed", 46, 2, sign=15),
    Register("lock", 48, initial=1),
)
_FIXED = (
    Register("firmware_major", 0, initial=3),
    Register("firmware_minor", 1),
    Register("model", 3, 2),
    Register("registered", 64),
)
_ABSENT = (
    Register("protection_current", 256, 2, 0xFFFF),
    Register("offset", 258, 2),
    Register("mode", 260),
    Register("overcurrent_time", 261, initial=255),
    Register("torque_limit", 262, 2, 1000),
    Register("speed_p_gain", 264, initial=10),
    Register("speed_i_gain", 265, initial=200),
)
_STEPS = 1024
_BAUD_RATES = (1_000_000, 500_000, 250_000, 128_000, 115_200, 57_600, 38_400, 19_200)


def _scs(
    name: str, number: int, travel_deg: float, stall_nm: float, stall_a: float, rpm: float
) -> tuple[FeetechModel, Table]:
    """Return a model that is rated at 6 V, and its registers."""
    turn_steps = _STEPS * 360.0 / travel_deg
    model = FeetechModel(name, number, round(turn_steps), 70, 40, 80, stall_nm, 6.0, stall_a, rpm)
    table = Table(
        eeprom=_EEPROM,
        factory=_FACTORY,
        ram=_RAM,
        fixed=_FIXED,
        absent=_ABSENT,
        order="big",
        lock_at=48,
        highest={5: 253, 6: len(_BAUD_RATES) - 1},
        turn_steps=turn_steps,
        last_step=_STEPS - 1,
        sync_read=False,
        baud_rates=_BAUD_RATES,
    )
    return model, table


SCS = {
    "scs0009": _scs("scs0009", 1284, 300.0, 0.226, 1.0, 100.0),
    # Number and stall current of the SCS15 are assumed [A].
    "scs15": _scs("scs15", 1295, 200.0, 1.47, 2.0, 62.5),
}


def series_of(model: str) -> tuple[FeetechModel, Table]:
    """Return a model and the registers of its series.

    Raises:
        ValueError: there is no such model.
    """
    if model in SCS:
        return SCS[model]
    if model not in MODELS:
        raise ValueError(f"model {model!r}: Feetech servos are {', '.join((*MODELS, *SCS))}")
    return MODELS[model], STS
