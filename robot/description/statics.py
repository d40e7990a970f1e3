"""Weight at the joints of a rig: torques, fractions of stall torque, rest pose. Pure.

Emulated servos, examinations, parking and calibration use this model; a world computes the same
from the same masses. Torques are in Nm and act on a joint in the direction of its angle. The two
servos of joints that move together share the torques.
"""

from collections.abc import Collection, Mapping, Sequence
from math import copysign

from gazerig.gaze.angles import add, compose, rotate, scale
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.description.links import (
    IDENTITY,
    ORIGIN,
    Description,
)
from gazerig.robot.model.coupling import CouplingParams
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.kinematics import NECK
from gazerig.robot.model.weight import GEAR_FRICTION, MovingBody, weight_nm

STRONG_SHARE = 1.0 / 3.0
"""Fraction of the stall torque above which a servo becomes hot while it holds."""
_CELLS = 64


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
            name: one.model_facts.stall_torque_nm * one.shaft_turns()
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
        return {
            name: share / (self.joints[name].torque_limit or 1.0)
            for name, share in self.drive_shares(angles_rad).items()
        }

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

    def rest_pose(self, near_rad: Mapping[str, float]) -> dict[str, float]:
        """Return the pose of the neck that needs no torque, as near as possible to a given pose.

        A joint without such an angle within its range rests on its mechanical stop, and its angle
        is that end of its range.
        """
        pose = dict(near_rad)
        necks = [name for name in NECK if name in self.joints]
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
        step = (limit.high_rad - limit.low_rad) / _CELLS
        angles = [limit.low_rad + step * k for k in range(_CELLS + 1)]
        torques = [torque(angle) for angle in angles]
        zeros = [
            a + step * ta / (ta - tb)
            for a, ta, tb in zip(angles, torques, torques[1:], strict=False)
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
        if abs(torque) <= GEAR_FRICTION * self._stall_nm[name]:
            return at
        step = copysign((limit.high_rad - limit.low_rad) / _CELLS, torque)
        while limit.low_rad < at + step < limit.high_rad:
            at += step
            if self.load_nm({**pose_rad, name: at})[name] * torque <= 0.0:
                return at
        return limit.high_rad if torque > 0.0 else limit.low_rad


def moving_bodies(description: Description, moving: Collection[str]) -> tuple[MovingBody, ...]:
    """Merge the links of a description into few bodies; joints that do not move are at 0."""
    nodes = [MovingBody("", ORIGIN, -1, IDENTITY, ORIGIN)]
    at: dict[str, tuple[int, Mat3, Vec3]] = {}
    for link in description.links:
        number, R, p = (0, IDENTITY, ORIGIN) if link.parent is None else at[link.parent]
        R, p = compose(R, link.R), add(p, rotate(R, link.p_m))
        if link.joint is not None:
            name = link.joint.follows or link.joint.name
            if name in moving:
                nodes.append(MovingBody(name, link.joint.axis, number, R, p))
                number, R, p = len(nodes) - 1, IDENTITY, ORIGIN
        at[link.name] = number, R, p
        if link.inertia is not None:
            kg, node = link.inertia.mass_kg, nodes[number]
            moment = scale(add(p, rotate(R, link.inertia.com_m)), kg)
            nodes[number] = node._replace(
                mass_kg=node.mass_kg + kg, moment_kg_m=add(node.moment_kg_m, moment)
            )
    return tuple(nodes)
