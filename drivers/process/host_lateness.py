"""Whether this computer is late, or the bus. Pure.

A busy computer looks like bad plugs: answers arrive after waiting for them has ended, and
servos whose own watchdog was not fed stop. Answers that arrive whole but late distinguish it
from a silent servo.
"""

from collections import deque
from math import inf

WITHIN_S = 1.0
"""Answers late within such a time are counted."""

BUSY = 3
"""So many late answers within that time are no accident."""

SILENCE_S = 0.25
"""Where no servo at all answers, that is worth a line from so long on."""

BLAME_S = 1.5
"""Plugs and power are blamed for such a silence only while it lasts longer than this: before,
a computer that stood still looks the same. Its late answers tell afterwards."""

STOOD_STILL = (
    "this computer was busy, or the emulator stood still: for {:.1f} s no answer came, then "
    "they came late and whole; plugs and power are not to blame"
)


LATE_COMPUTER = "late computer"
"""Kind of what servos did because this computer was late; it is no fault of theirs."""

AFTERMATH_S = 2.0
"""What servos do within such a time of a late computer is put down to it."""


class HostLateness:
    """Records how this computer was late.

    Counts answers that came after waiting for them had ended, and remembers the last time at
    which it sent nothing for long.
    """

    def __init__(self) -> None:
        self._silent_s, self._silent_until_s = 0.0, -inf
        self._late: deque[float] = deque(maxlen=1000)
        self._last_s = -inf

    def late_answer(self, at_s: float) -> None:
        """Record that an answer has come late."""
        self._late.append(at_s)
        self._last_s = at_s

    def any_since(self, begin_s: float) -> bool:
        """Return whether an answer came late since then, noise beside it or not."""
        return self._last_s >= begin_s

    def own_silence(self, silent_s: float, until_s: float) -> None:
        """Record that this computer has sent nothing for so long."""
        if until_s - self._silent_until_s >= AFTERMATH_S or silent_s > self._silent_s:
            self._silent_s = silent_s
        self._silent_until_s = until_s

    def cause(self, now_s: float) -> str:
        """Return how this computer was late a moment ago, "" where it was not."""
        if now_s - self._silent_until_s < AFTERMATH_S:
            return f"this computer was late: it sent nothing for {self._silent_s:.2f} s"
        if self.any_since(now_s - AFTERMATH_S):
            return "this computer was busy, or the emulator stood still: answers came late"
        return ""

    def forget(self) -> None:
        """Reset the count."""
        self._late.clear()

    def busy(self, now_s: float) -> int:
        """Return how many answers came late within the last second; 0 where they are few."""
        late = self._late
        while late and late[0] < now_s - WITHIN_S:
            late.popleft()
        return len(late) if len(late) >= BUSY else 0
