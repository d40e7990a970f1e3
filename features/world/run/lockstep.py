"""One simulated time for several robots, each of which runs in its own thread.

Only one of them runs at a time: the one with the earliest next instant, and of equal ones the one
with the lowest number. So a run of several robots is as reproducible as a run of one.
"""

import threading

from gazerig.robot.model.clock import Clock


class Lockstep:
    """A time that advances when all participants wait.

    Args:
        count: number of participants; each calls ``enter`` first and ``leave`` last.
    """

    def __init__(self, count: int) -> None:
        self._changed = threading.Condition()
        self._due_s: list[float | None] = [0.0] * count
        self._turn: int | None = 0
        self._now_s = 0.0

    def now_s(self) -> float:
        """Return the time."""
        return self._now_s

    def clock(self, number: int) -> Clock:
        """Return the clock of a participant."""
        return _ParticipantClock(self, number)

    def enter(self, number: int) -> None:
        """Wait for the first turn of a participant."""
        with self._changed:
            self._await(number)

    def wait(self, number: int, t_s: float) -> None:
        """Let the other participants run until ``t_s``; return immediately if that is past."""
        with self._changed:
            if t_s <= self._now_s:
                return
            self._due_s[number] = t_s
            self._hand_over()
            self._await(number)

    def leave(self, number: int) -> None:
        """Let the other participants continue without this one; safe to call twice."""
        with self._changed:
            if self._due_s[number] is None:
                return
            self._due_s[number] = None
            if self._turn == number:
                self._hand_over()

    def _await(self, number: int) -> None:
        while self._turn != number:
            self._changed.wait()

    def _hand_over(self) -> None:
        waiting = [(t_s, n) for n, t_s in enumerate(self._due_s) if t_s is not None]
        if not waiting:
            self._turn = None
            return
        t_s, self._turn = min(waiting)
        self._now_s = max(self._now_s, t_s)
        self._changed.notify_all()


class _ParticipantClock:
    """The clock of one participant."""

    def __init__(self, shared: Lockstep, number: int) -> None:
        self._shared, self._number = shared, number

    def now_s(self) -> float:
        """Return the time."""
        return self._shared.now_s()

    def sleep_until(self, t_s: float) -> None:
        """Let the other participants run; return at ``t_s``."""
        self._shared.wait(self._number, t_s)
