"""Coupling of two servos that together move two joints: a differential of bevel gears.

The joints are called first and second, the servos a and b. All angles are in rad; those of the
servos are at their shafts, after sign, ratio and zero. The usual pair is a neck's pitch and roll.

A joint a little outside its range, such as a head that sags, moves inside slowly. One that is far
outside is more likely not where its servo reports it, and must get no torque.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from itertools import product
from math import ceil, degrees, floor, radians
from typing import Annotated

from gazerig.drivers.bus.goal_limits import ENTRY_DEG_S, FAR_CAUSES, FAR_DEG
from gazerig.drivers.types import ServoConfig
from gazerig.params import Bounds
from gazerig.robot.model.joint import JointLimit, JointParams
from gazerig.robot.model.types import order_joints

Pair = tuple[float, float]


@dataclass(frozen=True)
class CouplingParams:
    """Bevel gears: the servos' sum turns the first joint, their difference the second."""

    # fmt: off
    first: Annotated[str, "joint that both servos turn in the same direction, such as neck_pitch; its entry in joints is servo a"]
    second: Annotated[str, "joint that they turn in opposite directions, such as neck_roll; its entry is servo b"]
    first_ratio: Annotated[float, Bounds(0.05, 50), "turns of the servos for one turn of the first joint"] = 1.0
    second_ratio: Annotated[float, Bounds(0.05, 50), "turns of the servos, in opposite directions, for one turn of the second joint"] = 1.0
    # fmt: on

    def __post_init__(self) -> None:
        """Check that these are two joints.

        Raises:
            ValueError: They are one.
        """
        if self.first == self.second:
            raise ValueError(f"first and second are both {self.first}; give two different joints")

    @property
    def joints(self) -> tuple[str, str]:
        """Return the names of both joints."""
        return self.first, self.second

    @property
    def rates(self) -> tuple[Pair, Pair]:
        """Return the rotation of servo a and of servo b per rad of the first and second joint."""
        return (self.first_ratio, self.second_ratio), (self.first_ratio, -self.second_ratio)

    def servo_rad(self, joints: Pair) -> Pair:
        """Return the servo angles of joint angles, or the servo speeds of joint speeds."""
        both, against = self.first_ratio * joints[0], self.second_ratio * joints[1]
        return both + against, both - against

    def joint_rad(self, servos: Pair) -> Pair:
        """Return the joint angles of servo angles, or the joint speeds of servo speeds."""
        a, b = servos
        return 0.5 * (a + b) / self.first_ratio, 0.5 * (a - b) / self.second_ratio


def unreachable_text(pair: CouplingParams, joints: Mapping[str, JointParams]) -> str | None:
    """Return a text about joint angles that the servos cannot reach, None if they reach all.

    Args:
        pair: The coupled pair.
        joints: Joints of the rig, with known servo models.
    """
    for at in _corners(pair, joints):
        for name, angle in zip(pair.joints, pair.servo_rad(at), strict=True):
            if fault := joints[name].position_fault(joints[name].steps(angle)):
                return (
                    f"cannot reach {pair.first} {degrees(at[0]):g}, {pair.second} "
                    f"{degrees(at[1]):g} deg: the servo of {name} would be at {fault}"
                )
    return None


