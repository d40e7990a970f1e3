"""Parameters of a joint: its servo, its linkage, its installation and its limits.

A linkage between servo and joint is a gear or a measured push rod. A push rod turns its joint less,
the farther its horn is from a right angle, so hobby eye mechanisms have no constant ratio: some
points are measured and interpolated linearly. Angles are in rad at the joint, steps at the servo.
"""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, floor, inf, pi, radians
from typing import Annotated, Literal, NamedTuple

from gazerig.drivers.bus.goal_limits import ENTRY_DEG_S, FAR_DEG
from gazerig.drivers.bus.servo_models import SERVOS, ServoModelInfo
from gazerig.drivers.types import ServoConfig
from gazerig.params import Bounds, Unit


class JointLimit(NamedTuple):
    """A joint's range, top speed and top acceleration (rad, rad/s, rad/s^2).

    The other fields are the limits at which the joint's servo switches itself off: temperature
    in deg C, lowest and highest voltage in V.
    """

    low_rad: float
    high_rad: float
    speed_rad_s: float
    accel_rad_s2: float
    hottest_c: float = 70.0
    lowest_v: float = 0.0
    highest_v: float = inf

    def reduced_to(self, reach: "JointLimit") -> "JointLimit":
        """Return these limits with range and speed reduced to a servo's own limits."""
        return self._replace(
            low_rad=min(max(self.low_rad, reach.low_rad), reach.high_rad),
            high_rad=max(min(self.high_rad, reach.high_rad), reach.low_rad),
            speed_rad_s=min(self.speed_rad_s, reach.speed_rad_s),
        )


class Linkage:
    """A linkage between a servo and its joint: a gear, or lines between measured points.

    The outermost lines extrapolate beyond the points.

    Attributes:
        steepest: Largest number of steps per rad, above 0.
        rising: Whether more steps give a larger angle.
        line: Steps at 0 rad and signed steps per rad of a gear, otherwise None.

    Args:
        angles_rad: Rising angles of measured points, at least two; of a gear only 0.
        steps: Their steps, all rising or all falling.
        slope: Signed steps per rad of a gear, None for measured points.

    Raises:
        ValueError: The points are not of that form; the message gives the position.
    """

    def __init__(
        self, angles_rad: Sequence[float], steps: Sequence[float], slope: float | None = None
    ) -> None:
        self._angles, self._steps = tuple(angles_rad), tuple(map(float, steps))
        self.line = (self._steps[0], slope) if slope is not None else None
        self._slopes = (slope,) if slope is not None else _slopes(self._angles, self._steps)
        self._rate = 1.0 / self._slopes[0]
        self.rising = self._rate > 0.0
        self.steepest = max(map(abs, self._slopes))
        # Keys rise for both directions of the rod.
        self._order = 1.0 if self.rising else -1.0
        self._keys = tuple(self._order * s for s in self._steps)

    def steps(self, angle_rad: float) -> float:
        """Return the servo position of a joint angle, not rounded."""
        if self.line is not None:
            return self.line[0] + self.line[1] * angle_rad
        i = self._segment(self._angles, angle_rad)
        return self._steps[i] + self._slopes[i] * (angle_rad - self._angles[i])

    def angle_rad(self, steps: float) -> float:
        """Return the joint angle of a servo position."""
        if self.line is not None:
            return (steps - self.line[0]) * self._rate
        i = self._segment(self._keys, self._order * steps)
        return self._angles[i] + (steps - self._steps[i]) / self._slopes[i]

    def rate_rad(self, steps: float) -> float:
        """Return the signed angle in rad per step at a servo position."""
        if self.line is not None:
            return self._rate
        return 1.0 / self._slopes[self._segment(self._keys, self._order * steps)]

    def _segment(self, points: Sequence[float], at: float) -> int:
        return min(max(bisect_right(points, at) - 1, 0), len(self._slopes) - 1)


def _slopes(angles: Sequence[float], steps: Sequence[float]) -> tuple[float, ...]:
    """Return the slopes between measured points; raise ValueError if they are impossible."""
    if len(angles) < 2 or len(angles) != len(steps):
        raise ValueError("a linkage needs at least two points, each an angle and a position")
    up = steps[-1] > steps[0]
    for i in range(1, len(steps)):
        if angles[i] <= angles[i - 1]:
            raise ValueError(f"the angles of a linkage must increase; point {i + 1} does not")
        if (steps[i] > steps[i - 1]) != up or steps[i] == steps[i - 1]:
            raise ValueError(
                "the positions of a linkage must all increase or all decrease; "
                f"point {i + 1} does not: measure it again"
            )
    rows = zip(pairwise(steps), pairwise(angles), strict=True)
    return tuple([(above - below) / (end - start) for (below, above), (start, end) in rows])


_AngleOrPosition = Annotated[float, Bounds(-180, 4095)]
_Gain = Annotated[int, Bounds(0, 16383)]


