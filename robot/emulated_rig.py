"""The emulated servos of a rig: built into joints as the rig's YAML says."""

from math import radians

from config.schema import Rig
from robot.types import JOINTS
from sim_mock.servo_physics import Physics, ServoSpec

_CROOKED_DEG = {"left_eye_pan": 6.0, "right_eye_pan": -4.0, "neck_yaw": -12.0, "neck_pitch": -8.0}
"""Emulated joints start a little crooked, as a head that somebody has moved by hand does."""

_STOP_BEYOND_DEG = 4.0
"""Emulated joints have mechanical stops so far beyond their configured range."""

_LOAD_KG_M2 = {"neck_yaw": 2.0e-3, "neck_pitch": 3.0e-3, "neck_roll": 3.0e-3}
"""Inertia of a balanced head of 0.6 kg about its axes; eyes and lids weigh next to nothing."""


def emulated_servos(rig: Rig) -> list[ServoSpec]:
    """Give the servos of a rig in the order of JOINTS."""
    return [_spec(rig, name) for name in JOINTS]


def _spec(rig: Rig, name: str) -> ServoSpec:
    joint = rig.joints[name]
    start = round(joint.steps(radians(_CROOKED_DEG.get(name, 0.0))))
    ends = (joint.min_deg - _STOP_BEYOND_DEG, joint.max_deg + _STOP_BEYOND_DEG)
    low, high = sorted(joint.steps(radians(end)) for end in ends)
    load = _LOAD_KG_M2.get(name, 0.0) / joint.ratio**2
    physics = Physics(load_kg_m2=load, stop_low_steps=low, stop_high_steps=high)
    return ServoSpec(joint.id, joint.model, start, physics=physics)
