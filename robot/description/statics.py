"""Weight at the joints of a rig: torques, fractions of stall torque, rest pose. Pure.

Emulated servos, examinations, parking and calibration use this model; a world computes the same
from the same masses. Torques are in Nm and act on a joint in the direction of its angle. The two
servos of joints that move together share the torques.
"""

from collections.abc import Collection, Mapping, Sequence
from math import atan2, copysign, hypot, pi
from typing import NamedTuple

import numpy as np

from gazerig.gaze.angles import add, compose, rotate, scale
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.description.links import (
    IDENTITY,
    ORIGIN,
    Description,
    Inertia,
    LinkageFollower,
)
from gazerig.robot.description.mass import in_parent_frame, join_inertias
from gazerig.robot.model.assumed_servo import GEAR_FRICTION
from gazerig.robot.model.coupling import CouplingParams
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.kinematics import LOWER_NECK, NECK
from gazerig.robot.model.weight import MovingBody, weight_nm

NECK_JOINTS = (*LOWER_NECK, *NECK)
"""Joints that carry the head."""
STRONG_SHARE = 1.0 / 3.0
"""Fraction of the stall torque above which a servo becomes hot while it holds."""
_CELLS = 64


class Weight(NamedTuple):
    """Weight on a joint with all others at 0: its torque is nm * sin(angle - upright_rad).

    inertia_kg_m2: inertia about the joint's axis
    """

    nm: float
    upright_rad: float
    inertia_kg_m2: float


