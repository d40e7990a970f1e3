"""Feetech STS servos as a family of the servo bus."""

from typing import TYPE_CHECKING

from gazerig.drivers.feetech import protocol
from gazerig.drivers.feetech.memory_table import (
    BAUD_RATES,
    HIGHEST_ID,
    MODELS,
    MULTI_TURN,
    REGISTERS,
    STEPS_PER_TURN,
    TORQUE_FULL,
    acceleration_units,
    name_errors,
    speed_units,
)
from gazerig.drivers.feetech.protocol import MOST_GOALS, GoalWrite
from gazerig.drivers.servo_bus.family import Arming, Family

if TYPE_CHECKING:  # the guardian starts without numpy
    from gazerig.drivers.types import ServoSetup

POSITION_MODE = 0


def wanted_settings(setup: "ServoSetup") -> dict[str, int]:
    """Return the registers a servo must have, by name, in register units.

    Of "phase" only the bit for many turns is meant: it must be 0.
    """
    wanted = {
        "return_delay_time": 0,
        "status_return_level": 1,
        "min_position_limit": max(0, setup.min_steps),
        # Both limits 0 would mean none at all.
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


def _target(name: str, found: int, wanted: int) -> int:
    """One bit of Phase is of several others, which belong to the servo's own making."""
    return found & ~MULTI_TURN if name == "phase" else wanted


FEETECH = Family(
    name="feetech",
    codec=protocol,
    registers=REGISTERS,
    models=MODELS,
    steps_per_turn=STEPS_PER_TURN,
    name_errors=name_errors,
    speed_units=speed_units,
    acceleration_units=acceleration_units,
    goals=GoalWrite,
    baud_rates=BAUD_RATES,
    usual_rates=BAUD_RATES,
    factory_baud=1_000_000,
    highest_id=HIGHEST_ID,
    version=lambda firmware: f"{firmware // 100}.{firmware % 100}",
    spans=(("return_delay_time", "operating_mode"), ("torque_limit", "lock")),
    wanted=wanted_settings,
    target=_target,
    passes=1,
    answer_level=1,
    lock="lock",
    error_register="status",
    faults_latch=False,
    watchdog_unit_s=None,
    goal_speed=True,
    single_turn=True,
    broadcast_ping=False,
    quiet_s=0.004,
    thorough_s=0.004,
    telling=("present_position", "present_current"),
    protocol_1=None,
    arming=Arming("acceleration", speed=False),
    most_goals=MOST_GOALS,
    usual_bauds="115200 or 1000000",
    fault_cure="check its supply",
    jump_cure="restart the servo power",
)