@dataclass(frozen=True)
class JointParams:
    """A joint: its servo, its installation and its limits."""

    # fmt: off
    id: Annotated[int, Bounds(0, 252), "servo id; on a Maestro its channel"]
    model: Annotated[str, 'servo model, e.g. "xl330-m077", "sts3215" or "hobby"']
    min_deg: Annotated[float, Bounds(-180, 180), "lowest joint angle"]
    max_deg: Annotated[float, Bounds(-180, 180), "highest joint angle"]
    max_speed_deg_s: Annotated[float, Bounds(1, 2000), "highest speed of the joint"]
    max_accel_deg_s2: Annotated[float, Bounds(10, 200_000), "highest acceleration of the joint"]
    sign: Annotated[Literal[1, -1],
        "1 if a larger servo position turns the joint left, up, open or towards the right shoulder; otherwise -1"] = 1
    ratio: Annotated[float, Bounds(0.05, 50), "gear ratio: turns of the servo for one turn of the joint"] = 1.0
    zero_step: Annotated[int | None, Bounds(0, 4095), Unit("steps or us"),
        "servo position at joint angle 0, for a hobby servo its pulse width in us; null: the middle, 2048 or 1500"] = None
    transmission_points: Annotated[tuple[tuple[_AngleOrPosition, _AngleOrPosition], ...], Unit("deg, steps or us"),
        "measured points of a push-rod linkage, each [joint angle, servo position]; they replace sign, ratio and zero_step"] = ()
    bus: Annotated[str, "name of the joint's bus under buses; empty: the one under bus"] = ""
    servo_speed_deg_s: Annotated[float | None, Bounds(10, 5000),
        "speed of a hobby servo's own shaft (0.12 s for 60 deg is 500), for emulated servos; null: that of a usual "
        "servo"] = None
    gains: Annotated[tuple[_Gain, _Gain, _Gain] | None, "Position P, I and D Gain of the servo; null: not changed"] = None
    torque_limit: Annotated[float | None, Bounds(0.05, 1),
        "share of its full drive that the servo may use (PWM Limit), which limits both torque and speed; null: not changed"] = None
    # fmt: on

    def __post_init__(self) -> None:
        """Check that the limits fit each other and the servo's one turn.

        Raises:
            ValueError: They do not; the message names the limit.
        """
        if self.min_deg >= self.max_deg:
            raise ValueError(f"min_deg {self.min_deg} must be below max_deg {self.max_deg}")
        if not self.min_deg <= 0.0 <= self.max_deg:
            raise ValueError("0 deg, the centre, must be between min_deg and max_deg")
        facts = SERVOS.get(self.model)
        if facts is None:
            return
        linkage = self.make_linkage()
        if self.transmission_points:
            least, most = self.transmission_points[0][0], self.transmission_points[-1][0]
            if not least <= self.min_deg < self.max_deg <= most:
                raise ValueError(
                    f"its linkage was measured from {least:g} to {most:g} deg: min_deg "
                    f"{self.min_deg} and max_deg {self.max_deg} must be within"
                )
        for key, angle in (("min_deg", self.min_deg), ("max_deg", self.max_deg)):
            if fault := self.position_fault(linkage.steps(radians(angle))):
                raise ValueError(f"{key} {angle} is at {fault}")

    def position_fault(self, steps: float) -> str:
        """Return a servo position as text if the servo cannot reach it, otherwise ""."""
        facts = self.model_facts
        if facts.lowest <= steps <= facts.highest:
            return ""
        low, high, at = (x / facts.unit_steps for x in (facts.lowest, facts.highest, steps))
        return f"{at:.0f}, outside the servo's {low:.0f}..{high:.0f} {facts.unit}"

    @property
    def model_facts(self) -> ServoModelInfo:
        """Return the data of its servo model.

        Raises:
            KeyError: The model is unknown, which cannot occur in a checked rig.
        """
        return SERVOS[self.model]

    @property
    def zero(self) -> int:
        """Return the servo position at 0 deg, in the unit of its model."""
        return self.zero_step if self.zero_step is not None else self.model_facts.middle

    def shaft_turns(self) -> float:
        """Return the highest number of shaft turns per turn of the joint."""
        return self.make_linkage().steepest * 2.0 * pi / self.model_facts.steps_per_turn

    def make_linkage(self) -> Linkage:
        """Build the linkage between servo and joint.

        Raises:
            ValueError: The linkage is impossible.
        """
        facts = self.model_facts
        if self.transmission_points:
            angles, places = zip(*self.transmission_points, strict=True)
            return Linkage([radians(a) for a in angles], [facts.unit_steps * p for p in places])
        slope = self.sign * self.ratio * facts.steps_per_turn / (2.0 * pi)
        return Linkage((0.0,), (facts.unit_steps * self.zero,), slope)

    def steps(self, angle_rad: float) -> float:
        """Return the servo position of a joint angle, not rounded."""
        return self.make_linkage().steps(angle_rad)

    def angle_rad(self, steps: float) -> float:
        """Return the joint angle of a servo position."""
        return self.make_linkage().angle_rad(steps)

    def limit(self) -> JointLimit:
        """Return the limits in radians, and those of the servo's own protection."""
        facts = self.model_facts
        return JointLimit(
            radians(self.min_deg),
            radians(self.max_deg),
            radians(self.max_speed_deg_s),
            radians(self.max_accel_deg_s2),
            facts.hottest_c,
            facts.lowest_v,
            facts.highest_v,
        )

    def setup(
        self, name: str = "", rest_rad: float | None = None, gentle_deg_s: float = ENTRY_DEG_S
    ) -> ServoConfig:
        """Return the servo's configuration: the range rounded inwards, speed and acceleration.

        Args:
            name: Name of the joint.
            rest_rad: Assumed angle at torque-on of a servo without feedback: the parking pose.
            gentle_deg_s: Highest speed at which a joint outside its range moves inside.
        """
        linkage, facts = self.make_linkage(), self.model_facts
        ends = sorted(linkage.steps(radians(end)) for end in (self.min_deg, self.max_deg))
        return ServoConfig(
            self.id,
            self.model,
            ceil(ends[0]),
            floor(ends[1]),
            radians(self.max_speed_deg_s) * linkage.steepest,
            name,
            self.gains,
            self.torque_limit,
            radians(self.max_accel_deg_s2) * linkage.steepest,
            None if rest_rad is None or facts.measures_position else round(linkage.steps(rest_rad)),
            radians(min(ENTRY_DEG_S, gentle_deg_s)) * linkage.steepest,
            radians(FAR_DEG) * linkage.steepest,
        )
