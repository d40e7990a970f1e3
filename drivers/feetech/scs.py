"""Feetech SCS servos, used in many small heads, as a family of the servo bus.

They use the packets of the STS series with the high byte first. Their position comes from a
potentiometer of 1024 steps over less than a turn, so no position is ambiguous. They have no sync
read (each is read alone), no offset, no volatile torque limit, and no present current. Values
marked [A] are assumptions, as they are not documented. Sources: Feetech, SCSCL of its SDK
(addresses); rustypot's table of the SCS0009.
"""

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from gazerig.drivers.feetech.family import FEETECH, SENSED, SIGNS, wanted_settings
from gazerig.drivers.feetech.memory_table import (
    REGISTERS,
    SCS_BAUD_RATES,
    SCS_MODELS,
    SCS_STEPS,
    TORQUE_FULL,
)
from gazerig.drivers.servo_bus.family import Register, Window

if TYPE_CHECKING:  # the guardian starts without numpy
    from gazerig.drivers.types import ServoConfig

_ABSENT = {
    *("protection_current", "angular_resolution", "position_offset", "operating_mode"),
    *("velocity_p_gain", "velocity_i_gain", "overcurrent_time", "torque_limit", "present_current"),
    "phase",
}
_ELSEWHERE = {"protective_torque": 37, "protection_time": 38, "overload_torque": 39, "lock": 48}
_OTHERWISE: dict[str, dict[str, Any]] = {
    "baud_rate": {"high": len(SCS_BAUD_RATES) - 1},
    "min_position_limit": {"high": SCS_STEPS - 1},
    "max_position_limit": {"initial": SCS_STEPS - 1, "high": SCS_STEPS - 1},
    "unloading_condition": {"initial": 0x24},  # [A]: overheating, overload
}

SCS_REGISTERS: dict[str, Register] = {
    name: register._replace(
        address=_ELSEWHERE.get(name, register.address), order="big", **_OTHERWISE.get(name, {})
    )
    for name, register in REGISTERS.items()
    if name not in _ABSENT
}
"""Registers by name."""


def scs_settings(setup: "ServoConfig") -> dict[str, int]:
    """Return the required register values; strength is Max Torque (16), in EEPROM."""
    wanted = {name: v for name, v in wanted_settings(setup).items() if name in SCS_REGISTERS}
    if setup.strength is not None:
        wanted["max_torque"] = round(setup.strength * TORQUE_FULL)
    return wanted


FEETECH_SCS = replace(
    FEETECH,
    name="feetech scs",
    registers=SCS_REGISTERS,
    models=SCS_MODELS,
    steps_per_turn=SCS_MODELS["scs0009"].steps_per_turn,
    acceleration_units=lambda accel_steps_s2: 0,  # [A]: 41 is not documented
    goal_layout=">BHHH",
    sync_read=False,
    baud_rates=SCS_BAUD_RATES,
    scan_rates=SCS_BAUD_RATES,
    window=Window(56, ">HHHBBxB", SENSED, SIGNS),
    polled=(("torque_enable", "torque_enable"),),
    read_spans=(("return_delay_time", "position_i_gain"), ("lock", "lock")),
    wanted_settings=scs_settings,
    single_turn=False,
)
