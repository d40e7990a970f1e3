"""The shaft of an emulated servo: profile generator, speed and acceleration limits, lag.

Inside: steps (4096 a turn) and milliseconds, one fixed internal step of 1 ms, so what
is read does not depend on how often it is read. No gravity, no backlash, no inertia of
a load: a loaded joint is given a larger ``spin_up_s``.
"""

from math import sqrt
from typing import NamedTuple

STEP_S = 0.001

# Both below the position register's own step, so the stop is not seen from outside.
STILL_STEPS = 0.02
STILL_STEPS_MS = 0.002


class Feel(NamedTuple):
    """How a shaft follows its profile.

    lag_s: time constant with which the position follows the profile
    spin_up_s: time to full no-load speed at constant torque; 57 ms takes an unloaded
        XL330-M077 to 500 deg/s in 12.5 ms. The same motor behind another gear has the same.
    rest_steps: where the joint sinks to without torque; None: it stays where it is
    """

    lag_s: float = 0.010
    spin_up_s: float = 0.0575
    rest_steps: float | None = None


SINK = Feel(lag_s=0.3)


class Shaft:
    """Position and speed of one output shaft, advanced in whole milliseconds.

    x, v:  position in steps and speed in steps/ms
    r, rv: what the profile generator asks for
    goal:  where the profile leads
    """

    __slots__ = (
        "_cruise", "_feel", "_lag", "_push", "_ramp", "_top",
        "effort", "goal", "r", "rv", "settled", "v", "x",
    )  # fmt: skip

    def __init__(self, position_steps: float, top_speed_steps_s: float, feel: Feel) -> None:
        self._feel = feel
        self._top = top_speed_steps_s * STEP_S
        self._push = self._top / (feel.spin_up_s / STEP_S)
        self._lag = feel.lag_s / STEP_S
        self._cruise = self._ramp = 0.0
        self.place(position_steps)

    def place(self, position_steps: float) -> None:
        """Put the shaft somewhere at rest, as a hand would."""
        self.x = self.r = self.goal = float(position_steps)
        self.v = self.rv = self.effort = 0.0
        self.settled = True

    def shape(self, cruise_steps_s: float, ramp_steps_s2: float) -> None:
        """Set the profile: both 0 a step, ramp 0 a rectangle, else a trapezoid."""
        self._cruise = cruise_steps_s * STEP_S
        self._ramp = ramp_steps_s2 * STEP_S * STEP_S

    def aim(self, goal_steps: float) -> None:
        """Lead the profile to a goal, from where the profile is now."""
        self.goal = float(goal_steps)
        self.settled = False

    def drive(self, goal_steps: float) -> None:
        """Switch the torque on: the profile starts at the present position."""
        self._lag = self._feel.lag_s / STEP_S
        self.r, self.rv = self.x, 0.0
        self.aim(goal_steps)

    def let_go(self) -> None:
        """Switch the torque off: stay, or sink to the resting place."""
        self.stop()
        if self._feel.rest_steps is not None:
            self._lag = SINK.lag_s / STEP_S
            self.r = self.goal = self._feel.rest_steps
            self.settled = False

    def stop(self) -> None:
        """Stop here and now."""
        self.place(self.x)

    def advance(self, ticks: int) -> None:
        """Move on by so many milliseconds."""
        if self.settled:
            return
        x, v, r, goal, cruise = self.x, self.v, self.r, self.goal, self._cruise
        lag, push, top, pushed = self._lag, self._push, self._top, 0.0
        # Up to this error v = e/lag brakes within the acceleration there is; beyond it
        # speed follows the parabola of constant braking that joins it smoothly.
        gentle = push * lag * lag
        for _ in range(ticks):
            if r != goal:
                if self._ramp:
                    r = self._follow(r, goal)
                else:
                    left = goal - r
                    if left > cruise > 0.0:
                        r += cruise
                    elif left < -cruise < 0.0:
                        r -= cruise
                    else:
                        r = goal
            e = r - x
            if -gentle <= e <= gentle:
                want = e / lag
            elif e > 0.0:
                want = sqrt(2.0 * push * (e - 0.5 * gentle))
            else:
                want = -sqrt(2.0 * push * (-e - 0.5 * gentle))
            pushed = want - v
            if pushed > push:
                pushed = push
            elif pushed < -push:
                pushed = -push
            v += pushed
            if v > top:
                v = top
            elif v < -top:
                v = -top
            x += v
            if -STILL_STEPS < e < STILL_STEPS and abs(v) < STILL_STEPS_MS and r == goal:
                x, v, pushed, self.settled = r, 0.0, 0.0, True
                break
        if not self._ramp:
            self.rv = 0.0 if r == goal else cruise if goal > r else -cruise
        self.x, self.v, self.r, self.effort = x, v, r, pushed / push

    def _follow(self, r: float, goal: float) -> float:
        """Advance a trapezoidal profile by 1 ms; re-plans from the speed it has."""
        ramp, rv = self._ramp, self.rv
        cruise = self._cruise
        if cruise == 0.0:
            self.rv = 0.0
            return goal
        left = goal - r
        # Speed from which the ramp still stops at the goal, half a millisecond early.
        want = min(cruise, sqrt(2.0 * ramp * abs(left) + 0.25 * ramp * ramp) - 0.5 * ramp)
        change = (want if left > 0.0 else -want) - rv
        rv += ramp if change > ramp else -ramp if change < -ramp else change
        if abs(left) <= ramp and abs(rv) <= 2.0 * ramp:
            self.rv = 0.0
            return goal
        self.rv = rv
        return r + rv

    @property
    def speed_steps_s(self) -> float:
        """Give the speed of the shaft."""
        return self.v / STEP_S

    @property
    def profile_speed_steps_s(self) -> float:
        """Give the speed the profile asks for."""
        return self.rv / STEP_S

    @property
    def top_share(self) -> float:
        """Give the speed as a share of the no-load speed, -1..1."""
        return self.v / self._top
