"""Limits of a command's motion: range, speed, acceleration and room to brake. Units: rad, s.

Every step keeps p + v^2 / 2a inside the present range. As v^2 / 2a bounds every later sequence
of braking steps, a joint that keeps this can always stop in time, whatever the length of the
following ticks.
"""

from collections import deque
from math import copysign, inf, sqrt

from gazerig.robot.model.joint import JointLimit

_ROUNDING_RAD = 1e-9
SHORT_GAP_S = 0.05
"""After a longer time without goals a joint starts from rest."""


class MotionLimiter:
    """The commands of all joints and their speeds, moved step by step.

    Attributes:
        command, speed: Newest commands and their speeds.
        goal: Newest desired angles; the command itself if it was reached.
        low, high: Present ranges. A wall inside a joint's own range may be set while the joint can
            stop before it (``keeps_below``, ``keeps_above``).
    """

    def __init__(self, limits: tuple[JointLimit, ...]) -> None:
        self.limits = list(limits)
        self.command = [0.5 * (limit.low_rad + limit.high_rad) for limit in limits]
        self.speed = [0.0] * len(limits)
        self.low = [limit.low_rad for limit in limits]
        self.high = [limit.high_rad for limit in limits]
        self.goal = list(self.command)
        self._lost = [0.0] * len(limits)
        self._slow = [False] * len(limits)

    def restart(self, i: int, angle_rad: float) -> None:
        """Reset to an angle, at rest."""
        self.command[i] = self.goal[i] = angle_rad
        self.speed[i] = 0.0
        self._lost[i] = 0.0

    def record_gap(self, for_s: float) -> None:
        """Record a time without goals, in which the servos braked to their last ones.

        Slow speed lost in a short gap is regained faster than it was reached (``seek``).
        """
        short = for_s <= SHORT_GAP_S
        for i, limit in enumerate(self.limits):
            speed, lost = self.speed[i], self._lost[i]
            left = abs(speed) - limit.accel_rad_s2 * for_s
            if not (short and self._slow[i]):
                self._lost[i] = 0.0
            elif lost * speed < 0.0 or abs(speed) > abs(lost):
                self._lost[i] = speed
            self.speed[i] = copysign(left, speed) if left > 0.0 else 0.0
            self.goal[i] = self.command[i]

    def forget_gaps(self, i: int) -> None:
        """Discard the speed to regain, as a slow motion starts."""
        self._lost[i], self._slow[i] = 0.0, False

    def set_limit(self, i: int, limit: JointLimit) -> None:
        """Change the limit."""
        self.limits[i] = limit
        self.goal[i] = self.command[i]
        self.reset_range(i)

    def keeps_limit(self, i: int, limit: JointLimit) -> bool:
        """Return whether a joint's present motion keeps another limit."""
        p, v = self.command[i], self.speed[i]
        room = limit.high_rad - p if v > 0.0 else p - limit.low_rad
        return abs(v) <= limit.speed_rad_s and v * v <= 2.0 * limit.accel_rad_s2 * max(0.0, room)

    def reset_range(self, i: int) -> None:
        """Set a joint's range to its limit, extended to its command; remove walls."""
        limit, now = self.limits[i], self.command[i]
        self.low[i], self.high[i] = min(limit.low_rad, now), max(limit.high_rad, now)

    def wall_below(self, i: int, wall_rad: float) -> None:
        """Keep a joint above a wall."""
        self.low[i] = max(self.low[i], wall_rad)

    def wall_above(self, i: int, wall_rad: float) -> None:
        """Keep a joint below a wall."""
        self.high[i] = min(self.high[i], wall_rad)

    def keeps_below(self, i: int, wall_rad: float) -> bool:
        """Return whether a joint is below a wall and can stop there."""
        return max(self.command[i], self._stop(i)) <= wall_rad + _ROUNDING_RAD

    def keeps_above(self, i: int, wall_rad: float) -> bool:
        """Return whether a joint is above a wall and can stop there."""
        return min(self.command[i], self._stop(i)) >= wall_rad - _ROUNDING_RAD

    def _stop(self, i: int) -> float:
        """Return where a joint comes to rest if it brakes now."""
        v = self.speed[i]
        return self.command[i] + 0.5 * v * abs(v) / self.limits[i].accel_rad_s2

    def follow(self, i: int, desired: float, dt_s: float) -> bool:
        """Move to the desired angle if that keeps every limit; return whether it does.

        A joint that is still catching up would overshoot; use ``chase`` for it.
        """
        limit = self.limits[i]
        accel = limit.accel_rad_s2
        p, v = self.command[i], self.speed[i]
        wanted = (desired - p) / dt_s
        step, top = accel * dt_s, limit.speed_rad_s
        if not (-top <= wanted <= top and v - step <= wanted <= v + step):
            return False
        if not -step * dt_s <= self.goal[i] - p <= step * dt_s:
            return False
        brake = 0.5 * wanted * wanted / accel
        if desired + brake > self.high[i] if wanted > 0.0 else desired - brake < self.low[i]:
            return False
        self.command[i] = self.goal[i] = desired
        self.speed[i] = wanted
        return True

    def chase(self, i: int, desired: float, dt_s: float, top: float, soft: float) -> None:
        """Catch up with a moving desired angle and match its speed."""
        target = min(max(desired, self.low[i]), self.high[i])
        along = (target - self.goal[i]) / dt_s
        if not -top <= along <= top:  # it jumped or is too fast to match
            along = 0.0
        self.seek(i, desired, dt_s, top, soft, along)

    def seek(
        self,
        i: int,
        desired: float,
        dt_s: float,
        top: float,
        soft: float,
        along: float = 0.0,
        regain: float = 0.0,
    ) -> None:
        """Move towards a desired angle and stop there, with limited speed and acceleration.

        Braking may use the joint's full acceleration, as a slow motion may start at full speed.

        Args:
            i: Number of the joint.
            desired: Desired angle.
            dt_s: Length of the step.
            top: Highest speed; the joint's own limit also applies.
            soft: Acceleration; the joint's own limit also applies.
            along: Speed of the goal.
            regain: Acceleration up to the speed before a short gap. With ``soft`` alone, a joint
                that sometimes misses a tick would hardly move.
        """
        top = min(top, self.limits[i].speed_rad_s)
        soft = min(soft, self.limits[i].accel_rad_s2)
        regain = min(regain, self.limits[i].accel_rad_s2)
        self._slow[i] = regain > 0.0
        target = min(max(desired, self.low[i]), self.high[i])
        gap = target - along * dt_s - self.command[i]
        closing = reachable_speed(abs(gap), soft, dt_s)
        self.goal[i] = target
        self._step(i, along + (closing if gap >= 0.0 else -closing), dt_s, top, soft, regain)

    def brake(self, i: int, dt_s: float) -> None:
        """Stop with the joint's full acceleration."""
        limit = self.limits[i]
        self._step(i, 0.0, dt_s, limit.speed_rad_s, limit.accel_rad_s2)
        self.goal[i] = self.command[i]
        self._lost[i] = 0.0

    def _step(
        self, i: int, wanted: float, dt_s: float, top: float, soft: float, regain: float = 0.0
    ) -> None:
        """Move at the speed nearest to ``wanted`` that keeps every limit."""
        accel = self.limits[i].accel_rad_s2
        p, v, low, high = self.command[i], self.speed[i], self.low[i], self.high[i]
        most, least = _highest_speed(v, accel, soft, dt_s), -_highest_speed(-v, accel, soft, dt_s)
        lost = self._lost[i]
        if lost != 0.0:
            if lost > 0.0 <= v:
                most = max(most, min(lost, v + regain * dt_s))
            elif lost < 0.0 >= v:
                least = min(least, max(lost, v - regain * dt_s))
            if least <= wanted <= most or wanted * lost <= 0.0:  # the wanted speed is reached
                self._lost[i] = 0.0
        chosen = most if wanted > most else least if wanted < least else wanted
        # Top speed, range and braking distance override ``soft``, never the joint's own
        # acceleration, which suffices for them because every step is made here.
        if chosen > 0.0 or v > 0.0:
            up = min(top, reachable_speed(high - p, accel, dt_s))
            if chosen > up:
                chosen = max(up, v - accel * dt_s)
        if chosen < 0.0 or v < 0.0:
            down = -min(top, reachable_speed(p - low, accel, dt_s))
            if chosen < down:
                chosen = min(down, v + accel * dt_s)
        moved = p + chosen * dt_s
        moved = low if moved < low else high if moved > high else moved
        self.command[i] = moved
        self.speed[i] = (moved - p) / dt_s


