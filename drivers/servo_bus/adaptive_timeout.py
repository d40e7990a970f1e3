"""How long to wait for an answer beyond the time its bytes take on the wire.

A bus without a USB adapter answers within microseconds, an adapter with a latency timer
of 1 ms within about two, one left at 16 ms within 16. None says which it is, so it is
measured: twice the worst delay of late but for a few, within bounds. The few are those of
a host that was busy elsewhere, which says nothing about the bus. A false alarm costs one
servo one value, and what arrives after it counts as a delay.
"""

WINDOW = 128
"""The worst of so many answers count, for as many more."""

RANK = 3
"""The worst but two: one or two in a window may be as late as they like."""

FACTOR = 2.0


class Patience:
    """Learns from every whole answer how late answers are.

    seconds: the patience now; begins at its longest
    """

    def __init__(self, least_s: float, most_s: float) -> None:
        self._least_s = min(least_s, most_s)
        self._most_s = most_s
        self.seconds = most_s
        self._before_s = 0.0
        self._worst_s = [0.0] * RANK
        self._count = 0

    def note(self, late_s: float) -> None:
        """Note by how much an answer came later than its bytes take."""
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
        """Note that an answer came after waiting had ended."""
        self.note(self.seconds)

    def _turn(self) -> None:
        """Forget the window before the last."""
        worst_s = max(self._before_s, self._worst_s[0])
        self.seconds = min(self._most_s, max(self._least_s, FACTOR * worst_s))
        self._before_s, self._worst_s, self._count = self._worst_s[0], [0.0] * RANK, 0
