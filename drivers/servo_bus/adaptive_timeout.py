"""How long to wait for an answer beyond the time its bytes take on the wire.

A bus without a USB adapter answers within microseconds, an adapter with a latency timer
of 1 ms within about two, one left at 16 ms within 16. The adapter does not report which, so it is
measured: the prompt time-out is twice the worst delay of late but for a few, within bounds.

Those few are delays of a host that was busy elsewhere for a moment, not of the
bus. No time-out that is prompt can cover them, so there is a reserve beyond it: it
is spent only by waiting in vain, and fills up again with one hundredth of the time that
passes. So a computer that pauses now and then costs no value, and servos that keep silent
cost one hundredth of the time, whatever they do, beyond their prompt time-outs.
"""

from math import inf

WINDOW = 128
"""The worst of so many answers count, for as many more."""

RANK = 3
"""The worst but two: one or two in a window may be as late as they like."""

FACTOR = 2.0

RESERVE_S = 0.01
"""A full reserve: a pause of the host as long as this costs nothing."""

REFILL = 0.01
"""Share of the time that goes into the reserve."""


class AdaptiveTimeout:
    """Learns from every whole answer how late answers are.

    Args:
        least_s: least prompt time-out.
        most_s: greatest time-out, the reserve included.

    seconds: the prompt time-out now; begins at its longest
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
        """Return the time-out with all of the reserve."""
        reserve_s = REFILL * (now_s - self._empty_s)
        return min(self._most_s, self.seconds + min(RESERVE_S, reserve_s))

    def waited_in_vain(self, beyond_s: float, now_s: float) -> None:
        """Subtract from the reserve what was waited in vain beyond the prompt time-out."""
        if beyond_s > 0.0:
            left_s = min(RESERVE_S, REFILL * (now_s - self._empty_s)) - beyond_s
            self._empty_s = now_s - max(0.0, left_s) / REFILL

    def update(self, late_s: float) -> None:
        """Record by how much an answer came later than its bytes take."""
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
        """Record that an answer came after waiting had ended."""
        self.update(self.seconds)

    def _turn(self) -> None:
        """Forget the window before the last."""
        worst_s = max(self._before_s, self._worst_s[0])
        self.seconds = min(self._most_s, max(self._least_s, FACTOR * worst_s))
        self._before_s, self._worst_s, self._count = self._worst_s[0], [0.0] * RANK, 0