def reachable_speed(room_rad: float, accel: float, dt_s: float) -> float:
    """Return the highest speed for one step after which a stop within the room is possible.

    Solves v dt + v^2 / 2a = room for v.
    """
    half = accel * dt_s
    return sqrt(half * half + 2.0 * accel * max(0.0, room_rad)) - half


def _highest_speed(v: float, accel: float, soft: float, dt_s: float) -> float:
    """Return the highest speed after one step: full braking to rest, then soft acceleration."""
    if v >= 0.0:
        return v + soft * dt_s
    at_rest_s = -v / accel
    return v + accel * dt_s if at_rest_s >= dt_s else soft * (dt_s - at_rest_s)


class LimitChange:
    """The present limits of all joints, and pending new ones until joints can keep them.

    Attributes:
        waiting: Joints that come to rest before their new limits apply.
        outside: Joints that are outside their ranges.

    Args:
        motion: Limiter with the limits of the servos' own configuration.
    """

    def __init__(self, motion: MotionLimiter) -> None:
        self._motion = motion
        self._own = self._wanted = tuple(motion.limits)
        self.waiting: set[int] = set()
        self.outside: set[int] = set()

    def reset(self) -> None:
        """Apply all limits immediately."""
        self._motion.limits[:] = self._wanted
        self.waiting.clear()

    def retune(self, wanted: tuple[JointLimit, ...]) -> list[int]:
        """Change the limits within the servos' own, each as soon as its joint can keep it.

        Returns:
            The joints whose servos allow less.
        """
        self._wanted = tuple(map(JointLimit.reduced_to, wanted, self._own))
        rows = zip(self._wanted, self._motion.limits, strict=True)
        self.waiting = {i for i, (limit, present) in enumerate(rows) if limit != present}
        for i in range(len(wanted)):
            self._motion.reset_range(i)  # walls of a collision that no longer applies
        return [i for i, limit in enumerate(self._wanted) if limit != wanted[i]]

    def begin(self, i: int, angle_rad: float) -> None:
        """Start a joint at its present goal on the bus, at rest."""
        low, high = self._own[i][:2]
        self._motion.restart(i, min(max(angle_rad, low), high))
        self._update_outside(i)

    def step(self, walls: bool) -> None:
        """Apply limits that joints can keep now.

        Args:
            walls: Whether there are walls against collisions, made for the present accelerations.
        """
        if self.waiting:
            limits, motion = self._wanted, self._motion
            for i in sorted(self.waiting):
                free = not walls and motion.keeps_limit(i, limits[i])
                if motion.speed[i] == 0.0 or free:
                    motion.set_limit(i, limits[i])
                    self.waiting.discard(i)
                    self._update_outside(i)
        for i in sorted(self.outside):
            self._update_outside(i)

    def _update_outside(self, i: int) -> None:
        """Update whether a joint is outside its range."""
        limit, now = self._motion.limits[i], self._motion.command[i]
        if limit.low_rad - _ROUNDING_RAD <= now <= limit.high_rad + _ROUNDING_RAD:
            self.outside.discard(i)
        else:
            self.outside.add(i)
        self._motion.reset_range(i)


