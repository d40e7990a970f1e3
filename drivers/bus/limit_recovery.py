"""Servos that stand outside their limits and are led inside slowly.

A goal outside is never sent, so such a servo gets the nearest end and a low speed of its own.
It has arrived when it is at that end, or stands still short of it under its load. Until then
plans must not run on, or the servo leaps after them as soon as its full speed comes back: each of
its answers is marked ``rearmed``, which makes plans begin where it is.
"""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from gazerig.drivers.types import ServoConfig

ENTRY_DEG_S = 30.0
"""Speed at a joint that is brought inside its limits."""

NEAR_STEPS = 6
"""Friction stops a servo so near its goal."""

STILL_STEPS, STILL_S = 2, 0.3
"""A servo that moves no farther in such a time stands still."""


class _Place(NamedTuple):
    """Where a servo was, and since when it has not gone farther."""

    steps: float
    since_s: float


class SlowEntry:
    """Knows which servos are on their slow way into their limits.

    Args:
        setups: the servos by id.

    places: those on their way by id, and where each was, None before it was looked
    """

    def __init__(self, setups: Mapping[int, ServoConfig]) -> None:
        self._setups = setups
        self.places: dict[int, _Place | None] = {}

    def __contains__(self, servo_id: object) -> bool:
        return servo_id in self.places

    @property
    def ids(self) -> tuple[int, ...]:
        """Return those on their way."""
        return tuple(self.places)

    def begin(self, ids: Iterable[int]) -> None:
        """Lead these inside, and no others any more."""
        self.places = dict.fromkeys(ids)

    def add_outside(self, servo_id: int, steps: int) -> None:
        """Lead one inside if it stands outside."""
        if self._outside(servo_id, steps):
            self.places[servo_id] = None

    def clear(self) -> None:
        """Forget all of them."""
        self.places.clear()

    def arrived(self, servo_id: int, steps: float, now_s: float) -> bool:
        """Return whether one on its way, which is here now, has come to its limits."""
        if not self._outside(servo_id, steps, NEAR_STEPS):
            return True
        before = self.places[servo_id]
        if before is None or abs(steps - before.steps) > STILL_STEPS:
            self.places[servo_id] = _Place(steps, now_s)
            return False
        return now_s - before.since_s >= STILL_S

    def end(self, servo_id: int) -> None:
        """Let one go at its full speed again."""
        self.places.pop(servo_id, None)

    def _outside(self, servo_id: int, steps: float, room_steps: int = 0) -> bool:
        setup = self._setups[servo_id]
        return not setup.min_steps - room_steps <= steps <= setup.max_steps + room_steps


def entry_speed_steps_s(setup: ServoConfig, steps_per_turn: float) -> float:
    """Return the speed of a servo that is led inside: never above its own top speed."""
    wanted = setup.entry_speed_steps_s
    slow = ENTRY_DEG_S / 360.0 * steps_per_turn if wanted is None else wanted
    return min(slow, setup.max_speed_steps_s)
