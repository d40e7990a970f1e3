"""One simulated time for several robots, each of which runs in a thread of its own.

Only one of them runs at a time: the one whose next instant comes first, of equal ones the one with
the lowest number. So a run of several is as reproducible as that of one.
"""

import threading

from gazerig.robot.model.clock import Clock


class Lockstep:
    """Time that goes on when all who share it wait.

    Args:
        count: so many share it; each calls ``enter`` first and ``leave`` at last.
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
        """Return the clock of one of them."""
        return _Turns(self, number)

    def enter(self, number: int) -> None:
        """Return when it is the first turn of this one."""
        with self._changed:
            self._await(number)

    def wait(self, number: int, t_s: float) -> None:
        """Let the others go on, and return at ``t_s``; at once where that is past."""
        with self._changed:
            if t_s <= self._now_s:
                return
            self._due_s[number] = t_s
            self._hand_over()
            self._await(number)

    def leave(self, number: int) -> None:
        """Let the others go on without this one from now on; safe to call twice."""
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


class _Turns:
    """The clock of one who shares time."""

    def __init__(self, shared: Lockstep, number: int) -> None:
        self._shared, self._number = shared, number

    def now_s(self) -> float:
        """Return the time."""
        return self._shared.now_s()

    def sleep_until(self, t_s: float) -> None:
        """Let the others go on; return at ``t_s``."""
        self._shared.wait(self._number, t_s)
