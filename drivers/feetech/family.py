"""Feetech STS and SCS servos as two families of the servo bus."""

from dataclasses import replace
from typing import TYPE_CHECKING

from gazerig.drivers.feetech import protocol
from gazerig.drivers.feetech.memory_table import (
    BAUD_RATES,
    HIGHEST_ID,
    MODELS,
    MULTI_TURN,
    REGISTERS,
    SCS_BAUD_RATES,
    SCS_MODELS,
    SCS_REGISTERS,
    STATUS_ERRORS,
    STEPS_PER_TURN,
    TORQUE_FULL,
    acceleration_units,
)
from gazerig.drivers.servo_bus.family import Family, Window

if TYPE_CHECKING:  # the guardian starts without numpy
    from gazerig.drivers.types import ServoConfig

POSITION_MODE = 0


def wanted_settings(setup: "ServoConfig") -> dict[str, int]:
    """Return the required register values by name, in register units.

    For "phase" only the multi-turn bit is required: it must be 0.
    """
    wanted = {
        "return_delay_time": 0,
        "status_return_level": 1,
        "min_position_limit": max(0, setup.min_steps),
        # 0 for both limits would mean no limits.
        "max_position_limit": max(1, setup.max_steps),
        "phase": 0,
        "angular_resolution": 1,
        "operating_mode": POSITION_MODE,
        "lock": 1,
    }
    if setup.strength is not None:
        wanted["torque_limit"] = round(setup.strength * TORQUE_FULL)
    if setup.gains is not None:
        names = ("position_p_gain", "position_i_gain", "position_d_gain")
        wanted |= dict(zip(names, setup.gains, strict=True))
    return wanted


_SENSED = ("position", "velocity", "effort", "voltage", "temperature", "status")
_SIGNS = (15, 15, 10)
"""Sign bits of Present Position, Velocity and Load."""


FEETECH = Family(
    name="feetech",
    codec=protocol,
    registers=REGISTERS,
    models={**MODELS, **SCS_MODELS},
    steps_per_turn=STEPS_PER_TURN,
    errors=STATUS_ERRORS,
    error_register="status",
    effort_register="present_load",
    velocity_unit_steps_s=1.0,
    acceleration_units=acceleration_units,
    # Goal, time and speed (42..47).
    goal_layout="<BHHH",
    goal_speed=True,
    arming_register="acceleration",
    most_goals=35,
    sync_read=True,
    fast_read_since={},
    baud_rates=BAUD_RATES,
    factory_baud=1_000_000,
    highest_id=HIGHEST_ID,
    format_firmware=lambda firmware: f"{firmware // 100}.{firmware % 100}",
    updater="Feetech's program FD",
    # Present Position to Status (56..65).
    window=Window(56, "<HHHBBxB", _SENSED, _SIGNS),
    polled=(("torque_enable", "torque_limit"),),
    read_spans=(("return_delay_time", "operating_mode"), ("torque_limit", "lock")),
    wanted_settings=wanted_settings,
    # Only one bit of Phase is changed; the others keep their values.
    corrected_value=lambda name, found, wanted: found & ~MULTI_TURN if name == "phase" else wanted,
    answer_level=1,
    lock_register="lock",
    faults_latch=False,
    watchdog_unit_s=None,
    single_turn=True,
)


def scs_settings(setup: "ServoConfig") -> dict[str, int]:
    """Return the required register values of an SCS servo; its strength is Max Torque (16)."""
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
    window=Window(56, ">HHHBBxB", _SENSED, _SIGNS),
    polled=(("torque_enable", "torque_enable"),),
    read_spans=(("return_delay_time", "position_i_gain"), ("lock", "lock")),
    wanted_settings=scs_settings,
    single_turn=False,
)
