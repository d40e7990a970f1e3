"""Positions that a joint can have, and those that noise has made. Numbers in, masks out.

A check over the bytes of an answer lets some damaged ones pass: a sum of one byte one in
256, a CRC of two bytes one in 65,536. Between two answers a joint moves no farther than its
motor can turn it, so a position farther away is not given as fresh. A joint that really is
elsewhere - pushed by hand, restarted, counted again by a turn - says so again and again, and
is believed then.
"""

from collections.abc import Sequence
from math import isnan
from operator import sub
from typing import Any

SLACK_STEPS = 64
"""So far apart two answers may be whatever the time between them: play, and jitter."""

LATE_S = 0.01
"""An answer may have been given so long before it was taken."""

MARGIN = 1.5
"""A joint may move so much faster than its motor without load: it is pushed, or it falls."""

AGREEING = 3
"""So many answers in a row that agree with each other are believed wherever they are."""

DISTURBED_S = 5.0
"""So long after a damaged answer the line counts as disturbed."""

PAIR_STEPS = 4
"""Two answers right after one another may be so far apart, beyond what the motor can do."""

PAIR_LATE_S = 0.005
"""The first of two answers may have waited so much longer than the second."""


class Plausibility:
    """Knows where each servo was last, and how far it can have come since.

    Args:
        fastest_steps_s: speed of each servo's motor without load.

    damaged_s: when an answer arrived damaged last
    """

    def __init__(self, fastest_steps_s: Sequence[float]) -> None:
        self._fastest = tuple(fastest_steps_s)
        self._pace = tuple(MARGIN * speed for speed in fastest_steps_s)
        self._free = tuple(SLACK_STEPS + LATE_S * pace for pace in self._pace)
        self._nearest = min(self._free, default=0.0)
        self.damaged_s = float("-inf")
        self.forget()

    def forget(self) -> None:
        """Believe the next positions whatever they are, as after a port that was gone."""
        count = len(self._fastest)
        self._last: Sequence[Any] = [None] * count
        self._at_s = [0.0] * count
        self._odd: list[list[tuple[int, float]]] = [[] for _ in range(count)]
        self._whole_s = float("nan")

    def place(self, slot: int, position: int, at_s: float) -> None:
        """Record where a servo was found by other means than its cyclic answer."""
        last = self._last = list(self._last)
        if not isnan(self._whole_s):
            self._at_s = [self._whole_s] * len(last)
        last[slot], self._at_s[slot] = position, at_s
        self._odd[slot].clear()
        self._whole_s = float("nan")

    def whole(self, positions: Sequence[int], at_s: float) -> bool:
        """Return whether all positions of one answer can be true; they are noted only then."""
        # Every tick: where all were last heard together there is one time for all of them.
        since_s = at_s - self._whole_s
        if not since_s >= 0.0:  # nor where they were not
            return False
        ways = tuple(map(sub, positions, self._last))
        if max(ways) > self._nearest or min(ways) < -self._nearest:
            for way, free, pace in zip(ways, self._free, self._pace, strict=True):
                if not -free - pace * since_s <= way <= free + pace * since_s:
                    return False
        self._last, self._whole_s = positions, at_s
        return True

    def one(self, slot: int, position: int, at_s: float) -> bool:
        """Return whether one servo's position can be true; to be asked once for every answer."""
        last, odd = self._last[slot], self._odd[slot]
        last_s = self._at_s[slot] if isnan(self._whole_s) else self._whole_s
        if last is not None and not self._near(slot, last, last_s, position, at_s):
            if odd and not self._near(slot, *odd[-1], position, at_s):
                odd.clear()
            odd.append((position, at_s))
            if len(odd) < AGREEING:
                return False
        self.place(slot, position, at_s)
        if all(at == at_s for at in self._at_s) and None not in self._last:
            self._whole_s = at_s
        return True

    def _near(self, slot: int, before: int, before_s: float, now: int, now_s: float) -> bool:
        since_s = max(0.0, now_s - before_s)
        if self.disturbed(now_s):  # two servos with one id say the same wrong thing twice
            reach = PAIR_STEPS + self._fastest[slot] * (LATE_S + since_s)
        else:
            reach = self._free[slot] + self._pace[slot] * since_s
        return abs(now - before) <= reach

    # --- a line on which answers have been damaged of late

    def damaged(self, at_s: float) -> None:
        """Record that an answer arrived damaged, or was not plausible."""
        self.damaged_s = at_s

    def disturbed(self, now_s: float) -> bool:
        """Return whether answers have been damaged of late."""
        return now_s - self.damaged_s <= DISTURBED_S

    def pair(self, slot: int, way: int, since_s: float, speeds_steps_s: Sequence[float]) -> bool:
        """Return whether two answers right after one another can both be true.

        Args:
            slot: the servo.
            way: steps from the first to the second.
            since_s: time from the first to the second.
            speeds_steps_s: what both say of its speed.
        """
        fastest, room_s = self._fastest[slot], PAIR_LATE_S + max(0.0, since_s)
        low = max(-fastest, min(0.0, *speeds_steps_s)) * room_s
        high = min(fastest, max(0.0, *speeds_steps_s)) * room_s
        return low - PAIR_STEPS <= way <= high + PAIR_STEPS
