"""Ranges of two joints that collide, such as a lid and a frame, chin and chest."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import degrees, radians
from typing import Annotated, NamedTuple

from gazerig.params import Bounds
from gazerig.robot.model.joint_limit import JointLimit
from gazerig.robot.model.types import JOINT_NAME


@dataclass(frozen=True)
class CollisionParams:
    """Two joints that collide if both are in these ranges."""

    first: Annotated[str, "a joint"]
    first_min_deg: Annotated[float, Bounds(-180, 180), "from this angle"]
    first_max_deg: Annotated[float, Bounds(-180, 180), "to this one"]
    second: Annotated[str, "the other joint"]
    second_min_deg: Annotated[float, Bounds(-180, 180), "from this angle"]
    second_max_deg: Annotated[float, Bounds(-180, 180), "to this one"]

    def __post_init__(self) -> None:
        """Check that these are two ranges of two joints.

        Raises:
            ValueError: They are not; the message gives the reason.
        """
        for name in (self.first, self.second):
            if not JOINT_NAME.fullmatch(name):
                raise ValueError(f"{name!r} is not a joint name such as neck_yaw or jaw")
        if self.first == self.second:
            raise ValueError(f"first and second are both {self.first}; name two joints")
        for key in ("first", "second"):
            low, high = getattr(self, f"{key}_min_deg"), getattr(self, f"{key}_max_deg")
            if not low < high:
                raise ValueError(f"{key}_min_deg {low} must be below {key}_max_deg {high}")


class ForbiddenRange(NamedTuple):
    """One joint's range of a forbidden box, and the walls at a margin outside it."""

    joint: int
    low: float
    high: float
    below: float
    above: float


def forbidden_pairs(
    params: Sequence[CollisionParams],
    margin_deg: float,
    limits: tuple[JointLimit, ...],
    joints: tuple[str, ...],
) -> list[tuple[ForbiddenRange, ForbiddenRange]]:
    """Return the two ranges of every collision.

    Args:
        params: The forbidden pairs of ranges.
        margin_deg: Distance to them, as servos round and lag.
        limits: One limit per joint.
        joints: Names of the joints, in the order of the limits.

    Raises:
        ValueError: A pair leaves no pose inside the limits, or names an unknown joint.
    """
    pairs = [
        (
            _range(_index(one.first, joints), one.first_min_deg, one.first_max_deg, margin_deg),
            _range(_index(one.second, joints), one.second_min_deg, one.second_max_deg, margin_deg),
        )
        for one in params
    ]
    for pair in pairs:
        # A pose is left if one of the joints can be outside its range of the box.
        if all(
            limits[span.joint].low_rad > span.below and limits[span.joint].high_rad < span.above
            for span in pair
        ):
            raise ValueError(_no_pose(pair, margin_deg, limits, joints))
    return pairs


def _index(name: str, joints: tuple[str, ...]) -> int:
    if name not in joints:
        raise ValueError(
            f"a collision names {name}, which this rig does not have: take it out, or name one of "
            f"{', '.join(joints)}"
        )
    return joints.index(name)


def _range(joint: int, low_deg: float, high_deg: float, margin_deg: float) -> ForbiddenRange:
    low, high, margin = radians(low_deg), radians(high_deg), radians(margin_deg)
    return ForbiddenRange(joint, low, high, low - margin, high + margin)


def _no_pose(
    pair: tuple[ForbiddenRange, ForbiddenRange],
    margin_deg: float,
    limits: tuple[JointLimit, ...],
    joints: tuple[str, ...],
) -> str:
    halves = [
        f"{joints[span.joint]} {degrees(span.low):g}..{degrees(span.high):g} deg of "
        f"{degrees(limits[span.joint].low_rad):g}..{degrees(limits[span.joint].high_rad):g}"
        for span in pair
    ]
    return (
        f"the collision of {' with '.join(halves)} leaves no pose, with its margin of "
        f"{margin_deg:g} deg; narrow one of the two"
    )
