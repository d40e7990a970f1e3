"""Weight at the joints of a rig: torques, and fractions of stall torque. Pure.

Emulated servos, examinations and the compensation of sag use this model; a world computes the same
from the same masses. Torques are in Nm and act on a joint in the direction of its angle. The two
servos of joints that move together share the torques.

A servo without an integral part holds a load only with a sufficiently large error, which follows
from the load and the servo's P gain. ``SagCompensation`` moves the goal by it in the opposite
direction.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from math import inf, radians

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


FASTEST_DEG_S = 3.0
"""Speed of a change of a goal, so that nothing jumps when torque is switched on or a gain changes.
"""
MOST_DEG = 4.0
"""Largest change of a goal, for any masses in the rig's file."""
_NEW_RAD = 0.002
"""Turn of a joint of the neck after which the torques are computed again."""


class SagCompensation:
    """Changes of the goals of the neck's servos.

    Args:
        statics: Statics of the neck.
        names: Names of the joints, in the order of the goals.
    """

    def __init__(self, statics: Statics, names: Sequence[str]) -> None:
        self._statics = statics
        self._joints = {name: i for i, name in enumerate(names) if name in statics.joints}
        self._at = dict.fromkeys(self._joints, inf)
        self._wanted: dict[str, float] = {}
        self._linkages = {name: statics.joints[name].make_linkage() for name in self._joints}
        self.restart()

    def restart(self) -> None:
        """Start with unchanged goals, because torque has just been switched on."""
        self._now = dict.fromkeys(self._joints, 0.0)
        self._last_s: float | None = None

    def offsets(self, command_rad: Sequence[float], t_s: float) -> Iterable[tuple[int, float]]:
        """Return the change of goals in steps, by the number of the joint.

        Args:
            command_rad: Desired joint angles.
            t_s: Time of the last reading.
        """
        if any(abs(command_rad[i] - self._at[name]) > _NEW_RAD for name, i in self._joints.items()):
            self._at = {name: command_rad[i] for name, i in self._joints.items()}
            self._wanted = self._wanted_steps()
        since_s = 0.0 if self._last_s is None else max(0.0, t_s - self._last_s)
        self._last_s = t_s
        for name, wanted in self._wanted.items():
            room = radians(FASTEST_DEG_S) * since_s * self._linkages[name].steepest
            now = self._now[name]
            self._now[name] = min(max(wanted, now - room), now + room)
        return [(i, self._now[name]) for name, i in self._joints.items()]

    def _wanted_steps(self) -> dict[str, float]:
        shares, wanted = self._statics.drive_shares(self._at), dict.fromkeys(self._joints, 0.0)
        for name, linkage in self._linkages.items():
            joint = self._statics.joints[name]
            if stiffness := joint.model_facts.stiffness(joint.gains):
                most = linkage.steepest * radians(MOST_DEG)
                steps = min(max(-shares[name] / stiffness, -most), most)
                wanted[name] = steps if linkage.rising else -steps
        return wanted


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
