"""Weight and springs at the joints of a rig: torques, shares of stall, the pose of rest. Pure.

One model for emulated servos, examinations, parking and calibration; a world computes the same
from the same masses. Torques are in Nm and act on a joint in the direction of its angle. Torques of
joints that move together are shared by their two servos.
"""

from collections.abc import Mapping
from math import copysign, degrees, hypot, pi, sin
from typing import NamedTuple

import numpy as np

from gazerig.gaze.angles import rotate
from gazerig.gaze.types import Floats
from gazerig.robot.description.links import Description
from gazerig.robot.model.coupling_params import CouplingParams, coupled_pairs
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.kinematics import LOWER_NECK, NECK

GRAVITY_M_S2 = 9.81
NECK_JOINTS = (*LOWER_NECK, *NECK)
"""Joints that carry the head."""
GEAR_FRICTION = 0.03
"""Dry friction of a servo as a share of its stall torque, as in the emulated servos [A]."""
STRONG_SHARE = 1.0 / 3.0
"""Share of the stall torque above which a servo becomes hot while it holds."""
STALL_RISE_C, AMBIENT_C = 150.0, 30.0
"""Final warming of a stalled servo, and the air in a head, as in the emulated servos [A]."""
_CELLS = 64


class Weight(NamedTuple):
    """What a joint carries with all others at 0: its torque is nm * sin(angle - upright_rad).

    inertia_kg_m2: about the joint's axis
    """

    nm: float
    upright_rad: float
    inertia_kg_m2: float

    def torque_nm(self, angle_rad: float) -> float:
        """Return the torque at an angle."""
        return self.nm * sin(angle_rad - self.upright_rad)


class Statics:
    """Torques that the servos of a rig hold at rest.

    Args:
        description: of the rig, with its masses.
        joints: of the rig.
        couplings: of the rig.
    """

    def __init__(
        self,
        description: Description,
        joints: Mapping[str, JointParams],
        couplings: Mapping[str, CouplingParams],
    ) -> None:
        self._description, self._joints = description, joints
        self._pairs = coupled_pairs(couplings)

    def weight_nm(self, angles_rad: Mapping[str, float]) -> dict[str, float]:
        """Return the torque of the weight at each joint; joints left out are at 0."""
        return {name: torque for name, (torque, _) in self._about_axes(angles_rad).items()}

    def load_nm(self, angles_rad: Mapping[str, float]) -> dict[str, float]:
        """Return the torque of weight and spring at each joint; joints left out are at 0."""
        return {
            name: torque + spring_nm(self._joints[name], angles_rad.get(name, 0.0))
            for name, torque in self.weight_nm(angles_rad).items()
        }

    def weights(self) -> dict[str, Weight]:
        """Return the weight at each joint."""
        level = self._about_axes({})
        found = {}
        for name, (torque, inertia) in level.items():
            # About a fixed axis the torque is a sine of the angle.
            aside = self._about_axes({name: 0.5 * pi})[name][0]
            found[name] = Weight(hypot(torque, aside), float(np.arctan2(-torque, aside)), inertia)
        return found

    def stall_shares(self, angles_rad: Mapping[str, float]) -> dict[str, float]:
        """Return the torque that each servo holds in a pose as a share of its stall torque.

        It is signed as the joint's angle; a limit of its drive (torque_limit) reduces the stall
        torque.
        """
        loads = self.load_nm(angles_rad)
        shafts = dict(loads)
        for first, second, coupling in self._pairs:
            at = angles_rad.get(first, 0.0), angles_rad.get(second, 0.0)
            rates = np.array(coupling.rates(at))
            shares = np.linalg.solve(rates.T, (loads[first], loads[second]))
            shafts[first], shafts[second] = shares.tolist()
        found = {}
        for name, torque in shafts.items():
            joint = self._joints[name]
            turns = joint.made().steepest * 2.0 * pi / joint.facts.steps_per_turn
            stall = joint.facts.stall_torque_nm * (joint.torque_limit or 1.0)
            found[name] = torque / (turns * stall)
        return found

    def friction_nm(self, name: str) -> float:
        """Return the dry friction that holds a joint without torque."""
        joint = self._joints[name]
        turns = joint.made().steepest * 2.0 * pi / joint.facts.steps_per_turn
        return turns * GEAR_FRICTION * joint.facts.stall_torque_nm + joint.friction_nm

    def rest_pose(self, near_rad: Mapping[str, float]) -> dict[str, float]:
        """Return the pose of the neck that needs no torque, as near as possible to a pose.

        A joint without such an angle within its range rests on its mechanical stop: its angle is
        then that end of its range.
        """
        pose = dict(near_rad)
        necks = [name for name in NECK_JOINTS if name in self._joints]
        for name in (*necks, *necks):
            pose[name] = self._rest_rad(name, pose)
        return {name: pose[name] for name in necks}

    def _rest_rad(self, name: str, pose: Mapping[str, float]) -> float:
        """Return the angle at which one joint rests with the others in a pose."""
        limit = self._joints[name].limit()
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
        limit = self._joints[name].limit()
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

    def holding(self, angles_rad: Mapping[str, float]) -> dict[str, tuple[float, float]]:
        """Return torque and share of stall of the neck's servos in a pose."""
        loads, shares = self.load_nm(angles_rad), self.stall_shares(angles_rad)
        return {name: (loads[name], shares[name]) for name in NECK_JOINTS if name in loads}

    def _about_axes(self, angles_rad: Mapping[str, float]) -> dict[str, tuple[float, float]]:
        """Return torque of the weight and inertia about the axis of each joint of the rig."""
        description = self._description
        angles = description.angles(tuple(angles_rad), tuple(angles_rad.values()))
        poses = description.poses(angles)
        carried: dict[str, list[tuple[float, Floats, Floats]]] = {}
        parents = {link.name: link.parent for link in description.links}
        for link in description.links:
            if link.inertia is None:
                continue
            R, p = (np.array(part, float) for part in poses[link.name])
            com = R @ link.inertia.com_m + p
            tensor = R @ np.array(link.inertia.tensor_kg_m2) @ R.T
            at: str | None = link.name
            while at is not None:
                carried.setdefault(at, []).append((link.inertia.mass_kg, com, tensor))
                at = parents[at]
        found = dict.fromkeys(self._joints, (0.0, 0.0))
        for link in description.links:
            joint = link.joint
            if joint is None:
                continue
            follows = joint.follows
            name, ratio = (follows.joint, follows.ratio) if follows else (joint.name, 1.0)
            R_world, p_world = poses[link.name]
            axis: Floats = np.array(rotate(R_world, joint.axis), float)
            torque = inertia = 0.0
            for kg, com, tensor in carried.get(link.name, ()):
                off = com - np.array(p_world)
                across = np.cross(axis, off)
                torque -= kg * GRAVITY_M_S2 * float(across[2])
                inertia += kg * float(across @ across) + float(axis @ tensor @ axis)
            before = found[name]
            found[name] = before[0] + ratio * torque, before[1] + ratio * ratio * inertia
        return found


def spring_nm(joint: JointParams, angle_rad: float) -> float:
    """Return the torque of a joint's spring at an angle."""
    return -joint.spring_nm_deg * (degrees(angle_rad) - joint.spring_rest_deg)


def holding_c(share: float) -> float:
    """Return the final temperature of a servo that holds a share of its stall torque."""
    return AMBIENT_C + STALL_RISE_C * share * share
