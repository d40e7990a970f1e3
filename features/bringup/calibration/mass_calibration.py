"""Mass and balance of a head from the loads of its neck's servos, moved slowly up and down.

At a low constant speed a servo carries the weight and overcomes its friction, whose sign changes
with the direction; a fit over both directions separates them. Joints through one point give the
mass times its distance, in three directions; only a lower neck also gives the mass.
"""

from collections.abc import Mapping, Sequence
from math import radians
from typing import Any, NamedTuple

import numpy as np

from gazerig.features.bringup.calibration.joint_calibration import CalibrationRefused
from gazerig.features.bringup.calibration.smart_servo_access import CalibrationStopped
from gazerig.features.bringup.manual_control import ManualControl, Step
from gazerig.gaze.types import Vec3
from gazerig.robot.description.links import Description
from gazerig.robot.description.statics import Statics, moving_bodies, spring_nm
from gazerig.robot.model.kinematics import NECK
from gazerig.robot.model.weight import ORIGIN, weight_nm

SWEPT = ("lower_neck_pitch", "neck_pitch", "neck_roll")
"""Joints whose loads depend on the weight."""
WIDEST_DEG, END_DEG = 30.0, 2.0
"""Largest sweep to either side, and distance from the ends of the range."""
_STEADY_RAD_S = radians(2.0)
"""Slower samples are omitted, because their friction may have any value."""
_EVERY, _FEWEST = 4, 20
"""Steps per sample, and samples of each joint in each direction."""
_UNKNOWNS: tuple[dict[str, Any], ...] = (
    {"moment_kg_m": (1.0, 0.0, 0.0)},
    {"moment_kg_m": (0.0, 1.0, 0.0)},
    {"moment_kg_m": (0.0, 0.0, 1.0)},
    {"mass_kg": 1.0},
)
"""Heads of 1 kg m ahead, left and above of the pitch axis, and of 1 kg on it."""


class LoadSample(NamedTuple):
    """A pose of the neck and the load of a moving joint: torque in Nm, and the direction."""

    joint: str
    pose_rad: Mapping[str, float]
    torque_nm: float
    direction: float


class HeadBalance(NamedTuple):
    """Balance of a head, estimated from loads.

    moment_kg_m: mass of the head times its centre from the pitch axis, with counterweights
    mass_kg: mass of the head, None if it cannot be determined
    friction_nm: friction by joint
    rest_nm: root mean square residual of the fit
    """

    moment_kg_m: Vec3
    mass_kg: float | None
    friction_nm: dict[str, float]
    rest_nm: float


class LoadRecorder:
    """Collects loads while the joints of a neck move; observes every step."""

    def __init__(self, statics: Statics) -> None:
        self.samples: list[LoadSample] = []
        self.joint = ""
        self._statics = statics
        self._steps = 0

    def watch(self, step: Step) -> None:
        """Store the load of the joint that moves now."""
        names, joints = step.guard_result.joints, step.joints
        if not self.joint or not joints.load:
            return
        self._steps += 1
        if self._steps % _EVERY:
            return
        at = names.index(self.joint)
        speed = joints.velocity_rad_s[at]
        if abs(speed) < _STEADY_RAD_S or self.joint in joints.missing:
            return
        pose = {n: joints.position_rad[names.index(n)] for n in self._statics.joints}
        torque = self._statics.torque_nm(self.joint, joints.load[at])
        self.samples.append(LoadSample(self.joint, pose, torque, 1.0 if speed > 0.0 else -1.0))


def sweep(control: ManualControl, statics: Statics, recorder: LoadRecorder) -> None:
    """Move each joint of the neck that carries weight down and up, the others at 0.

    Raises:
        CalibrationStopped: the user or the system requested the end.
        CalibrationRefused: the guard or the bus stopped a movement.
        DriverError: the bus has disappeared.
    """
    _move(control, dict.fromkeys(statics.joints, 0.0))
    for name in (name for name in SWEPT if name in statics.joints):
        joint = statics.joints[name]
        low = max(joint.min_deg + END_DEG, -WIDEST_DEG)
        high = min(joint.max_deg - END_DEG, WIDEST_DEG)
        _move(control, {name: low})
        recorder.joint = name
        for end in (high, low):
            _move(control, {name: end})
        recorder.joint = ""
        _move(control, {name: 0.0})


def _move(control: ManualControl, pose_deg: Mapping[str, float]) -> None:
    moved = control.pose(pose_deg)
    # Under its weight a joint may stop short of its goal.
    if moved.end_reason in ("held back", "torque_off"):
        raise CalibrationRefused(f"{moved}: nothing was measured")
    if moved.end_reason not in ("arrived", "not there in time"):
        raise CalibrationStopped(moved.end_reason)


def fit_balance(
    samples: Sequence[LoadSample], statics: Statics, description: Description
) -> HeadBalance:
    """Return the balance that fits the loads best.

    Args:
        samples: samples of sweeps in both directions.
        statics: statics of the neck, with its known springs.
        description: description of the rig.

    Raises:
        CalibrationRefused: too few samples, or a joint moved in one direction only.
    """
    swept = tuple(name for name in SWEPT if any(one.joint == name for one in samples))
    for name in swept or ("neck_pitch",):
        for way in (-1.0, 1.0):
            found = sum(one.joint == name and one.direction == way for one in samples)
            if found < _FEWEST:
                raise CalibrationRefused(
                    f"{name}: only {found} loads while it moved {'up' if way > 0 else 'down'}, "
                    f"{_FEWEST} are needed: let it move farther (min_deg, max_deg)"
                )
    has_mass = "lower_neck_pitch" in swept
    # The last joint of the neck moves the head; its other joints have no mass here.
    necks = [
        one._replace(mass_kg=0.0, moment_kg_m=ORIGIN)
        for one in moving_bodies(description, statics.joints)
    ]
    heads = _UNKNOWNS[: 4 if has_mass else 3]
    rows, torques = [], []
    for one in samples:
        # The servo holds against the weight.
        basis = [
            -weight_nm([*necks[:-1], necks[-1]._replace(**head)], one.pose_rad)[one.joint]
            for head in heads
        ]
        friction = [one.direction * (one.joint == name) for name in swept]
        rows.append([*basis, *friction])
        # The servo holds weight and spring, and overcomes the friction.
        spring = spring_nm(statics.joints[one.joint], one.pose_rad[one.joint])
        torques.append(one.torque_nm + spring)
    matrix, wanted = np.array(rows), np.array(torques)
    solution, *_ = np.linalg.lstsq(matrix, wanted, rcond=None)
    x, y, z = solution[:3].tolist()
    friction_nm = dict(zip(swept, solution[-len(swept) :].tolist(), strict=True))
    rest = float(np.sqrt(np.mean((matrix @ solution - wanted) ** 2)))
    mass_kg = float(solution[3]) - _neck_kg(description) if has_mass else None
    return HeadBalance((x, y, z), mass_kg, friction_nm, rest)


def _neck_kg(description: Description) -> float:
    """Return the mass of the links on the pitch axis, which a lower neck carries with the head."""
    necks = (one for one in description.links if one.joint and one.joint.name in NECK)
    return sum(one.inertia.mass_kg for one in necks if one.inertia is not None)
