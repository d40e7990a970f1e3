"""Weight at the joints of a rig: torques, and fractions of stall torque. Pure.

Emulated servos, examinations and the compensation of sag use this model; a world computes the same
from the same masses. Torques are in Nm and act on a joint in the direction of its angle. The two
servos of joints that move together share the torques.
"""

from collections.abc import Collection, Mapping, Sequence

from gazerig.gaze.angles import add, compose, rotate, scale
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.description.links import (
    IDENTITY,
    ORIGIN,
    Description,
)
from gazerig.robot.model.coupling import CouplingParams
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.weight import MovingBody, weight_nm

STRONG_SHARE = 1.0 / 3.0
"""Fraction of the stall torque above which a servo becomes hot while it holds."""


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

    def drive_shares(self, angles_rad: Mapping[str, float]) -> dict[str, float]:
        """Return the torque that each servo holds as a fraction of its stall torque at full drive.

        Its sign follows the joint's angle.
        """
        loads = self.load_nm(angles_rad)
        shafts = dict(loads)
        for pair in self._pairs:
            both, against = (
                loads[pair.first] / pair.first_ratio,
                loads[pair.second] / pair.second_ratio,
            )
            shafts[pair.first], shafts[pair.second] = 0.5 * (both + against), 0.5 * (both - against)
        return {name: torque / self._stall_nm[name] for name, torque in shafts.items()}


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