class Statics:
    """Torques that servos hold at rest.

    Args:
        bodies: bodies that the joints move.
        joints: the joints considered.
        pairs: their coupled pairs.
    """

    def __init__(
        self,
        bodies: Sequence[MovingBody],
        joints: Mapping[str, JointParams],
        pairs: Collection[CouplingParams],
    ) -> None:
        self.joints = joints
        self._bodies, self._pairs = tuple(bodies), tuple(pairs)
        self._stall_nm = {
            name: one.model_facts.stall_torque_nm * _shaft_turns(one)
            for name, one in joints.items()
        }

    def load_nm(self, angles_rad: Mapping[str, float]) -> dict[str, float]:
        """Return the torque of the weight at each joint; omitted joints are at 0."""
        weight = weight_nm(self._bodies, angles_rad)
        return {name: weight.get(name, 0.0) for name in self.joints}

    def stall_shares(self, angles_rad: Mapping[str, float]) -> dict[str, float]:
        """Return the torque that each servo holds in a pose as a fraction of its stall torque.

        Its sign follows the joint's angle; a limit of the drive (torque_limit) reduces the stall
        torque.
        """
        limits = {name: joint.torque_limit or 1.0 for name, joint in self.joints.items()}
        return {name: one / limits[name] for name, one in self.drive_shares(angles_rad).items()}

    def drive_shares(self, angles_rad: Mapping[str, float]) -> dict[str, float]:
        """Return the torques as fractions of the full drive, at the rated voltage."""
        loads = self.load_nm(angles_rad)
        shafts = dict(loads)
        for pair in self._pairs:
            both, against = (
                loads[pair.first] / pair.first_ratio,
                loads[pair.second] / pair.second_ratio,
            )
            shafts[pair.first], shafts[pair.second] = 0.5 * (both + against), 0.5 * (both - against)
        return {name: torque / self._stall_nm[name] for name, torque in shafts.items()}

    def friction_nm(self, name: str) -> float:
        """Return the dry friction that holds a joint without torque."""
        return GEAR_FRICTION * self._stall_nm[name]

    def rest_pose(self, near_rad: Mapping[str, float]) -> dict[str, float]:
        """Return the pose of the neck that needs no torque, as near as possible to a given pose.

        A joint without such an angle within its range rests on its mechanical stop, and its angle
        is that end of its range.
        """
        pose = dict(near_rad)
        necks = [name for name in NECK_JOINTS if name in self.joints]
        for name in (*necks, *necks):
            pose[name] = self._rest_rad(name, pose)
        return {name: pose[name] for name in necks}

    def _rest_rad(self, name: str, pose: Mapping[str, float]) -> float:
        """Return the angle at which one joint rests with the others in a pose."""
        limit = self.joints[name].limit()
        near = min(max(pose.get(name, 0.0), limit.low_rad), limit.high_rad)

        def torque(angle: float) -> float:
            return self.load_nm({**pose, name: angle})[name]

        if abs(torque(near)) < 1e-4:
            return near
        span = limit.high_rad - limit.low_rad
        angles = [limit.low_rad + span * k / _CELLS for k in range(_CELLS + 1)]
        torques = [torque(angle) for angle in angles]
        zeros = [
            a + (b - a) * ta / (ta - tb)
            for a, b, ta, tb in zip(angles, angles[1:], torques, torques[1:], strict=False)
            if ta * tb < 0.0
        ]
        if zeros:
            return min(zeros, key=lambda angle: abs(angle - near))
        return limit.high_rad if torques[-1] > 0.0 else limit.low_rad

    def limp_rad(self, name: str, pose_rad: Mapping[str, float]) -> float:
        """Return the angle at which a joint comes to rest when its servo has no torque."""
        limit = self.joints[name].limit()
        at = pose_rad.get(name, 0.0)
        torque = self.load_nm(pose_rad)[name]
        if abs(torque) <= self.friction_nm(name):
            return at
        step = copysign((limit.high_rad - limit.low_rad) / _CELLS, torque)
        while limit.low_rad < at + step < limit.high_rad:
            at += step
            if self.load_nm({**pose_rad, name: at})[name] * torque <= 0.0:
                return at
        return limit.high_rad if torque > 0.0 else limit.low_rad


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
            own = in_parent_frame(link.inertia, *poses[link.name])
            carried.setdefault(at, []).append(own)
            at = parents[at]
    found = dict.fromkeys(joints, 0.0)
    for link in description.links:
        if link.joint is not None and link.name in carried:
            R, p = poses[link.name]
            axis = np.array(rotate(R, link.joint.axis))
            own = join_inertias(carried[link.name])
            across = np.cross(axis, np.subtract(own.com_m, p))
            name, ratio = link.joint.follows or LinkageFollower(link.joint.name)
            moment = own.mass_kg * float(across @ across)
            found[name] += ratio**2 * (moment + float(axis @ own.tensor_kg_m2 @ axis))
    return found


def _shaft_turns(joint: JointParams) -> float:
    """Return the highest number of shaft turns per turn of the joint."""
    return joint.make_linkage().steepest * 2.0 * pi / joint.model_facts.steps_per_turn


def moving_bodies(description: Description, moving: Collection[str]) -> tuple[MovingBody, ...]:
    """Merge the links of a description into few bodies; joints that do not move are at 0."""
    nodes = [MovingBody("", 0.0, ORIGIN, -1, IDENTITY, ORIGIN)]
    at: dict[str, tuple[int, Mat3, Vec3]] = {}
    for link in description.links:
        number, R, p = (0, IDENTITY, ORIGIN) if link.parent is None else at[link.parent]
        R, p = compose(R, link.R), add(p, rotate(R, link.p_m))
        if link.joint is not None:
            name, ratio = link.joint.follows or LinkageFollower(link.joint.name)
            if name in moving:
                nodes.append(MovingBody(name, ratio, link.joint.axis, number, R, p))
                number, R, p = len(nodes) - 1, IDENTITY, ORIGIN
        at[link.name] = number, R, p
        if link.inertia is not None:
            kg, node = link.inertia.mass_kg, nodes[number]
            moment = scale(add(p, rotate(R, link.inertia.com_m)), kg)
            nodes[number] = node._replace(
                mass_kg=node.mass_kg + kg, moment_kg_m=add(node.moment_kg_m, moment)
            )
    return tuple(nodes)
