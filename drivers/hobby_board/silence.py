"""Silence of a board: times of retries, and reports."""

from math import inf

from gazerig.drivers.event_log import EventLog
from gazerig.drivers.process.host_lateness import BLAME_S, SILENCE_S, STOOD_STILL, HostLateness

AGAIN_FIRST_S, AGAIN_LAST_S = 0.0625, 0.5
"""Interval of requests to a silent board: doubled from the first to the last value."""

IN_A_ROW = 3
"""Consecutive missing answers after which it is read less often, as each costs a read its
time-out."""

OWED_S = 0.1
"""Time after the first answer by which the pending ones have arrived."""


class SilenceMonitor:
    """Monitor of missing answers.

    missed: number of consecutive missing answers
    """

    def __init__(self, log: EventLog, lateness: HostLateness) -> None:
        self._log, self._lateness = log, lateness
        self.missed = 0
        self._reported = False
        self._spoilt = 0
        self._back_s: float | None = None
        self._since_s, self._due_s, self._wait_s = 0.0, -inf, AGAIN_FIRST_S

    def due(self, now_s: float) -> bool:
        """Return whether a request is due."""
        return now_s >= self._due_s

    def miss(self, now_s: float, heard_s: float = -inf) -> None:
        """Record a missing or damaged answer; ``heard_s``: time of the last received byte."""
        if not self.missed:
            self._wait_s = AGAIN_FIRST_S
            if self._back_s is None:
                self._since_s, self._spoilt = now_s, 0
        self._back_s = None
        self.missed += 1
        if self.missed >= IN_A_ROW:
            self._due_s = now_s + self._wait_s
            self._wait_s = min(AGAIN_LAST_S, 2.0 * self._wait_s)
        self._spoilt += heard_s >= now_s
        damaged = self._spoilt >= IN_A_ROW
        if not self._reported and now_s - self._since_s >= (SILENCE_S if damaged else BLAME_S):
            self._reported = True
            self._log.add(
                "the board's answers arrive damaged: check cable, ground and baud rate"
                if damaged
                else "the board does not answer: check its power and the cable"
            )

    def answer(self, now_s: float) -> None:
        """Record an answer."""
        if self.missed:
            self.missed, self._due_s, self._back_s = 0, -inf, now_s
        if self._back_s is None or now_s - self._back_s < OWED_S:
            return
        silent_s = self._back_s - self._since_s
        noise = self._spoilt >= IN_A_ROW
        if silent_s >= SILENCE_S and not noise and self._lateness.was_late_since(self._since_s):
            self._log.add(STOOD_STILL.format(silent_s))
        elif self._reported:
            self._log.add(f"the board answers again after {silent_s:.1f} s")
        elif silent_s >= SILENCE_S:
            self._log.add(
                f"the board did not answer for {silent_s:.1f} s: check its power and the cable"
            )
        self._reported, self._back_s = False, None

    def seconds(self, now_s: float) -> float:
        """Return the time without an answer, seconds; 0 if the last request was answered."""
        return now_s - self._since_s if self.missed else 0.0
