"""Strain of servos, which slows a joint down before it stops it, and joints that stall.

A joint that does not follow its commands is jammed, or blocked by a finger. A servo pushes harder
the farther away its goal is, so a stalled joint must not be pushed: its command returns to the
joint's position, waits, and tries again softly.
"""

from collections.abc import Sequence
from math import isfinite, nan, radians
from typing import Literal

from gazerig.robot.model.joint import JointLimit
from gazerig.robot.model.types import JointState

Strain = Literal["", "hot", "overloaded", "voltage"]
WARM_C, HOT_C = 15.0, 5.0
"""Distances below a servo's own temperature limit at which its joint is slowed down and stopped."""
_COOLER_C = 2.0  # hysteresis: temperatures are whole degrees, without it a joint would stutter
_SLOWEST = 0.2
"""Share of speed and acceleration that remains just before a joint is stopped."""
LASTING_LOAD = 0.5
"""Share of the stall torque that is allowed continuously; more is weighted by its square (I2t)."""
_FULL_S = (1.0 - LASTING_LOAD**2) * 0.7
"""Full load for 0.7 s stops a joint; it is slowed down from half of this time."""
VOLTAGE_MARGIN_V = 0.3
"""A joint is slowed down when the voltage is this close to the servo's own limits."""
_OUTSIDE_S = 0.5
"""A joint is stopped when the voltage is outside those limits for longer than this."""

FAR_RAD = radians(3.0)
"""Largest normal distance between a joint and its command, by friction and weight."""
LEAD_RAD = radians(4.5)
"""Largest distance of the command ahead of a joint that tries again, so that it pushes weakly."""
_MOVED_RAD = radians(0.5)
"""Motion towards the command that counts as moving."""
_STUCK_S = 0.15
"""A joint that has not moved for this long is stalled. The dead time of a healthy servo is about
30 ms; with the age of an answer and one more tick a stall is found within 200 ms.
"""
_RETRY_S = 1.0
"""A stalled joint tries again, slowly, after this time."""


