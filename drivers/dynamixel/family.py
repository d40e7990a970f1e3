"""Dynamixel X servos (Protocol 2.0) as a family of the servo bus."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from gazerig.drivers.dynamixel import protocol
from gazerig.drivers.dynamixel.control_table import (
    MODELS,
    PWM_FULL,
    REGISTERS,
    STEPS_PER_TURN,
    WATCHDOG_UNIT_S,
    acceleration_units,
    name_errors,
    speed_units,
)
from gazerig.drivers.dynamixel.registers import Registers
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.family import Arming, Family

if TYPE_CHECKING:  # the guardian starts without numpy
    from gazerig.drivers.types import ServoSetup

POSITION_MODE = 3

STEEPEST_PWM = 255
"""PWM Slope: with the factory's 140 a motor needs 36 ms from full drive to full brake, in which a
lid at 600 deg/s runs 4 deg too far."""

PING_QUIET_S = 0.04
"""All who will answer a ping to everybody have done so when nothing came for so long."""

PING_MOST_S = 0.8
"""The SDK waits so long for them; nobody answers later."""

_ROOM = 4096


class Goals(protocol.SyncWrite):
    """Packets of goal positions; the speed is in the servo's own profile."""

    def __init__(self, ids: Sequence[int]) -> None:
        goal = REGISTERS["goal_position"]
        super().__init__(ids, goal.address, goal.size)

    def packet(self, goals: Sequence[int], speeds: Sequence[int] = ()) -> bytes:
        """Build the packet for one goal a servo."""
        return super().packet(goals)


def ping_all(port: BusPort, baud: int) -> dict[int, tuple[int, int]]:
    """Ask everybody who is there; return (model number, firmware) by id."""
    port.clearPort()
    port.write(protocol.instruction(protocol.BROADCAST, protocol.PING))
    end_s = port.now_s() + PING_MOST_S
    raw = b""
    while port.now_s() < end_s:
        more = port.read_until(_ROOM, port.now_s() + PING_QUIET_S)
        raw += more
        if not more or len(raw) >= 4 * _ROOM:
            break
    return {
        status.id: (status.params[0] | status.params[1] << 8, status.params[2])
        for status in protocol.statuses(raw)
        if status.intact and len(status.params) == 3
    }


def wanted_settings(setup: "ServoSetup") -> dict[str, int]:
    """Return the registers a servo must have, by name, in register units."""
    model = MODELS[setup.model]
    speed = speed_units(setup.max_speed_steps_s)
    wanted = {"return_delay_time": 0, "drive_mode": 0, "operating_mode": POSITION_MODE}
    if setup.strength is not None:
        wanted["pwm_limit"] = round(setup.strength * PWM_FULL)
    if model.family == "x330":
        wanted["pwm_slope"] = STEEPEST_PWM
    wanted["velocity_limit"] = min(speed, model.velocity_limit)
    wanted["max_position_limit"] = setup.max_steps
    wanted["min_position_limit"] = setup.min_steps
    if setup.gains is not None:
        names = ("position_d_gain", "position_i_gain", "position_p_gain")
        wanted |= dict(zip(names, reversed(setup.gains), strict=True))
    wanted["profile_acceleration"] = acceleration_units(setup.max_accel_steps_s2)
    wanted["profile_velocity"] = speed
    return wanted


def _target(name: str, found: int, wanted: int) -> int:
    """A higher velocity limit than needed may stay."""
    return max(found, wanted) if name == "velocity_limit" else wanted


DYNAMIXEL = Family(
    name="dynamixel",
    codec=protocol,
    registers=REGISTERS,
    models=MODELS,
    steps_per_turn=STEPS_PER_TURN,
    name_errors=name_errors,
    speed_units=speed_units,
    acceleration_units=acceleration_units,
    goals=Goals,
    single=Registers,
    ping_all=ping_all,
    # Written in this order, as a new operating mode puts gains and profile back.
    spans=(
        ("return_delay_time", "operating_mode"),
        ("pwm_limit", "pwm_limit"),
        ("pwm_slope", "pwm_slope"),
        ("velocity_limit", "min_position_limit"),
        ("position_d_gain", "position_p_gain"),
        ("profile_acceleration", "profile_velocity"),
    ),
    wanted=wanted_settings,
    target=_target,
    passes=2,
    answer_level=2,
    lock=None,
    error_register="hardware_error_status",
    faults_latch=True,
    watchdog_unit_s=WATCHDOG_UNIT_S,
    goal_speed=False,
    single_turn=False,
    broadcast_ping=True,
    arming=Arming("profile_velocity", speed=True),
    most_goals=253,
    usual_bauds="57600 or 1000000",
    fault_cure="then restart the servo power",
    jump_cure="set its Homing Offset to 0",
)
