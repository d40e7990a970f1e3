"""The profile generator of an emulated servo: from a goal to a position for every millisecond.

Units: steps and milliseconds. The path to a goal is planned once, in closed form, from the
generator's position and speed: a phase that reaches the cruise speed, a constant phase, a braking
phase. So its values do not depend on when it is called.
Source: ROBOTIS e-Manual, X series, "What is the Profile".
"""

from math import ceil, copysign, sqrt

STEP, RECTANGLE, TRIANGLE, TRAPEZOID = 0, 1, 2, 3
"""Profile types as numbered by bits 4-5 of Moving Status (123)."""


class PositionProfile:
    """Reference position and speed of the shaft.

    r, v: position in steps and speed in steps/ms now
    goal: end of the path
    kind: profile type
    running: whether it has not reached its end
    """

    __slots__ = (
        "_cruise", "_from", "_out", "_p1", "_slow", "_start", "_t", "_t1", "_t2", "_t3",
        "goal", "kind", "r", "running", "v",
    )  # fmt: skip

    def __init__(self, position: float) -> None:
        self.rest(position)

    @property
    def is_jump(self) -> bool:
        """Return whether it has no speed to follow: Velocity Trajectory of a step is 0."""
        return self.kind == STEP

    def rest(self, position: float) -> None:
        """Rest at a position."""
        self._t = 0
        self.r = self.goal = position
        self.v = 0.0
        self.kind = STEP
        self.running = False

    def state(self) -> tuple[float, ...]:
        """Return the state within its plan, for ``restore``."""
        return self._t, self.r, self.v, self.running

    def restore(self, state: tuple[float, ...]) -> None:
        """Return to an earlier state of the same plan."""
        t, self.r, self.v, running = state
        self._t = int(t)
        self.running = bool(running)

    def step(self, goal: float) -> None:
        """Jump to a goal with the next millisecond."""
        self.goal = goal
        self.kind = STEP
        self.running = True
        self._t = 0
        self._t1 = self._t2 = self._t3 = 0.0
        self._from = self._p1 = goal
        self._start = self._out = self._cruise = self._slow = 0.0

    def plan_by_velocity(self, goal: float, cruise: float, ramp: float) -> None:
        """Plan to a goal at a speed (steps/ms, 0: step) with a ramp (steps/ms2, 0: rectangle)."""
        if cruise <= 0.0:
            self.step(goal)
        elif ramp <= 0.0:
            # The usual case, two hundred times a second, is planned here directly.
            distance = goal - self.r
            self.goal, self.kind, self.running = goal, RECTANGLE, True
            self._t, self._t1, self._p1, self._slow = 0, 0.0, self.r, 0.0
            self._from, self._start, self._out = self.r, 0.0, 0.0
            self._cruise = cruise if distance >= 0.0 else -cruise
            self._t2 = self._t3 = distance / self._cruise
        else:
            self._ramps(goal, cruise, ramp)

    def plan_by_time(self, goal: float, total_ms: float, ramp_ms: float) -> None:
        """Plan to a goal in a time (0: step); each ramp takes at most half of it."""
        distance = goal - self.r
        if total_ms <= 0.0:
            self.step(goal)
        elif ramp_ms <= 0.0:
            self._plan(goal, RECTANGLE, distance / total_ms, 0.0, total_ms, 0.0)
        else:
            ramp_ms = min(ramp_ms, 0.5 * total_ms)
            cruise = (distance - 0.5 * self.v * ramp_ms) / (total_ms - ramp_ms)
            kind = TRIANGLE if ramp_ms == 0.5 * total_ms else TRAPEZOID
            self._plan(goal, kind, cruise, ramp_ms, total_ms - 2.0 * ramp_ms, ramp_ms)

    def _ramps(self, goal: float, cruise: float, ramp: float) -> None:
        """Plan by velocity and acceleration from the present speed."""
        distance, v, top = goal - self.r, self.v, cruise
        side = 1.0 if distance >= v * abs(v) / (2.0 * ramp) else -1.0
        start, ahead = side * v, side * distance
        if start <= cruise:
            square = ramp * ahead + 0.5 * start * start
            if square < cruise * cruise:
                top = sqrt(square) if square > 0.0 else 0.0
        first = abs(top - start) / ramp
        left = ahead - 0.5 * (start + top) * first - 0.5 * top * top / ramp
        flat = left / top if left > 0.0 and top > 0.0 else 0.0
        kind = TRAPEZOID if flat > 0.0 else TRIANGLE
        self._plan(goal, kind, side * top, first, flat, top / ramp)

    def _plan(
        self, goal: float, kind: int, cruise: float, first: float, flat: float, last: float
    ) -> None:
        """Set a plan: phases of ``first``, ``flat`` and ``last`` ms around a cruise speed."""
        start = self.v if first > 0.0 else cruise
        self.goal, self.kind, self.running = goal, kind, True
        self._t, self._from, self._start, self._cruise = 0, self.r, start, cruise
        self._t1, self._t2, self._t3 = first, first + flat, first + flat + last
        self._out = 0.5 * (cruise - start) / first if first > 0.0 else 0.0
        self._p1 = self.r + 0.5 * (start + cruise) * first
        self._slow = 0.5 * cruise / last if last > 0.0 else 0.0

    def advance(self, ticks: int) -> list[float]:
        """Advance by some milliseconds and return the position after each."""
        if not self.running:
            return [self.goal] * ticks
        begun, t1, t2, t3, goal = self._t, self._t1, self._t2, self._t3, self.goal
        if t3 <= begun + 1:
            self.r, self.v, self.running = goal, 0.0, False
            return [goal] * ticks
        begin, start, out, p1 = self._from, self._start, self._out, self._p1
        cruise, slow, end = self._cruise, self._slow, begun + ticks
        times = range(begun + 1, end + 1)
        if end < t1:  # the usual cases: all in one phase
            path = [begin + t * (start + t * out) for t in times]
            self.v = start + 2.0 * end * out
        elif t1 <= begun + 1 and end < t2:
            path = [p1 + (t - t1) * cruise for t in times]
            self.v = cruise
        else:
            path = [
                begin + t * (start + t * out)
                if t < t1
                else p1 + (t - t1) * cruise
                if t < t2
                else goal - (t3 - t) * (t3 - t) * slow
                if t < t3
                else goal
                for t in times
            ]
            self._speed(end)
        self.r = path[-1]
        self._t = end
        return path

    def _at(self, t: int) -> float:
        """Return the position at a time of the plan."""
        if t >= self._t3:
            return self.goal
        if t >= self._t2:
            left = self._t3 - t
            return self.goal - left * left * self._slow
        if t >= self._t1:
            return self._p1 + (t - self._t1) * self._cruise
        return self._from + t * (self._start + t * self._out)

    def skip(self, ticks: int) -> None:
        """Advance by many milliseconds in one step."""
        if not self.running:
            return
        self._t = t = self._t + ticks
        self.r = self._at(t)
        self._speed(t)

    def _speed(self, t: int) -> None:
        """Update the speed to a time of the plan."""
        if t < self._t1:
            self.v = self._start + 2.0 * t * self._out
        elif t < self._t2:
            self.v = self._cruise
        elif t < self._t3:
            self.v = 2.0 * (self._t3 - t) * self._slow
        else:
            self.v = 0.0
            self.running = False


