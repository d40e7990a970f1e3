"""Weight and inertia at the joints of a rig, which its emulated servos carry."""

from collections.abc import Collection
from math import atan2, hypot, pi
from typing import NamedTuple

import numpy as np

from gazerig.gaze.angles import rotate
from gazerig.robot.description.links import Description, Inertia
from gazerig.robot.description.mass import in_parent_frame, join_inertias
from gazerig.robot.description.statics import moving_bodies
from gazerig.robot.model.weight import weight_nm


class Weight(NamedTuple):
    """Weight on a joint with all others at 0: its torque is nm * sin(angle - upright_rad).

    inertia_kg_m2: inertia about the joint's axis
    """

    nm: float
    upright_rad: float
    inertia_kg_m2: float


def joint_weights(description: Description, joints: Collection[str]) -> dict[str, Weight]:
    """Return the weight at each of some joints of a rig with all others at 0."""
    nodes, inertias = moving_bodies(description, joints), _inertias(description, joints)
    level, found = weight_nm(nodes, {}), {}
    for name in joints:
        # About a fixed axis the torque is a sine of the angle.
        torque = level.get(name, 0.0)
        aside = weight_nm(nodes, {name: 0.5 * pi}).get(name, 0.0)
        found[name] = Weight(hypot(torque, aside), atan2(-torque, aside), inertias[name])
    return found


def _inertias(description: Description, joints: Collection[str]) -> dict[str, float]:
    """Return the inertia about the axis of each joint of the rig with all joints at 0."""
    poses = description.poses(description.angles((), ()))
    parents = {link.name: link.parent for link in description.links}
    carried: dict[str, list[Inertia]] = {}
    for link in description.links:
        at: str | None = link.name if link.inertia is not None else None
        while at is not None and link.inertia is not None:
            R, p = poses[link.name]
            own = in_parent_frame(link.inertia, np.array(R), p)
            carried.setdefault(at, []).append(own)
            at = parents[at]
    found = dict.fromkeys(joints, 0.0)
    for link in description.links:
        if link.joint is not None and link.name in carried:
            R, p = poses[link.name]
            axis = np.array(rotate(R, link.joint.axis))
            own = join_inertias(carried[link.name])
            across = np.cross(axis, np.subtract(own.com_m, p))
            name = link.joint.follows or link.joint.name
            moment = own.mass_kg * float(across @ across)
            found[name] += moment + float(axis @ own.tensor_kg_m2 @ axis)
    return found