LATE_PERIODS = 1.5
"""A tick is late if it starts more than this number of periods after the previous one."""

STEADY_TICKS, SLOWEST_S = 5, 0.05
"""After this number of late ticks in a row, at most this interval apart, the pace is changed: the
bus or the host is too slow for its rate. If each counted as a gap, a neck would reach only 10
deg/s.
"""


class LateTicks:
    """A detector of late ticks, after which acceleration is limited for some time.

    Attributes:
        soft_until_s: End of the limited acceleration.

    Args:
        period_s: Nominal time between ticks.
    """

    def __init__(self, period_s: float) -> None:
        self.period_s = period_s
        self.soft_until_s = -inf
        self._recent_s: deque[float] = deque([period_s], STEADY_TICKS)

    def split(self, since_s: float, t_s: float, soft_s: float) -> tuple[float, float]:
        """Return the time to move for, and the time without goals, 0 if the tick is not late.

        Args:
            since_s: Time since the previous tick.
            t_s: Present time.
            soft_s: Duration of the limited acceleration after a late tick.
        """
        recent_s = self._recent_s
        if since_s <= LATE_PERIODS * self.period_s:
            recent_s.append(since_s)
            return since_s, 0.0
        pace_s = max(self.period_s, min(SLOWEST_S, *recent_s))
        recent_s.append(since_s)
        if since_s <= LATE_PERIODS * pace_s:
            return since_s, 0.0
        self.soft_until_s = t_s + soft_s
        return pace_s, since_s - pace_s
