"""Parameters of the guard besides the joints' own limits, and ranges of joints that collide."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import degrees, radians
from typing import Annotated, NamedTuple

from gazerig.params import Bounds
from gazerig.robot.model.joint import JointLimit

JointSpan = tuple[str, Annotated[float, Bounds(-180, 180)], Annotated[float, Bounds(-180, 180)]]
"""A joint, and the start and the end of a part of its range, deg."""


@dataclass(frozen=True)
class CollisionParams:
    """Two joints that collide if both are in these ranges."""

    first: Annotated[JointSpan, "a joint and the two ends of its range: [joint, min_deg, max_deg]"]
    second: Annotated[JointSpan, "the other joint and its range"]

    def __post_init__(self) -> None:
        """Check that these are two ranges of two joints.

        Raises:
            ValueError: They are not; the message gives the reason.
        """
        if self.first[0] == self.second[0]:
            raise ValueError(
                f"first and second are both {self.first[0]}; give two different joints"
            )
        for name, low, high in (self.first, self.second):
            if not low < high:
                raise ValueError(
                    f"{name}: {low:g} must be below {high:g}: [joint, min_deg, max_deg]"
                )


_MARGIN_DEG = 1.0
"""Distance kept from forbidden ranges, because servos round positions and lag."""


class ForbiddenRange(NamedTuple):
    """One joint's range of a forbidden box, and the walls at a margin outside it."""

    joint: int
    low: float
    high: float
    below: float
    above: float


def forbidden_pairs(
    params: Sequence[CollisionParams], limits: tuple[JointLimit, ...], joints: tuple[str, ...]
) -> list[tuple[ForbiddenRange, ForbiddenRange]]:
    """Return the two ranges of every collision.

    Args:
        params: The forbidden pairs of ranges.
        limits: One limit per joint.
        joints: Names of the joints, in the order of the limits.

    Raises:
        ValueError: A pair leaves no pose inside the limits, or names an unknown joint.
    """
    pairs = [(_range(one.first, joints), _range(one.second, joints)) for one in params]
    for pair in pairs:
        # A pose is left if one of the joints can be outside its range of the box.
        if all(
            limits[span.joint].low_rad > span.below and limits[span.joint].high_rad < span.above
            for span in pair
        ):
            halves = [
                f"{joints[span.joint]} {degrees(span.low):g}..{degrees(span.high):g} deg of "
                f"{degrees(limits[span.joint].low_rad):g}..{degrees(limits[span.joint].high_rad):g}"
                for span in pair
            ]
            raise ValueError(
                f"the collision of {' with '.join(halves)} allows no pose, with its margin of "
                f"{_MARGIN_DEG:g} deg; narrow one of the two"
            )
    return pairs


def _range(span: JointSpan, joints: tuple[str, ...]) -> ForbiddenRange:
    name, low_deg, high_deg = span
    if name not in joints:
        raise ValueError(
            f"a collision names {name}, which this rig does not have: remove it, or use one of "
            f"{', '.join(joints)}"
        )
    low, high, margin = radians(low_deg), radians(high_deg), radians(_MARGIN_DEG)
    return ForbiddenRange(joints.index(name), low, high, low - margin, high + margin)


@dataclass(frozen=True)
class GuardParams:
    """Slow motion, and joints that collide."""

    # fmt: off
    soft_start_speed_deg_s: Annotated[float, Bounds(1, 500), "speed after torque-on and while parking"] = 60.0
    collisions: Annotated[tuple[CollisionParams, ...], "pairs of joint ranges that must not be occupied at the same time"] = ()
    # fmt: on
