"""Goals kept inside the limits of their servos."""

from collections.abc import Iterable, Mapping, Sequence
from operator import le
from typing import NamedTuple

from gazerig.drivers.types import ServoConfig


def clip_goals(
    steps: Sequence[int], lowest: Sequence[int], highest: Sequence[int]
) -> Sequence[int]:
    """Return goals inside their ranges.

    Raises:
        ValueError: a goal is not a number, or their number is wrong.
    """
    as_many = len(steps) == len(lowest)
    if as_many and all(map(le, lowest, steps)) and all(map(le, steps, highest)):
        return steps
    return [
        goal if low <= goal <= high else _nearest_limit(goal, low, high)
        for goal, low, high in zip(steps, lowest, highest, strict=True)
    ]


def _nearest_limit(goal: float, low: int, high: int) -> int:
    if goal != goal:
        raise ValueError("a goal is not a number: every goal must be a whole number of steps")
    return low if goal < low else high


ENTRY_DEG_S = 30.0
"""Speed of a joint that returns into its limits."""

FAR_DEG = 10.0
"""Distance of a joint outside its range from which its measured angle is not believed."""

FAR_CAUSES = "a slipped horn, a changed homing offset or extended position mode?"
"""Likely causes of such an angle, for messages."""

NEAR_STEPS = 6
"""Distance from its goal at which friction may stop a servo."""

STILL_STEPS, STILL_S = 2, 0.3
"""A servo that moves no farther than this in this time has stopped."""


class _LastPosition(NamedTuple):
    """Last position of a servo, and the time since which it has not moved."""

    steps: float
    since_s: float


class LimitRecovery:
    """Servos that move slowly into their limits.

    A goal outside is never sent, so such a servo gets the nearest limit as its goal and a low
    speed. It has arrived when it is at that limit, or stops short of it under its load. Until then
    plans must not advance, or the servo would jump to them as soon as its full speed is restored.
    So each of its answers is marked ``rearmed``, which makes plans begin at its position.

    places: last position of each such servo by id, None before it was read
    """

    def __init__(self, setups: Mapping[int, ServoConfig]) -> None:
        self._setups = setups
        self.places: dict[int, _LastPosition | None] = {}

    def __contains__(self, servo_id: object) -> bool:
        return servo_id in self.places

    @property
    def ids(self) -> tuple[int, ...]:
        """Return the ids of these servos."""
        return tuple(self.places)

    def begin(self, ids: Iterable[int]) -> None:
        """Start recovery of these servos; earlier ones are no longer included."""
        self.places = dict.fromkeys(ids)

    def add_if_outside(self, servo_id: int, steps: int) -> None:
        """Start recovery of a servo if it is outside its limits."""
        if self._is_outside(servo_id, steps):
            self.places[servo_id] = None

    def clear(self) -> None:
        """Remove all servos."""
        self.places.clear()

    def has_arrived(self, servo_id: int, steps: float, now_s: float) -> bool:
        """Return whether a recovering servo, now at ``steps``, has reached its limits."""
        if not self._is_outside(servo_id, steps, NEAR_STEPS):
            return True
        before = self.places[servo_id]
        if before is None or abs(steps - before.steps) > STILL_STEPS:
            self.places[servo_id] = _LastPosition(steps, now_s)
            return False
        return now_s - before.since_s >= STILL_S

    def end(self, servo_id: int) -> None:
        """Remove a servo, which then moves at full speed again."""
        self.places.pop(servo_id, None)

    def _is_outside(self, servo_id: int, steps: float, room_steps: int = 0) -> bool:
        setup = self._setups[servo_id]
        return not setup.min_steps - room_steps <= steps <= setup.max_steps + room_steps


def far_outside_steps(setup: ServoConfig, steps: float) -> str:
    """Return where a servo is, if it is too far outside its limits for torque; else ""."""
    if setup.min_steps - setup.far_steps <= steps <= setup.max_steps + setup.far_steps:
        return ""
    limits = f"{setup.min_steps}..{setup.max_steps}"
    return f"is at step {steps:.0f}, far outside its range {limits}: {FAR_CAUSES}"


def entry_speed_steps_s(setup: ServoConfig, steps_per_turn: float) -> float:
    """Return the speed of a servo that returns into its limits: never above its top speed."""
    wanted = setup.entry_speed_steps_s
    slow = ENTRY_DEG_S / 360.0 * steps_per_turn if wanted is None else wanted
    return min(slow, setup.max_speed_steps_s)
