"""Loads of a rig's neck: for ``gazerig check``, ``gazerig doctor`` and the documents."""

from collections.abc import Iterator, Mapping
from itertools import product
from math import degrees, radians
from typing import Literal, NamedTuple

from gazerig.config.rig import Rig
from gazerig.robot.description.statics import NECK_JOINTS, STRONG_SHARE, Statics
from gazerig.robot.model.types import JointAngles
from gazerig.robot.model.weight import AMBIENT_C, STALL_RISE_C, MassParams
from gazerig.robot.run.rig_description import statics_of
from gazerig.robot.run.rig_limits import park_rad

_SMALLEST = 0.01
"""A smaller share of the stall torque is not reported."""
_POSES = 9
"""Number of angles per joint of the neck at which its load is computed."""
_STAYS_DEG = 1.0

_LIGHTEN = "balance the head with mass.counterweights, or use a stronger servo"


class WeightFinding(NamedTuple):
    """One finding about a neck's load.

    joint: its joint; cure: remedy, "" if none is needed
    """

    level: Literal["ok", "note", "warn"]
    joint: str
    what: str
    cure: str = ""

    def __str__(self) -> str:
        """Return it as one line."""
        return f"{self.joint}: {self.what}{f'; {self.cure}' if self.cure else ''}"


class Holding(NamedTuple):
    """Load of a servo of the neck in one pose.

    share: share of its stall torque; current_a: None if its stall current is unknown
    """

    pose_rad: dict[str, float]
    share: float
    current_a: float | None

    @property
    def temperature_c(self) -> float:
        """Return the temperature of the servo after half an hour in this pose."""
        return AMBIENT_C + STALL_RISE_C * self.share * self.share

    def text(self) -> str:
        """Return share and current."""
        amps = "" if self.current_a is None else f" ({self.current_a:.2f} A)"
        return f"{self.share:.0%} of its stall torque{amps}"


def holdings(rig: Rig, statics: Statics, pose_rad: Mapping[str, float]) -> dict[str, Holding]:
    """Return the loads of the neck's servos in a pose."""
    shares = statics.stall_shares(pose_rad)
    found = {}
    for name in shares:
        stall_a = rig.joints[name].model_facts.stall_current_a
        share = abs(shares[name])
        found[name] = Holding(dict(pose_rad), share, share * stall_a if stall_a else None)
    return found


def worst_holdings(rig: Rig, statics: Statics) -> dict[str, Holding]:
    """Return the highest load of each servo of the neck within the joints' limits."""
    spans = {
        name: [
            limit.low_rad + (limit.high_rad - limit.low_rad) * k / (_POSES - 1)
            for k in range(_POSES)
        ]
        for name, limit in ((name, joint.limit()) for name, joint in statics.joints.items())
        if not name.endswith("neck_yaw")
    }
    found: dict[str, Holding] = {}
    for angles in product(*spans.values()):
        for name, one in holdings(rig, statics, dict(zip(spans, angles, strict=True))).items():
            if name not in found or one.share > found[name].share + 1e-9:
                found[name] = one
    return found


def weight_findings(rig: Rig) -> Iterator[WeightFinding]:
    """Return findings about the load of a neck at rest, its heat, and its motion when parked."""
    if not any(name in rig.joints for name in NECK_JOINTS):
        return
    statics = statics_of(rig, of_neck=True)
    level = holdings(rig, statics, {})
    for name, worst in worst_holdings(rig, statics).items():
        if worst.share < _SMALLEST:
            continue
        pose = ", ".join(f"{n} {degrees(a):.0f}" for n, a in worst.pose_rad.items())
        what = (
            f"holds the head level with {level[name].text()}, at most with {worst.text()}, at "
            f"{pose} deg: {worst.temperature_c:.0f} degC in the long run"
        )
        strong = worst.share > STRONG_SHARE
        cure = f"above one third it gets hot: {_LIGHTEN}" if strong else ""
        yield WeightFinding("warn" if strong else "note", name, what, cure)
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


def rest_park_deg(rig: Rig) -> dict[str, float]:
    """Return the rig's pose for parking; a head that would sink there is parked at its rest pose.

    Only masses in the rig's file change it, because masses from shapes are estimates.
    """
    park = dict(rig.park_deg)
    if rig.mass == MassParams() or not rig.joints.keys() & set(NECK_JOINTS):
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


def park_note(rig: Rig) -> str | None:
    """Return a message if the head is parked in another pose than that of its file."""
    park = rest_park_deg(rig)
    moved = [name for name in park if park[name] != rig.park_deg.get(name, 0.0)]
    if not moved:
        return None
    where = ", ".join(f"{name} at {park[name]:.0f} deg" for name in moved)
    return f"parks {where}, where the head needs no torque: at its park_deg it would sink"
