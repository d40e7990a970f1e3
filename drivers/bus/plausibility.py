"""Plausibility check that separates real positions of a joint from those damaged by noise.

The checksum of an answer misses some damage: a sum of one byte misses one in 256 damaged answers, a
CRC of two bytes one in 65,536. Between two answers a joint moves no farther than its motor can turn
it, and for a while after damage no farther than it would by its speed so far. A position farther
away is believed after several agreeing answers: the joint was pushed by hand, was restarted, or is
off by a turn.
"""

from collections.abc import Sequence
from math import inf
from operator import sub

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


class Plausibility:
    """Last position of each servo, and the distance that it can have moved since.

    Args:
        fastest_steps_s: No-load speed of each servo's motor.
    """

    def __init__(self, fastest_steps_s: Sequence[float]) -> None:
        self._fastest = tuple(fastest_steps_s)
        self._nearest = SLACK_STEPS + LATE_S * MARGIN * min(self._fastest, default=0.0)
        self.disturbed_until_s = -inf
        self.forget()

    def forget(self) -> None:
        """Accept the next positions without a check, for example after a lost port."""
        count = len(self._fastest)
        never = (inf,) * count, (-inf,) * count
        # Positions and their times: the last ones, and those before.
        self._last: tuple[Sequence[float], Sequence[float]] = never
        self._past: tuple[Sequence[float], Sequence[float]] = never
        self._odd: list[list[tuple[float, ...]]] = [[] for _ in range(count)]

    def record_damaged(self, at_s: float) -> None:
        """Record that an answer was damaged: for a while positions are checked more strictly."""
        self.disturbed_until_s = at_s + DISTURBED_S

    def record(self, slot: int, position: int, at_s: float) -> None:
        """Record a position of a resting servo from another source than its cyclic answer."""
        self._store(slot, (position, at_s, position, -inf))

    def are_plausible(self, positions: Sequence[int], times_s: Sequence[float]) -> bool:
        """Return whether all positions are near the last ones; if so, they are recorded.

        If some are not, each is to be checked on its own.
        """
        ways = tuple(map(sub, positions, self._last[0]))
        if max(ways) > self._nearest or min(ways) < -self._nearest:
            return False
        self._past, self._last = self._last, (positions, times_s)
        return True

    def is_plausible(self, slot: int, position: int, at_s: float) -> bool:
        """Return whether one servo's position is plausible; call it once for every answer."""
        odd = self._odd[slot]
        last = tuple([column[slot] for column in (*self._last, *self._past)])
        if last[0] != inf and self._is_near(slot, last, position, at_s):
            self._store(slot, (position, at_s, *last[:2]))
            return True
        if odd and not self._is_near(slot, odd[-1], position, at_s):
            odd.clear()
        odd.append((position, at_s, position, -inf))
        if last[0] != inf and len(odd) < AGREEING:
            return False
        self._store(slot, odd[-1])
        return True

    def _store(self, slot: int, place: tuple[float, ...]) -> None:
        columns = [list(column) for column in (*self._last, *self._past)]
        for column, value in zip(columns, place, strict=True):
            column[slot] = value
        last, last_s, past, past_s = columns
        self._last, self._past = (last, last_s), (past, past_s)
        self._odd[slot].clear()

    def _is_near(self, slot: int, place: tuple[float, ...], position: float, at_s: float) -> bool:
        """Return whether a servo can have moved to a position from a place, with its speed."""
        last, last_s, past, past_s = place
        way, since_s, fastest = position - last, max(0.0, at_s - last_s), self._fastest[slot]
        if abs(way) > SLACK_STEPS + MARGIN * fastest * (LATE_S + since_s):
            return False
        if at_s >= self.disturbed_until_s:
            return True
        if since_s > FULL_SPEED_S:  # it may be anywhere: only agreeing answers are believed
            return False
        speed = (last - past) / max(1e-3, last_s - past_s)
        room = NEAR_STEPS + NEAR_LATE_S * abs(speed) + fastest / FULL_SPEED_S * since_s**2
        return min(0.0, speed * since_s) - room <= way <= max(0.0, speed * since_s) + room