class SpeedProfile:
    """Reference of the velocity mode: a ramp to a speed.

    ``r`` continues from its start; only its changes matter.
    """

    is_jump = False

    __slots__ = ("_ramp", "goal", "kind", "r", "running", "v")

    def __init__(self, position: float, speed: float) -> None:
        self.r, self.v, self.goal = position, speed, 0.0
        self._ramp = 0.0
        self.kind = STEP
        self.running = False

    def state(self) -> tuple[float, ...]:
        """Return the state within its plan, for ``restore``."""
        return self.r, self.v, self.running

    def restore(self, state: tuple[float, ...]) -> None:
        """Return to an earlier state of the same plan."""
        self.r, self.v, running = state
        self.running = bool(running)

    def set_goal(self, speed: float, ramp: float) -> None:
        """Plan to a speed (steps/ms) with a ramp (steps/ms2, 0: immediately)."""
        self.goal = speed
        self._ramp = ramp
        self.kind = TRAPEZOID if ramp > 0.0 else STEP
        self.running = speed != self.v or speed != 0.0

    def advance(self, ticks: int) -> list[float]:
        """Advance by some milliseconds and return the position after each."""
        r, v, goal, ramp, path = self.r, self.v, self.goal, self._ramp, []
        for _ in range(ticks):
            if v != goal:
                left = goal - v
                v = goal if ramp <= 0.0 or abs(left) <= ramp else v + (ramp if left > 0 else -ramp)
            r += v
            path.append(r)
        self.r, self.v = r, v
        self.running = v != 0.0 or goal != 0.0
        return path

    def skip(self, ticks: int) -> None:
        """Advance by many milliseconds in one step."""
        left = self.goal - self.v
        ramping = min(ticks, ceil(abs(left) / self._ramp)) if self._ramp > 0.0 else 0
        end = self.goal if ramping < ticks else self.v + copysign(self._ramp * ramping, left)
        self.r += 0.5 * (self.v + end) * ramping + end * (ticks - ramping)
        self.v = end
        self.running = end != 0.0 or self.goal != 0.0
