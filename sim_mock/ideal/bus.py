"""Servos without bytes: goals in, a first-order lag out.

For simulations that test code above the bus: no packets, no motor, no faults, no heat. The lag
has a closed form, so the angles do not depend on the times of reads.
"""

from collections.abc import Callable, Sequence
from itertools import repeat
from math import exp
from operator import add, gt, lt, mul, sub, truediv
from typing import NamedTuple

from gazerig.drivers.types import BusHealth, Feedback, ServoConfig

LAG_S = 0.008
"""Time constant; an emulated eye with the desk rig's gains has the same lag."""
WARM_C = 30.0
_TO_WHOLE = repeat(1.5 * 2.0**52)
"""Rounds as ``round`` does when added and subtracted: such large floats have no fraction."""

Steps = tuple[float, ...]


class _Motion(NamedTuple):
    """Positions of the shafts at a time, in steps, and the goals that they follow since."""

    at_s: float
    from_steps: Steps
    goals_steps: tuple[int, ...] | None

    def steps(self, now_s: float) -> Steps:
        """Return the positions now; without goals the torque is off and the shafts do not move."""
        goals = self.goals_steps
        if goals is None or now_s <= self.at_s:
            return self.from_steps
        left = exp((self.at_s - now_s) / LAG_S)
        ahead = map(mul, map(sub, self.from_steps, goals), repeat(left))
        return tuple(map(add, goals, ahead))


class IdealBus:
    """All servos of a rig; a gazerig.drivers.types.ServoBus."""

    def __init__(
        self,
        configs: Sequence[ServoConfig],
        start_steps: Sequence[float],
        measured: Sequence[bool],
        now_s: Callable[[], float],
    ) -> None:
        self._now_s = now_s
        # One value, replaced as a whole, because the camera may read it from another thread.
        self._motion = _Motion(now_s(), tuple(map(float, start_steps)), None)
        self._read = self._motion.at_s, self._motion.from_steps
        self._events: tuple[str, ...] = ()
        self._measured = tuple(measured)
        self._warm = tuple([WARM_C if one else None for one in self._measured])
        self._lowest = tuple([one.min_steps for one in configs])
        self._highest = tuple([one.max_steps for one in configs])

    @property
    def has_torque(self) -> bool:
        """Return whether the shafts follow goals."""
        return self._motion.goals_steps is not None

    def positions_steps(self) -> Steps:
        """Return the true positions now, in the order of the servos."""
        return self._motion.steps(self._now_s())

    def open(self) -> None:
        """Report the servos as set up; nothing needs to be opened."""
        self._events = ("servos set up",)

    def close(self) -> None:
        """Do nothing: there is no port."""

    def read(self, now_s: float) -> Feedback:
        """Return the positions, rounded to steps, and the mean speeds since the last call."""
        steps, (last_s, last) = self._motion.steps(now_s), self._read
        self._read = now_s, steps
        passed_s = now_s - last_s
        speeds = (
            tuple(map(truediv, map(sub, steps, last), repeat(passed_s)))
            if passed_s > 0.0
            else (0.0,) * len(steps)
        )
        count = len(steps)
        zeros, no = (0.0,) * count, (False,) * count
        return Feedback(
            tuple(map(sub, map(add, steps, _TO_WHOLE), _TO_WHOLE)), speeds, zeros,
            (now_s,) * count, self._warm, (None,) * count, (self.has_torque,) * count,
            ("",) * count, self._measured, no, (),
        )  # fmt: skip

    def enable_torque(self) -> tuple[int, ...]:
        """Set the goals to the present positions, within the limits, and follow them."""
        return self._follow([round(x) for x in self.positions_steps()])

    def write(self, goals_steps: Sequence[int]) -> None:
        """Follow these goals, within the limits; with torque off they change nothing."""
        if self.has_torque:
            self._follow(goals_steps)

    def disable_torque(self) -> None:
        """Stop the shafts at their positions."""
        now_s = self._now_s()
        self._motion = _Motion(now_s, self._motion.steps(now_s), None)

    def faults(self) -> tuple[str, ...]:
        """Return no faults."""
        return ()

    def events(self) -> tuple[str, ...]:
        """Return the events since the last call."""
        events, self._events = self._events, ()
        return events

    def health(self) -> BusHealth:
        """Report that no byte was sent."""
        return BusHealth(0, 0, {})

    def _follow(self, goals_steps: Sequence[int]) -> tuple[int, ...]:
        """Start a motion to goals; return the goals within the limits."""
        goals, low, high = tuple(goals_steps), self._lowest, self._highest
        if True in map(lt, goals, low) or True in map(gt, goals, high):
            goals = tuple(map(min, map(max, goals, low), high))
        now_s = self._now_s()
        self._motion = _Motion(now_s, self._motion.steps(now_s), goals)
        return goals
