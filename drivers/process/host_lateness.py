"""Detection of delays of this computer, as opposed to the bus; pure.

Every bus has one record of them, and ``HostLateness.blame`` is the one place that decides whether a
message names a cable, an id, a program or the supply as the cause of missing answers. The symptoms
of a busy computer resemble bad plugs: answers arrive after their time-outs, and servos whose
watchdog was not fed stop. Answers that are intact but late distinguish it from a silent servo.
"""

from math import inf

SILENCE_S = 0.25
"""Silence of all servos after which a line is logged."""

BLAME_S = 1.5
"""Silence after which plugs and power are reported as the cause. A shorter silence looks the same
as a stalled computer, which late answers identify afterwards.
"""

LATE_COMPUTER = "late computer"
"""Kind of servo events that are caused by delays of this computer, not by the servos."""

AFTERMATH_S = 2.0
"""Time after a delay of the computer during which it is the cause of events of servos."""

OVERSLEPT_S = 0.02
"""A wait that ends so long after its deadline was ended late by this computer."""

NOT_THE_BUS = "cables, ids and power are not the cause"


class HostLateness:
    """Record of delays of this computer.

    It stores the last answer that arrived after its time-out, and the last long pause in sending.
    """

    def __init__(self) -> None:
        self._silent_s, self._silent_until_s = 0.0, -inf
        self._last_s = -inf

    def record_late_answer(self, at_s: float) -> None:
        """Record a late answer."""
        self._last_s = at_s

    def record_wait(self, deadline_s: float, ended_s: float) -> None:
        """Record the end of a wait without an answer; a late end is a late answer."""
        if ended_s - deadline_s >= OVERSLEPT_S:
            self.record_late_answer(ended_s)

    def blame(self, fault: str, remedy: str, now_s: float, since_s: float = inf) -> str:
        """Return a fault with its remedy, or with this computer as its cause if it was late.

        since_s: begin of the fault, if it is longer ago than ``AFTERMATH_S``
        """
        late = self.cause(now_s, since_s)
        return f"{fault}: {late}; {NOT_THE_BUS}" if late else f"{fault}: {remedy}"

    def record_own_silence(self, silent_s: float, until_s: float) -> None:
        """Record that this computer has sent nothing for ``silent_s`` seconds."""
        if until_s - self._silent_until_s >= AFTERMATH_S or silent_s > self._silent_s:
            self._silent_s = silent_s
        self._silent_until_s = until_s

    def cause(self, now_s: float, since_s: float = inf) -> str:
        """Return the recent delay of this computer, or that since a time, as text; "" for none."""
        begin_s = min(since_s, now_s - AFTERMATH_S)
        if self._silent_until_s > begin_s:
            return f"this computer was late: it sent nothing for {self._silent_s:.2f} s"
        if self._last_s >= begin_s:
            return "this computer was busy, or the emulator was suspended: answers arrived late"
        return ""
