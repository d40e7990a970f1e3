"""Time-out of an answer in addition to its time on the wire, measured continuously.

A bus without a USB adapter answers within microseconds, an adapter with a latency timer of 1 ms
within about two, one left at 16 ms within 16. The adapter does not report its timer, so the delay
is measured. The prompt time-out is twice the longest recent delay, except for a few outliers, and
has bounds.

The outliers are delays of a host that was briefly busy, not of the bus. No prompt time-out can
cover them, so a reserve is added to it. Only waits without an answer consume the reserve, and it
refills with one hundredth of the elapsed time. So a pause of the computer loses no value, and
silent servos cost at most one hundredth of the time in addition to their prompt time-outs.
"""

from math import inf

WINDOW = 128
"""Number of answers in a window; a window's longest delays count until the end of the next one."""

RANK = 3
"""The third-longest delay counts: one or two answers in a window may be late."""

FACTOR = 2.0

RESERVE_S = 0.01
"""Size of a full reserve: a pause of the host up to this length loses no answer."""

REFILL = 0.01
"""Share of the elapsed time that refills the reserve."""


class AdaptiveTimeout:
    """Time-out derived from the delays of complete answers.

    Args:
        least_s: Shortest prompt time-out, seconds.
        most_s: Longest time-out, the reserve included, seconds.

    seconds: the current prompt time-out; it begins at its longest
    """

    def __init__(self, least_s: float, most_s: float) -> None:
        self._least_s = min(least_s, most_s)
        self._most_s = most_s
        self.seconds = most_s
        self._before_s = 0.0
        self._worst_s = [0.0] * RANK
        self._count = 0
        self._empty_s = -inf

    def with_reserve(self, now_s: float) -> float:
        """Return the time-out with the whole reserve, seconds."""
        reserve_s = REFILL * (now_s - self._empty_s)
        return min(self._most_s, self.seconds + min(RESERVE_S, reserve_s))

    def consume_reserve(self, beyond_s: float, now_s: float) -> None:
        """Subtract from the reserve a wait without an answer, beyond the prompt time-out."""
        if beyond_s > 0.0:
            left_s = min(RESERVE_S, REFILL * (now_s - self._empty_s)) - beyond_s
            self._empty_s = now_s - max(0.0, left_s) / REFILL

    def update(self, late_s: float) -> None:
        """Record the delay of an answer beyond its time on the wire."""
        worst_s = self._worst_s
        if late_s > worst_s[0]:
            worst_s[0] = late_s
            worst_s.sort()
            if FACTOR * worst_s[0] > self.seconds:
                self.seconds = min(self._most_s, FACTOR * worst_s[0])
        self._count += 1
        if self._count >= WINDOW:
            self._turn()

    def missed(self) -> None:
        """Record that an answer came after its time-out."""
        self.update(self.seconds)

    def _turn(self) -> None:
        """Discard the window before the last."""
        worst_s = max(self._before_s, self._worst_s[0])
        self.seconds = min(self._most_s, max(self._least_s, FACTOR * worst_s))
        self._before_s, self._worst_s, self._count = self._worst_s[0], [0.0] * RANK, 0
