"""Watching servos without touching them: reads alone, nothing is written, torque stays as it is.

A bus that is opened for moving prepares its servos, which is a write; this one only asks.
It does feed a servo's bus watchdog, as every packet does.
"""

import struct
from collections.abc import Callable, Mapping
from math import degrees
from typing import NamedTuple

from drivers.dynamixel_registers import Registers
from drivers.dynamixel_table import (
    MODELS,
    REGISTERS,
    STEPS_PER_TURN,
    VELOCITY_UNIT_STEPS_S,
    Model,
    name_errors,
)
from robot.joint import JointParams

# 116 goal position | 120 tick, 122 moving, 123 status, 124 pwm | 126 current, 128 velocity,
# 132 position | 136, 140 trajectory | 144 voltage, 146 temperature: no gap between them
_LIVE = struct.Struct("<i6xhii8xHB")
_LIVE_AT = REGISTERS["goal_position"].address

XL430_LOAD_FULL = 1000.0
"""Models without current measurement give their load in 0.1 % of the stall torque there."""


class Look(NamedTuple):
    """What one servo says of itself now.

    goal_deg, position_deg, velocity_deg_s: at the joint; the steps are the servo's own
    load: share of the stall torque, signed, -1..1
    errors: latched hardware errors by name
    """

    goal_deg: float
    goal_steps: int
    position_deg: float
    position_steps: int
    velocity_deg_s: float
    load: float
    temperature_c: int
    voltage_v: float
    torque: bool
    errors: tuple[str, ...]


class Sample(NamedTuple):
    """One look at all servos.

    at_s, took_s: when it was done and how long it took
    looks: by joint; None where the servo did not answer
    asked, unanswered: servos asked since the start, and how many of those did not answer
    """

    at_s: float
    took_s: float
    looks: Mapping[str, Look | None]
    asked: int
    unanswered: int


class Monitor:
    """Looks at the servos of a rig, one after the other.

    Args:
        registers: of the opened port; one try is enough, the next sample comes soon.
        joints: in the order of the samples.
        now_s: the port's clock.
    """

    def __init__(
        self, registers: Registers, joints: Mapping[str, JointParams], now_s: Callable[[], float]
    ) -> None:
        self._registers = registers
        self._joints = dict(joints)
        self._now_s = now_s
        self._asked = self._unanswered = 0

    def sample(self) -> Sample:
        """Look at every servo once.

        Raises:
            drivers.errors.BusLost: the port is gone.
        """
        start_s = self._now_s()
        looks = {name: self._look(joint) for name, joint in self._joints.items()}
        self._asked += len(looks)
        self._unanswered += sum(look is None for look in looks.values())
        end_s = self._now_s()
        return Sample(end_s, end_s - start_s, looks, self._asked, self._unanswered)

    def _look(self, joint: JointParams) -> Look | None:
        registers, servo_id = self._registers, joint.id
        registers.alerts.discard(servo_id)
        live = registers.read_bytes(servo_id, _LIVE_AT, _LIVE.size)
        torque = None if live is None else registers.read(servo_id, "torque_enable")
        if live is None or torque is None:
            return None
        latched = 0
        if servo_id in registers.alerts:
            latched = registers.read(servo_id, "hardware_error_status") or 0
        return look(joint, live, bool(torque), latched)


def look(joint: JointParams, live: bytes, torque: bool, latched: int) -> Look:
    """Take the registers 116..146 and what else was read apart, in units of the joint."""
    goal, effort, velocity, position, voltage, temperature = _LIVE.unpack(live)
    speed = velocity * VELOCITY_UNIT_STEPS_S * 360.0 / STEPS_PER_TURN
    return Look(
        degrees(joint.angle_rad(goal)),
        goal,
        degrees(joint.angle_rad(position)),
        position,
        speed / (joint.sign * joint.ratio),
        load_share(MODELS[joint.model], effort),
        temperature,
        voltage / 10.0,
        torque,
        name_errors(latched),
    )


def load_share(model: Model, register_126: int) -> float:
    """Give Present Current, or Present Load where the model has that, as a share of the stall."""
    if model.current_limit is None:
        return register_126 / XL430_LOAD_FULL
    return register_126 * model.current_unit_ma / (1000.0 * model.stall_current_a)


def as_json(sample: Sample, start_s: float) -> dict[str, object]:
    """Give a sample as plain values, times in seconds since the start."""
    return {
        "t_s": round(sample.at_s - start_s, 3),
        "took_ms": round(1e3 * sample.took_s, 1),
        "asked": sample.asked,
        "unanswered": sample.unanswered,
        "joints": {
            name: None if seen is None else _plain(seen) for name, seen in sample.looks.items()
        },
    }


def _plain(seen: Look) -> dict[str, object]:
    values = seen._asdict()
    for key, digits in (("goal_deg", 2), ("position_deg", 2), ("velocity_deg_s", 1), ("load", 3)):
        values[key] = round(values[key], digits)
    return values
