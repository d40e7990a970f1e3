"""Description of a rig from its YAML, and the weight on its neck."""

from collections.abc import Iterator, Mapping
from itertools import product
from math import degrees, radians
from typing import Literal, NamedTuple

from gazerig.config.rig import Rig
from gazerig.robot.description.build import RigShape, describe
from gazerig.robot.description.links import Description
from gazerig.robot.description.statics import (
    STRONG_SHARE,
    Statics,
    moving_bodies,
)
from gazerig.robot.loop.sag import SagCompensation
from gazerig.robot.model.kinematics import NECK
from gazerig.robot.model.types import JointAngles, order_joints
from gazerig.robot.model.weight import AMBIENT_C, STALL_RISE_C, MassParams
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
        rig.couplings,
        rig.camera,
        rig.mass,
        (rig.webcam.width_px, rig.webcam.height_px),
    )


# --- the weight on its servos


def statics_of(rig: Rig, *, of_neck: bool = False) -> Statics:
    """Return the torques that a rig's servos hold at rest.

    Args:
        rig: the rig.
        of_neck: only for the joints of the neck, with all others at 0, which is faster.
    """
    joints = {n: joint for n, joint in rig.joints.items() if not of_neck or n in NECK}
    pairs = [pair for pair in rig.couplings.values() if {*pair.joints} <= {*joints}]
    return Statics(moving_bodies(description_of(rig), joints), joints, pairs)


def sag_compensation(rig: Rig) -> SagCompensation | None:
    """Return what makes up for the sag of a rig's neck; None without a neck."""
    if rig.joints.keys().isdisjoint(NECK):
        return None
    return SagCompensation(statics_of(rig, of_neck=True), order_joints(rig.joints))


_STAYS_DEG = 1.0


def rest_park_deg(rig: Rig) -> dict[str, float]:
    """Return the rig's pose for parking; a head that would sink there is parked at its rest pose.

    Only masses in the rig's file change it, because masses from shapes are estimates.
    """
    park = dict(rig.park_deg)
    if rig.mass == MassParams() or rig.joints.keys().isdisjoint(NECK):
        return park
    statics = statics_of(rig, of_neck=True)
    pose = {name: radians(park.get(name, 0.0)) for name in statics.joints}
    rest = statics.rest_pose(pose)
    for name, at in pose.items():
        if abs(degrees(statics.limp_rad(name, pose) - at)) > _STAYS_DEG:
            park[name] = degrees(rest[name])
    return park


def rest_park_pose(rig: Rig) -> JointAngles:
    """Return that pose in radians, in the order of the joints."""
    park = rest_park_deg(rig)
    return tuple(radians(park.get(name, 0.0)) for name in rig.names)


def park_notes(rig: Rig) -> tuple[str, ...]:
    """Return a message if the head is parked in another pose than that of its file."""
    park = rest_park_deg(rig)
    moved = [name for name in park if park[name] != rig.park_deg.get(name, 0.0)]
    if not moved:
        return ()
    where = ", ".join(f"{name} at {park[name]:.0f} deg" for name in moved)
    return (f"parks {where}, where the head needs no torque: at its park_deg it would sink",)


class WeightFinding(NamedTuple):
    """One finding about a neck's load; ``cure``: remedy, "" if none is needed."""

    level: Literal["ok", "note", "warn"]
    joint: str
    what: str
    cure: str = ""

    def __str__(self) -> str:
        """Return it as one line."""
        return f"{self.joint}: {self.what}{f'; {self.cure}' if self.cure else ''}"


_POSES = 9
"""Number of angles per joint of the neck at which its load is computed."""
_SMALLEST = 0.01
"""A smaller share of the stall torque is not reported."""


def weight_findings(rig: Rig) -> Iterator[WeightFinding]:
    """Return findings about the load of a neck at rest, its heat, and its motion when parked."""
    if rig.joints.keys().isdisjoint(NECK):
        return
    statics = statics_of(rig, of_neck=True)
    level = statics.stall_shares({})
    for name, (share, pose_rad) in _worst_loads(statics).items():
        if share < _SMALLEST:
            continue
        pose = ", ".join(f"{joint} {degrees(angle):.0f}" for joint, angle in pose_rad.items())
        held = [_load_text(rig, name, part) for part in (abs(level[name]), share)]
        long_run_c = AMBIENT_C + STALL_RISE_C * share * share
        what = (
            f"holds the head level with {held[0]}, at most with {held[1]}, at {pose} deg: "
            f"{long_run_c:.0f} degC in the long run"
        )
        if share > STRONG_SHARE:
            cure = (
                "above one third it gets hot: balance the head with mass.counterweights, or use a "
                "stronger servo"
            )
            yield WeightFinding("warn", name, what, cure)
        else:
            yield WeightFinding("note", name, what)
    park = {name: angle for name, angle in park_rad(rig).items() if name in statics.joints}
    rest = statics.rest_pose(park)
    for name in statics.joints:
        at, falls = degrees(park.get(name, 0.0)), degrees(statics.limp_rad(name, park))
        if abs(falls - at) > _STAYS_DEG:
            yield WeightFinding(
                "warn",
                name,
                f"parked at {at:.0f} deg it sinks to {falls:.0f} deg when torque is switched off",
                f"set park_deg.{name} to {degrees(rest[name]):.0f}, where it needs no torque",
            )
        elif name == "neck_pitch":
            yield WeightFinding("ok", name, f"parked at {at:.0f} deg it needs no torque")


def _worst_loads(statics: Statics) -> Mapping[str, tuple[float, Mapping[str, float]]]:
    """Return the largest share of the stall torque of each servo, and its pose."""
    limits = {
        name: joint.limit()
        for name, joint in statics.joints.items()
        if not name.endswith("neck_yaw")
    }
    spans = [
        [one.low_rad + (one.high_rad - one.low_rad) * k / (_POSES - 1) for k in range(_POSES)]
        for one in limits.values()
    ]
    worst: dict[str, tuple[float, Mapping[str, float]]] = {}
    for angles in product(*spans):
        pose = dict(zip(limits, angles, strict=True))
        for name, share in statics.stall_shares(pose).items():
            if name not in worst or abs(share) > worst[name][0] + 1e-9:
                worst[name] = abs(share), pose
    return worst


def _load_text(rig: Rig, name: str, share: float) -> str:
    """Return a load as a share of the stall torque, with the current if that is known."""
    stall_a = rig.joints[name].model_facts.stall_current_a
    amps = f" ({share * stall_a:.2f} A)" if stall_a else ""
    return f"{share:.0%} of its stall torque{amps}"
