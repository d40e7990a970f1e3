"""A board that does not answer: when to ask again, and what people are told."""

from math import inf

from drivers.event_log import EventLog

AGAIN_FIRST_S, AGAIN_LAST_S = 0.0625, 0.5
"""Time between questions to a board that stays silent: doubled from the first to the last."""

IN_A_ROW = 3
"""So many answers may stay out before it is asked less often: each costs a read its patience."""

SAY_S = 0.25
"""Silence is spoken of from so long on: one lost answer is no news."""


class Silence:
    """Counts answers that stayed out.

    missed: how many in a row
    """

    def __init__(self, log: EventLog) -> None:
        self._log = log
        self.missed = 0
        self._told = False
        self._since_s, self._due_s, self._wait_s = 0.0, -inf, AGAIN_FIRST_S

    def due(self, now_s: float) -> bool:
        """Tell whether to ask now."""
        return now_s >= self._due_s

    def miss(self, now_s: float, heard_s: float = -inf) -> None:
        """Note an answer that stayed out, or could not be read; anything came last at heard_s."""
        if not self.missed:
            self._since_s, self._wait_s = now_s, AGAIN_FIRST_S
        self.missed += 1
        if self.missed >= IN_A_ROW:
            self._due_s = now_s + self._wait_s
            self._wait_s = min(AGAIN_LAST_S, 2.0 * self._wait_s)
        if not self._told and now_s - self._since_s >= SAY_S:
            self._told = True
            damaged = heard_s >= self._since_s
            self._log.add(
                "what the board answers arrives damaged: check cable, ground and baud rate"
                if damaged
                else "the board does not answer: check its power and the cable"
            )

    def answer(self, now_s: float) -> None:
        """Note an answer."""
        if not self.missed:
            return
        if self._told:
            self._log.add(f"the board answers again after {now_s - self._since_s:.1f} s")
        self.missed, self._told, self._due_s = 0, False, -inf

    def seconds(self, now_s: float) -> float:
        """Give for how long nothing has been heard; 0 where the last answer came."""
        return now_s - self._since_s if self.missed else 0.0
