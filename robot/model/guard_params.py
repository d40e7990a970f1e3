"""Parameters of the guard besides the joints' own limits, and ranges of joints that collide."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import degrees, radians
from typing import Annotated, NamedTuple

from gazerig.params import Bounds
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.model.types import JOINT_NAME


@dataclass(frozen=True)
class CollisionParams:
    """Two joints that collide if both are in these ranges."""

    first: Annotated[str, "a joint"]
    first_min_deg: Annotated[float, Bounds(-180, 180), "start of the first joint's range"]
    first_max_deg: Annotated[float, Bounds(-180, 180), "end of that range"]
    second: Annotated[str, "name of the other joint"]
    second_min_deg: Annotated[float, Bounds(-180, 180), "start of the other joint's range"]
    second_max_deg: Annotated[float, Bounds(-180, 180), "end of that range"]

    def __post_init__(self) -> None:
        """Check that these are two ranges of two joints.

        Raises:
            ValueError: They are not; the message gives the reason.
        """
        for name in (self.first, self.second):
            if not JOINT_NAME.fullmatch(name):
                raise ValueError(f"{name!r} is not a joint name such as neck_yaw or jaw")
        if self.first == self.second:
            raise ValueError(f"first and second are both {self.first}; give two different joints")
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
        margin_deg: Distance to them, because servos round positions and lag.
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
            halves = [
                f"{joints[span.joint]} {degrees(span.low):g}..{degrees(span.high):g} deg of "
                f"{degrees(limits[span.joint].low_rad):g}..{degrees(limits[span.joint].high_rad):g}"
                for span in pair
            ]
            raise ValueError(
                f"the collision of {' with '.join(halves)} allows no pose, with its margin of "
                f"{margin_deg:g} deg; narrow one of the two"
            )
    return pairs


def _index(name: str, joints: tuple[str, ...]) -> int:
    if name not in joints:
        raise ValueError(
            f"a collision names {name}, which this rig does not have: remove it, or use one of "
            f"{', '.join(joints)}"
        )
    return joints.index(name)


def _range(joint: int, low_deg: float, high_deg: float, margin_deg: float) -> ForbiddenRange:
    low, high, margin = radians(low_deg), radians(high_deg), radians(margin_deg)
    return ForbiddenRange(joint, low, high, low - margin, high + margin)


@dataclass(frozen=True)
class HealthParams:
    """Thresholds for slowing and stopping servos before they switch themselves off."""

    # fmt: off
    warm_c: Annotated[float, Bounds(1, 60), "distance below the servo's own temperature limit from which a joint is slowed down"] = 15.0
    hot_c: Annotated[float, Bounds(0, 40), "distance below that limit from which a joint is stopped"] = 5.0
    slowest: Annotated[float, Bounds(0.01, 1), "share of speed and acceleration that remains just before a joint is stopped"] = 0.2
    lasting_load: Annotated[float, Bounds(0.05, 0.95),
        "share of the stall torque that is allowed continuously; a higher load is weighted by its square (I2t)"] = 0.5
    overload_ms: Annotated[float, Bounds(50, 60000),
        "full load for this long stops a joint; it is slowed down from half of this time"] = 700.0
    voltage_margin_v: Annotated[float, Bounds(0, 5),
        "a joint is slowed down when the voltage is this close to the servo's own limits"] = 0.3
    voltage_ms: Annotated[float, Bounds(0, 60000),
        "a joint is stopped when the voltage is outside those limits for longer than this"] = 500.0
    # fmt: on

    def __post_init__(self) -> None:
        """Check that the warm temperature is below the hot one.

        Raises:
            ValueError: It is not.
        """
        if self.hot_c >= self.warm_c:
            raise ValueError(f"hot_c {self.hot_c} must be below warm_c {self.warm_c}")


@dataclass(frozen=True)
class StallParams:
    """Detection of stalled joints, and their next try."""

    # fmt: off
    position_error_deg: Annotated[float, Bounds(0.5, 45),
        "smallest distance from the commanded angle at which a joint must move; larger than the error due to friction and weight"] = 3.0
    moved_deg: Annotated[float, Bounds(0.1, 10), "motion towards the commanded angle that counts as moving"] = 0.5
    # The dead time of a healthy servo is about 30 ms. With the age of an answer and one more tick
    # a stall is found within 200 ms.
    detection_ms: Annotated[float, Bounds(50, 5000), "a joint that has not moved for this long is stalled and stops pushing"] = 150.0
    retry_ms: Annotated[float, Bounds(100, 60000), "a stalled joint tries again, slowly, after this time"] = 1000.0
    retry_deg: Annotated[float, Bounds(0.5, 45),
        "while it tries again, the commanded angle is at most this far ahead of the joint, so that it pushes weakly"] = 4.5
    # fmt: on

    def __post_init__(self) -> None:
        """Check that a joint that tries again can be found stalled again.

        Raises:
            ValueError: It could not; the message states the required order.
        """
        if self.retry_deg <= self.position_error_deg:
            raise ValueError(
                f"retry_deg {self.retry_deg} must be above position_error_deg {self.position_error_deg}"
            )
        if self.moved_deg >= self.position_error_deg:
            raise ValueError(
                f"moved_deg {self.moved_deg} must be below position_error_deg {self.position_error_deg}"
            )


@dataclass(frozen=True)
class GuardParams:
    """Timeouts, slow motion, and limits of the servos' strain."""

    # fmt: off
    joint_timeout_ms: Annotated[float, Bounds(5, 5000), "a joint whose last measurement is older than this is stopped"] = 150.0
    frame_timeout_ms: Annotated[float, Bounds(50, 60000), "the neck is stopped while the last frame is older than this"] = 1500.0
    soft_start_ms: Annotated[float, Bounds(0, 60000), "shortest time of slow motion after torque-on"] = 1000.0
    soft_start_speed_deg_s: Annotated[float, Bounds(1, 500), "speed after torque-on and while parking"] = 60.0
    soft_start_accel_deg_s2: Annotated[float, Bounds(1, 50000), "acceleration after torque-on and while parking"] = 300.0
    late_ms: Annotated[float, Bounds(0, 5000),
        "acceleration is limited to late_accel_deg_s2 for this long after a tick that missed its slot"] = 50.0
    late_accel_deg_s2: Annotated[float, Bounds(10, 200_000),
        "acceleration limit after a late tick, because servos brake without new goals; slow motion regains its speed with it"] = 15000.0
    health: Annotated[HealthParams, "limits of the servos' strain"] = field(default_factory=HealthParams)
    stall: Annotated[StallParams, "detection of stalled joints"] = field(default_factory=StallParams)
    collision_margin_deg: Annotated[float, Bounds(0.1, 20),
        "distance kept from forbidden ranges, because servos round positions and lag"] = 1.0
    collisions: Annotated[tuple[CollisionParams, ...], "pairs of joint ranges that must not be occupied at the same time"] = ()
    # fmt: on
