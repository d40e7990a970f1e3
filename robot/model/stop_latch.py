"""A stop that holds: who stopped, for how long at least, and who may lift it.

Pure: times are those of the ticks, so a recorded run is stopped and resumed as it was.
"""

from gazerig.robot.model.commands import Resume, Stop

MIN_HOLD_S = 2.0
"""A stop lasts at least so long, also for its asker."""
MIN_RESUME_GAP_S = 1.0
"""A resume within this of the last one of the same asker is refused, and counts as the last."""
_MAX_ASKERS = 32


class StopLatch:
    """Whether the robot is stopped, and the rules by which it may go on.

    why: the reason of the newest stop, "" while the robot is not stopped
    """

    def __init__(self) -> None:
        self.why = ""
        self._stoppers: set[str] = set()
        self._stopped_s = 0.0
        self._asked_s: dict[tuple[str, bool], float] = {}

    def stop(self, command: Stop, t_s: float) -> bool:
        """Stop, or renew a stop; True if it is a new one."""
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
        """Return who stopped, "" if unknown."""
        return " and ".join(sorted(filter(None, self._stoppers)))

    def refusal(self, command: Resume, t_s: float) -> str:
        """Return why a resume is not obeyed, "" where it is; each call counts as an attempt."""
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
        """Go on."""
        self.why = ""
