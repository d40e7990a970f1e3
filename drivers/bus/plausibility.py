"""Plausibility check that separates real positions of a joint from those damaged by noise.

The checksum of an answer misses some damage: a sum of one byte misses one in 256 damaged answers, a
CRC of two bytes one in 65,536. Between two answers a joint moves no farther than its motor can turn
it, so a position farther away is not returned as fresh. A joint that is at another position because
it was pushed by hand, was restarted or is off by a turn reports that position repeatedly. It is
believed after several answers.
"""

from collections.abc import Sequence
from math import isnan
from operator import sub
from typing import Any

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

PAIR_STEPS = 4
"""Distance allowed between two consecutive answers in addition to the motion of the motor."""

PAIR_LATE_S = 0.005
"""Longest additional delay of the first of two consecutive answers."""


class Plausibility:
    """Last position of each servo, and the distance that it can have moved since.

    Args:
        fastest_steps_s: No-load speed of each servo's motor.

    damaged_s: time of the last damaged answer
    """

    def __init__(self, fastest_steps_s: Sequence[float]) -> None:
        self._fastest = tuple(fastest_steps_s)
        self._pace = tuple(MARGIN * speed for speed in fastest_steps_s)
        self._free = tuple(SLACK_STEPS + LATE_S * pace for pace in self._pace)
        self._nearest = min(self._free, default=0.0)
        self.damaged_s = float("-inf")
        self.forget()

    def forget(self) -> None:
        """Accept the next positions without a check, for example after a lost port."""
        count = len(self._fastest)
        self._last: Sequence[Any] = [None] * count
        self._at_s = [0.0] * count
        self._odd: list[list[tuple[int, float]]] = [[] for _ in range(count)]
        self._whole_s = float("nan")

    def record(self, slot: int, position: int, at_s: float) -> None:
        """Record a position of a servo from another source than its cyclic answer."""
        last = self._last = list(self._last)
        if not isnan(self._whole_s):
            self._at_s = [self._whole_s] * len(last)
        last[slot], self._at_s[slot] = position, at_s
        self._odd[slot].clear()
        self._whole_s = float("nan")

    def are_plausible(self, positions: Sequence[int], at_s: float) -> bool:
        """Return whether all positions of one answer are plausible; only then are they recorded."""
        # Fast path of every tick: servos last read together have one common time.
        since_s = at_s - self._whole_s
        if not since_s >= 0.0:  # nan if they were not read together
            return False
        ways = tuple(map(sub, positions, self._last))
        if max(ways) > self._nearest or min(ways) < -self._nearest:
            for way, free, pace in zip(ways, self._free, self._pace, strict=True):
                if not -free - pace * since_s <= way <= free + pace * since_s:
                    return False
        self._last, self._whole_s = positions, at_s
        return True

    def is_plausible(self, slot: int, position: int, at_s: float) -> bool:
        """Return whether one servo's position is plausible; call it once for every answer."""
        last, odd = self._last[slot], self._odd[slot]
        last_s = self._at_s[slot] if isnan(self._whole_s) else self._whole_s
        if last is not None and not self._is_near(slot, last, last_s, position, at_s):
            if odd and not self._is_near(slot, *odd[-1], position, at_s):
                odd.clear()
            odd.append((position, at_s))
            if len(odd) < AGREEING:
                return False
        self.record(slot, position, at_s)
        if all(at == at_s for at in self._at_s) and None not in self._last:
            self._whole_s = at_s
        return True

    def _is_near(self, slot: int, before: int, before_s: float, now: int, now_s: float) -> bool:
        since_s = max(0.0, now_s - before_s)
        if self.is_disturbed(now_s):  # two servos with one id report the same wrong position twice
            reach = PAIR_STEPS + self._fastest[slot] * (LATE_S + since_s)
        else:
            reach = self._free[slot] + self._pace[slot] * since_s
        return abs(now - before) <= reach

    # --- a line with recently damaged answers

    def record_damaged(self, at_s: float) -> None:
        """Record that an answer was damaged or not plausible."""
        self.damaged_s = at_s

    def is_disturbed(self, now_s: float) -> bool:
        """Return whether an answer was damaged recently."""
        return now_s - self.damaged_s <= DISTURBED_S

    def agree(self, slot: int, way: int, since_s: float, speeds_steps_s: Sequence[float]) -> bool:
        """Return whether two consecutive answers are plausible together.

        Args:
            slot: Index of the servo.
            way: Steps from the first to the second.
            since_s: Time from the first to the second.
            speeds_steps_s: Speeds that both report.
        """
        fastest, room_s = self._fastest[slot], PAIR_LATE_S + max(0.0, since_s)
        low = max(-fastest, min(0.0, *speeds_steps_s)) * room_s
        high = min(fastest, max(0.0, *speeds_steps_s)) * room_s
        return low - PAIR_STEPS <= way <= high + PAIR_STEPS