def pair_setups(
    pair: CouplingParams,
    joints: Mapping[str, JointParams],
    park_rad: Mapping[str, float],
    gentle_deg_s: float = ENTRY_DEG_S,
) -> dict[str, ServoConfig]:
    """Return the configuration of both servos for the whole range of both joints.

    Args:
        pair: The coupled pair.
        joints: Joints of the rig.
        park_rad: Parking pose by joint, default 0.
        gentle_deg_s: Highest speed at which servos outside their ranges move inside.
    """
    both = joints[pair.first], joints[pair.second]
    ratios = pair.rates[0]
    speed = sum(k * radians(one.max_speed_deg_s) for k, one in zip(ratios, both, strict=True))
    accel = sum(k * radians(one.max_accel_deg_s2) for k, one in zip(ratios, both, strict=True))
    rest = pair.servo_rad((park_rad.get(pair.first, 0.0), park_rad.get(pair.second, 0.0)))
    shafts = zip(*(pair.servo_rad(at) for at in _corners(pair, joints)), strict=True)
    found = {}
    for name, joint, angles, rest_rad in zip(pair.joints, both, shafts, rest, strict=True):
        linkage = joint.make_linkage()
        steps = [linkage.steps(angle) for angle in angles]
        steepest = max(ratios) * linkage.steepest
        config = joint.setup(name, park_rad.get(name, 0.0), gentle_deg_s)
        found[name] = config._replace(
            min_steps=ceil(min(steps) - 1e-6),
            max_steps=floor(max(steps) + 1e-6),
            max_speed_steps_s=speed * linkage.steepest,
            max_accel_steps_s2=accel * linkage.steepest,
            rest_steps=None if config.rest_steps is None else round(linkage.steps(rest_rad)),
            entry_speed_steps_s=radians(min(ENTRY_DEG_S, gentle_deg_s)) * steepest,
            far_steps=radians(FAR_DEG) * steepest,
        )
    return found


def servo_setups(
    joints: Mapping[str, JointParams],
    park_rad: Mapping[str, float],
    gentle_deg_s: float = ENTRY_DEG_S,
    pairs: Collection[CouplingParams] = (),
) -> tuple[ServoConfig, ...]:
    """Return the configuration of all servos for a bus.

    Args:
        joints: The joints by name.
        park_rad: Parking pose by joint, default 0; the assumed start of servos without feedback.
        gentle_deg_s: Highest speed at which joints outside their ranges move inside.
        pairs: Joints that two servos move together.
    """
    coupled: dict[str, ServoConfig] = {}
    for pair in pairs:
        coupled |= pair_setups(pair, joints, park_rad, gentle_deg_s)
    return tuple(
        coupled.get(name) or joints[name].setup(name, park_rad.get(name, 0.0), gentle_deg_s)
        for name in order_joints(joints)
    )


def _corners(pair: CouplingParams, joints: Mapping[str, JointParams]) -> list[Pair]:
    """Return the joint angles at which the servos are farthest from their middle."""
    one, other = (joints[name].limit() for name in pair.joints)
    return list(product((one.low_rad, one.high_rad), (other.low_rad, other.high_rad)))


def far_outside(angle_rad: float, limit: JointLimit) -> str:
    """Return where a joint is and why, if it is too far outside its range for torque; else ""."""
    angle, low, high = map(degrees, (angle_rad, limit.low_rad, limit.high_rad))
    beyond = max(low - angle, angle - high)
    if beyond <= FAR_DEG:
        return ""
    return f"is at {angle:.0f} deg, {beyond:.0f} deg outside its range {low:.4g}..{high:.4g} deg: {FAR_CAUSES}"


def find_far_outside(
    joints: Mapping[str, JointParams], pairs: Collection[CouplingParams], steps: Mapping[str, float]
) -> dict[str, str]:
    """Return the text of ``far_outside`` of each joint that must get no torque.

    Args:
        joints: The joints of a rig.
        pairs: Joints that two servos move together; both positions of a pair are needed.
        steps: Measured servo positions by joint.
    """
    angles = {name: joints[name].angle_rad(at) for name, at in steps.items()}
    for pair in pairs:
        shafts = angles.pop(pair.first, None), angles.pop(pair.second, None)
        if shafts[0] is not None and shafts[1] is not None:
            angles[pair.first], angles[pair.second] = pair.joint_rad((shafts[0], shafts[1]))
    texts = {name: far_outside(angle, joints[name].limit()) for name, angle in angles.items()}
    return {name: text for name, text in texts.items() if text}
