"""Latch of a stop: who stopped, its shortest duration, and who may lift it.

Times are those of the ticks, so a repeated run is stopped and resumed as recorded.
"""

from gazerig.robot.model.commands import Resume, Stop

MIN_HOLD_S = 2.0
"""Shortest duration of a stop, also for the client that stopped."""
MIN_RESUME_GAP_S = 1.0
"""A resume within this time of the same client's last one is refused, and counts as the last."""
_MAX_ASKERS = 32


class StopLatch:
    """The latch of a stop, with the rules for a resume.

    Attributes:
        why: Reason for the newest stop, "" while the robot is not stopped.
    """

    def __init__(self) -> None:
        self.why = ""
        self._stoppers: set[str] = set()
        self._stopped_s = 0.0
        self._asked_s: dict[tuple[str, bool], float] = {}

    def stop(self, command: Stop, t_s: float) -> bool:
        """Stop, or renew a stop; return whether it is a new one."""
        new = not self.why
        if new:
            self._stoppers.clear()
        if len(self._stoppers) < _MAX_ASKERS:
            self._stoppers.add(command.who)
        self._stopped_s = t_s
        self.why = command.why or "stopped"
        return new

    @property
    def by(self) -> str:
        """Return the clients that stopped, "" if unknown."""
        return " and ".join(sorted(filter(None, self._stoppers)))

    def refusal(self, command: Resume, t_s: float) -> str:
        """Return the reason for a refusal of a resume, "" to accept; each call is an attempt."""
        asker = (command.who, command.confirmed)
        last_s = self._asked_s.pop(asker, None)
        self._asked_s[asker] = t_s
        while len(self._asked_s) > _MAX_ASKERS:
            del self._asked_s[next(iter(self._asked_s))]
        if last_s is not None and t_s - last_s < MIN_RESUME_GAP_S:
            return f"too many requests to resume: ask once, then not for {MIN_RESUME_GAP_S:g} s"
        left_s = self._stopped_s + MIN_HOLD_S - t_s
        if left_s > 0.0:
            return f"a stop holds at least {MIN_HOLD_S:g} s: ask again in {left_s:.1f} s"
        if not command.confirmed and self._stoppers != {command.who}:
            by = f"stopped by {self.by}" if self.by else "another client stopped it"
            return f"{by}: another may only resume who confirms that no hand is in the mechanism"
        return ""

    def lift(self) -> None:
        """Lift the stop."""
        self.why = ""