class JointHealth:
    """The strain of all joints.

    Attributes:
        share: Part of its speed and acceleration that each joint may use, 0 .. 1.
        why: Reason for that part, per joint.
        held: Reason for a complete stop, per joint.
    """

    def __init__(self, limits: tuple[JointLimit, ...]) -> None:
        """Start with all joints unstrained."""
        self._limits = limits
        self.reset()

    def reset(self) -> None:
        """Set all joints to unstrained until the servos report otherwise."""
        count = len(self._limits)
        self.share = [1.0] * count
        self.why: list[Strain] = [""] * count
        self.held: list[Strain] = [""] * count
        self._counting = False
        self._heated = [0.0] * count  # (load^2 - continuous load^2) times seconds
        self._outside_s = [0.0] * count
        self._hot = [False] * count
        self._overloaded = [False] * count
        self._no_volts = [False] * count
        self._seen: tuple[object, object] = ((), ())

    def step(self, joints: JointState, dt_s: float) -> None:
        """Update with the servos' reports; missing values do not strain a joint."""
        load, readings = joints.load, (joints.temperature_c, joints.voltage_v)
        strained = bool(load) and not (max(load) <= LASTING_LOAD and min(load) >= -LASTING_LOAD)
        if not strained and readings == self._seen and not self._counting:
            return
        self._seen = readings
        for i in range(len(self._limits)):
            self._judge(i, joints, dt_s)
        self._counting = any(self._heated) or any(self._outside_s)

    def _judge(self, i: int, joints: JointState, dt_s: float) -> None:
        heat = self._heat(i, _joint_value(joints.temperature_c, i))
        load = self._load(i, _joint_value(joints.load, i), dt_s)
        volts = self._volts(i, _joint_value(joints.voltage_v, i), dt_s)
        share = min(heat, load, volts)
        self.share[i] = _SLOWEST + (1.0 - _SLOWEST) * share
        if share == 1.0:
            self.why[i] = ""
        else:
            self.why[i] = "hot" if heat == share else "overloaded" if load == share else "voltage"
        if self._overloaded[i]:
            self.held[i] = "overloaded"
        else:
            self.held[i] = "hot" if self._hot[i] else "voltage" if self._no_volts[i] else ""

    def _heat(self, i: int, celsius: float | None) -> float:
        """Return the speed share allowed by heat, from 1 when warm to 0 when hot."""
        if celsius is None:
            return 1.0
        warm = self._limits[i].hottest_c - WARM_C
        hot = self._limits[i].hottest_c - HOT_C
        self._hot[i] = celsius >= (hot - _COOLER_C if self._hot[i] else hot)
        return min(max((hot - celsius) / (hot - warm), 0.0), 1.0)

    def _load(self, i: int, load: float | None, dt_s: float) -> float:
        """Return the speed share allowed by load, from 1 at half the motor's heat limit to 0 at it.

        Heat rises with the square of the current. It is dissipated at the rate at which the
        continuous load produces it.
        """
        if load is not None:
            gained = (load * load - LASTING_LOAD**2) * dt_s
            self._heated[i] = min(max(self._heated[i] + gained, 0.0), _FULL_S)
        filled = self._heated[i] / _FULL_S
        self._overloaded[i] = filled >= (0.5 if self._overloaded[i] else 1.0)
        return min(max(2.0 - 2.0 * filled, 0.0), 1.0)

    def _volts(self, i: int, volts: float | None, dt_s: float) -> float:
        """Return the speed share allowed by voltage, from 1 inside the margin to 0 at the limit."""
        if volts is None:
            return 1.0
        room = min(volts - self._limits[i].lowest_v, self._limits[i].highest_v - volts)
        outside_s = self._outside_s[i] + (dt_s if room < 0.0 else -dt_s)
        self._outside_s[i] = min(max(outside_s, 0.0), _OUTSIDE_S)
        # A sagging supply recovers when the joint stops: the joint rests for the same time.
        spent = outside_s >= _OUTSIDE_S and room < 0.0
        self._no_volts[i] = spent or (self._no_volts[i] and self._outside_s[i] > 0.0)
        return min(max(room / VOLTAGE_MARGIN_V, 0.0), 1.0)


def _joint_value(column: Sequence[float | None], i: int) -> float | None:
    value = column[i] if column else None
    return value if value is not None and isfinite(value) else None


class StallDetector:
    """A detector of stalled joints.

    Attributes:
        watched: Per joint, the side on which its command is far away (1 or -1), 0 if it is near.
    """

    def __init__(self, count: int) -> None:
        """Start with no joint stalled."""
        self.watched = [0] * count
        self._since_s = [0.0] * count
        self._anchor_rad = [0.0] * count
        self._until_s = [nan] * count

    def forget(self, i: int) -> None:
        """Clear a joint's stall, as its command is at its position."""
        self.watched[i] = 0
        self._until_s[i] = nan

    def is_waiting(self, i: int, t_s: float) -> bool:
        """Return whether a joint is stalled and still waits."""
        if t_s >= self._until_s[i]:
            self.forget(i)
        return t_s < self._until_s[i]

    def has_stalled(self, i: int, command: float, position: float, at_s: float, t_s: float) -> bool:
        """Update with a new measurement; return whether the joint has stalled.

        Only motion towards the command counts: a joint that a hand moves in the other direction
        must give way.

        Args:
            i: Number of the joint.
            command: Commanded angle in rad.
            position: Measured angle in rad.
            at_s: Time of the measurement.
            t_s: Present time.
        """
        lead = command - position
        if -FAR_RAD <= lead <= FAR_RAD:
            self.watched[i] = 0
            return False
        side = 1 if lead > 0.0 else -1
        begins = side != self.watched[i]
        if begins or (position - self._anchor_rad[i]) * side > _MOVED_RAD:
            self.watched[i], self._since_s[i], self._anchor_rad[i] = side, at_s, position
            return False
        if at_s - self._since_s[i] < _STUCK_S:
            return False
        self.watched[i] = 0
        self._until_s[i] = t_s + _RETRY_S
        return True
