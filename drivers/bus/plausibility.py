"""Plausibility check that separates real positions of a joint from those damaged by noise.

The checksum of an answer misses some damage: a sum of one byte misses one in 256 damaged answers, a
CRC of two bytes one in 65,536. Between two answers a joint moves no farther than its motor can turn
it, and while answers arrive damaged, no farther than it would by its speed so far. A position
farther away is not returned as fresh. A joint that is at another position because it was pushed by
hand, was restarted or is off by a turn reports that position repeatedly: it is believed after
several answers.
"""

from collections.abc import Sequence
from math import isnan, nan
from operator import sub
from typing import NamedTuple

SLACK_STEPS = 64
"""Difference allowed between two answers at any time interval: play and jitter."""

LATE_S = 0.01
"""Longest time between the moment a servo answers and the moment the answer is read."""

MARGIN = 1.5
"""Factor by which a joint may exceed the no-load speed of its motor, when pushed or falling."""

AGREEING = 3
"""Number of consecutive agreeing answers after which any position is believed."""

DISTURBED_S = 5.0
"""Time after a damaged answer during which the line counts as disturbed."""

NEAR_STEPS, NEAR_LATE_S = 4, 0.002
"""Distance allowed on a disturbed line from the way at the speed so far, and jitter of times."""

FULL_SPEED_S = 0.03
"""A small servo reaches full speed in this time."""


class _Place(NamedTuple):
    """A position of a joint, its time, and the speed with which it was reached."""

    steps: float
    at_s: float
    speed_steps_s: float = 0.0


class Plausibility:
    """Last position of each servo, and the distance that it can have moved since.

    Args:
        fastest_steps_s: No-load speed of each servo's motor.
    """

    def __init__(self, fastest_steps_s: Sequence[float]) -> None:
        self._fastest = tuple(fastest_steps_s)
        self._pace = tuple(MARGIN * speed for speed in fastest_steps_s)
        self._free = tuple(SLACK_STEPS + LATE_S * pace for pace in self._pace)
        self._nearest = min(self._free, default=0.0)
        self.disturbed_until_s = float("-inf")
        self.forget()

    def forget(self) -> None:
        """Accept the next positions without a check, for example after a lost port."""
        count = len(self._fastest)
        self._places: list[_Place | None] = [None] * count
        self._odd: list[list[_Place]] = [[] for _ in range(count)]
        # Positions and time of the last whole answer and of the one before; nan: of none.
        self._last: Sequence[int] = ()
        self._before: Sequence[int] = ()
        self._last_s = self._before_s = nan

    def record_damaged(self, at_s: float) -> None:
        """Record that an answer was damaged: for a while positions are checked more strictly."""
        self.disturbed_until_s = at_s + DISTURBED_S

    def record(self, slot: int, position: int, at_s: float) -> None:
        """Record a position of a servo from another source than its cyclic answer."""
        self._divide()
        self._places[slot] = _Place(position, at_s)
        self._odd[slot].clear()

    def are_plausible(self, positions: Sequence[int], at_s: float) -> bool:
        """Return whether all positions of one answer are plausible; only then are they recorded."""
        since_s = at_s - self._last_s
        if since_s >= 0.0:  # nan if they were not read together
            ways = tuple(map(sub, positions, self._last))
            if max(ways) > self._nearest or min(ways) < -self._nearest:
                for way, free, pace in zip(ways, self._free, self._pace, strict=True):
                    if not -free - pace * since_s <= way <= free + pace * since_s:
                        return False
        elif not all(
            self._is_near(i, place, steps, at_s)
            for i, (place, steps) in enumerate(zip(self._places, positions, strict=True))
        ):
            return False
        self._before, self._before_s = self._last, self._last_s
        self._last, self._last_s = positions, at_s
        return True

    def is_plausible(self, slot: int, position: int, at_s: float) -> bool:
        """Return whether one servo's position is plausible; call it once for every answer."""
        self._divide()
        last, odd = self._places[slot], self._odd[slot]
        speed_steps_s = 0.0
        if not self._is_near(slot, last, position, at_s):
            if odd and not self._is_near(slot, odd[-1], position, at_s):
                odd.clear()
            odd.append(_Place(position, at_s))
            if len(odd) < AGREEING:
                return False
        elif last is not None and at_s > last.at_s:
            speed_steps_s = (position - last.steps) / (at_s - last.at_s)
        odd.clear()
        self._places[slot] = _Place(position, at_s, speed_steps_s)
        return True

    def _divide(self) -> None:
        """Turn the last whole answers into places of single servos."""
        if isnan(self._last_s):
            return
        since_s = self._last_s - self._before_s
        before = self._before if since_s > 0.0 else self._last
        self._places = [
            _Place(steps, self._last_s, (steps - past) / since_s if since_s > 0.0 else 0.0)
            for steps, past in zip(self._last, before, strict=True)
        ]
        self._last_s = nan

    def _is_near(self, slot: int, place: _Place | None, position: float, at_s: float) -> bool:
        if place is None:
            return True
        since_s = max(0.0, at_s - place.at_s)
        way, reach = position - place.steps, self._free[slot] + self._pace[slot] * since_s
        if at_s >= self.disturbed_until_s:
            return abs(way) <= reach
        if since_s > FULL_SPEED_S:  # it may be anywhere: only agreeing answers are believed
            return False
        ahead = since_s * place.speed_steps_s
        room = (
            NEAR_STEPS
            + NEAR_LATE_S * abs(place.speed_steps_s)
            + self._fastest[slot] / FULL_SPEED_S * since_s**2
        )
        return -min(reach, room - min(0.0, ahead)) <= way <= min(reach, room + max(0.0, ahead))
