"""Which window of registers is read next, so that no other answer passes for the one waited for.

An answer says neither which registers it is of nor when it was asked for; its length is all
there is to tell it by. So two readings in a row never have the same length: a line that says
its last answer again, or one answer too late, is not taken at its word.
"""

from collections.abc import Iterable
from typing import Generic, TypeVar

CALM_S = 0.25
"""So long after the last trouble no answer is late any more."""

Window = TypeVar("Window")


class Turns(Generic[Window]):
    """Says which window is read next: the usual ones in turn, after trouble others for a while.

    Args:
        usual: neighbours, and the first and last, have different lengths.
        spare: no two alike; two of them take turns after each trouble, then the next two.

    troubled: the spare ones are read
    """

    def __init__(self, usual: Iterable[Window], spare: Iterable[Window]) -> None:
        self._usual, self._spare = tuple(usual), tuple(spare)
        self._at, self._pair, self._odd = -1, -2, 0
        self._calm_at_s = 0.0
        self.troubled = False

    def next(self) -> Window:
        """Return the window of the next reading."""
        if self.troubled:
            self._odd ^= 1
            return self._spare[(self._pair + self._odd) % len(self._spare)]
        self._at += 1
        if self._at >= len(self._usual):
            self._at = 0
        return self._usual[self._at]

    def trouble(self, now_s: float) -> None:
        """Note that an answer stayed out: the next readings have other lengths."""
        self.troubled = True
        self._pair, self._odd = (self._pair + 2) % len(self._spare), 1
        self._calm_at_s = now_s + CALM_S

    def calm(self, now_s: float) -> None:
        """Note the time; the usual windows come back when nothing can be late any more."""
        if now_s >= self._calm_at_s:
            self.troubled = False
