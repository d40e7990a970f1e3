"""Description of a rig from its YAML, and the weight on its neck."""

from collections.abc import Iterator
from itertools import product
from math import degrees

import numpy as np

from gazerig.config.rig import Rig
from gazerig.robot.description.build import RigShape, describe
from gazerig.robot.description.links import Description
from gazerig.robot.description.statics import STRONG_SHARE, SagCompensation, Statics, moving_bodies
from gazerig.robot.model.kinematics import NECK
from gazerig.robot.model.types import order_joints
from gazerig.robot.model.weight import GEAR_FRICTION
from gazerig.robot.run.rig_limits import lid_ends, park_rad


def description_of(rig: Rig) -> Description:
    """Return the links, joints, shapes and looks of a rig."""
    return describe(shape_of(rig))


def shape_of(rig: Rig) -> RigShape:
    """Return the shape from which a rig's description is built."""
    return RigShape(
        rig.name,
        rig.geometry,
        rig.joints,
        lid_ends(rig),
        rig.camera,
        rig.mass,
    )


# --- the weight on the servos of its neck


def statics_of(rig: Rig) -> Statics:
    """Return the torques that the servos of a rig's neck hold at rest, all other joints at 0."""
    joints = {name: joint for name, joint in rig.joints.items() if name in NECK}
    pairs = [pair for pair in rig.couplings.values() if {*pair.joints} <= {*joints}]
    return Statics(moving_bodies(description_of(rig), joints), joints, pairs)


def sag_compensation(rig: Rig) -> SagCompensation | None:
    """Return what makes up for the sag of a rig's neck; None without a neck."""
    if rig.joints.keys().isdisjoint(NECK):
        return None
    return SagCompensation(statics_of(rig), order_joints(rig.joints))


_POSES = 9
"""Number of angles per joint of the neck at which its load is computed."""
_SMALLEST = 0.01
"""A smaller share of the stall torque is not reported."""


def neck_loads(rig: Rig) -> Iterator[tuple[str, str, str]]:
    """Return the load of each servo of a neck: its joint, a text, and a remedy if it needs one."""
    statics, park = statics_of(rig), park_rad(rig)
    ranges = {
        name: joint.limit() for name, joint in statics.joints.items() if "neck_yaw" not in name
    }
    angles = [np.linspace(one.low_rad, one.high_rad, _POSES).tolist() for one in ranges.values()]
    poses = [dict(zip(ranges, pose, strict=True)) for pose in product(*angles)]
    loads = [(pose, statics.drive_shares(pose)) for pose in poses]
    at_park = statics.drive_shares(park)
    for name, joint in statics.joints.items():
        pose, shares = max(loads, key=lambda one: abs(one[1][name]))
        share = abs(shares[name]) / (joint.torque_limit or 1.0)
        if share < _SMALLEST:
            continue
        where = ", ".join(f"{other} {degrees(angle):.0f}" for other, angle in pose.items())
        text = f"holds at most {share:.0%} of its stall torque, at {where} deg"
        yield name, text, _HOT if share > STRONG_SHARE else ""
        if abs(at_park[name]) > GEAR_FRICTION:
            yield name, "sinks from its park_deg when its torque goes off", _SINKS


_HOT = (
    "above one third it gets hot: balance the head with mass.counterweights, or use a stronger "
    "servo"
)
_SINKS = "balance the head with mass.counterweights, or set a park_deg where it rests"
