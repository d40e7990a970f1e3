"""Faults of each servo: latched errors, repeated restarts, long silence."""

from collections.abc import Collection, Mapping, Sequence

from gazerig.drivers.event_log import EventLog, RateLimitedLog
from gazerig.drivers.process.host_lateness import BLAME_S, SILENCE_S, STOOD_STILL, HostLateness
from gazerig.drivers.types import ServoConfig

MOST_RESTARTS, WITHIN_S = 3, 10.0
"""A servo that restarts more often than this within this time stays without torque."""

AGAIN_AND_AGAIN = "restarts again and again: supply too weak"

GARBLES = "answers, but its bytes arrive damaged"

BUSY_S = 2.0
"""Silence after which a servo is reported while answers arrive late."""

NOT_SET_UP = "cannot be set up again"

BAD_LINE = "a second servo with its id, or a bad cable"

CHECK_SUPPLY = "check servo power and cable"

FAILED_IN_A_ROW = 2
"""Consecutive failures after which a servo alone is reported: one lost answer is not an event."""

OWED_S = 0.1
"""Time after the first answer by which the pending ones have arrived."""

SAY_SILENT_S = 0.25
"""Silence after which servos are reported: one lost answer is not an event."""


class ServoHealth:
    """Present faults of all servos, as text.

    faults: present fault of a servo, by id
    latches: ids of servos that have latched their fault themselves
    all_silent_since_s: time since which no servo has answered; kept until the end of the silence is
        reported
    """

    def __init__(self, setups: Mapping[int, ServoConfig], log: EventLog) -> None:
        self._setups = setups
        self._log = log
        self.faults: dict[int, str] = {}
        self.latches: set[int] = set()
        self._restarts: dict[int, list[float]] = {}
        self._failed: dict[int, int] = {}
        self._silent_since: dict[int, float] = {}
        self._reported: set[int] = set()
        self._all_silent = False
        self.all_silent_since_s: float | None = None
        self._back_s: float | None = None
        self._seldom = RateLimitedLog(log)

    def record_latched(self, servo_id: int, errors: Sequence[str]) -> bool:
        """Record latched errors; return whether they are new."""
        fault = " and ".join(errors)
        if self.faults.get(servo_id) == fault:
            return False
        self.record_fault(servo_id, fault)
        self.latches.add(servo_id)
        return True

    def record_fault(self, servo_id: int, fault: str) -> None:
        """Record a fault that stays until the servo is restarted."""
        self.faults[servo_id] = fault
        self._log.add(f"{self._setups[servo_id].label()}: {fault}")

    def record_cleared(self, servo_id: int) -> None:
        """Record that a servo's latched error has ended."""
        if servo_id in self.latches:
            self.latches.discard(servo_id)
            del self.faults[servo_id]
            self._log.add(f"{self._setups[servo_id].label()}: the fault is gone")

    def has_exhausted_restarts(self, servo_id: int, now_s: float) -> bool:
        """Return whether a servo has restarted too often recently, and record that as a fault."""
        lately = [t_s for t_s in self._restarts.get(servo_id, []) if now_s - t_s < WITHIN_S]
        self._restarts[servo_id] = lately
        if len(lately) < MOST_RESTARTS:
            return False
        self.record_fault(servo_id, AGAIN_AND_AGAIN)
        return True

    def record_restarted(self, servo_id: int, now_s: float) -> None:
        """Record that a servo restarted and works again."""
        self._restarts.setdefault(servo_id, []).append(now_s)
        self._log.add(f"{self._setups[servo_id].label()} restarted: set up again")

    def record_not_set_up(self, servo_id: int, now_s: float, lateness: HostLateness) -> None:
        """Record that a servo, alone, could not be set up again."""
        self._failed[servo_id] = failed = self._failed.get(servo_id, 0) + 1
        if failed == FAILED_IN_A_ROW:
            fault = f"{self._setups[servo_id].label()} {NOT_SET_UP}"
            self._log.add(lateness.blame(fault, BAD_LINE, now_s))

    def record_set_up(self, servo_id: int) -> None:
        """Record that a servo has been set up again."""
        self._failed.pop(servo_id, None)

    def record_silent(
        self,
        out: Collection[int],
        now_s: float,
        garbling: Collection[int],
        lateness: HostLateness,
        answered: bool,
    ) -> None:
        """Record the silent servos; report each once after a longer silence.

        lateness: late answers, which mainly indicate that this computer is busy
        answered: whether any servo has answered
        """
        if not answered and out:
            self._back_s = None
            if self.all_silent_since_s is None:
                self.all_silent_since_s = now_s
        elif answered and self.all_silent_since_s is not None:
            self.record_answered_again(now_s, lateness)
            # While no servo answered, none in particular was silent.
            self._silent_since = {i: max(t, now_s) for i, t in self._silent_since.items()}
        for servo_id in [i for i in self._silent_since if i not in out]:
            since_s = self._silent_since.pop(servo_id)
            if servo_id in self._reported:
                self._reported.discard(servo_id)
                who = self._setups[servo_id].label()
                self._log.add(f"{who} answers again after {now_s - since_s:.1f} s")
        for servo_id in out:
            self._silent_since.setdefault(servo_id, now_s)
        late = lateness.late_answers(now_s)
        longest_s = now_s - min(self._silent_since.values(), default=now_s)
        if late and out and longest_s < BUSY_S:
            if longest_s >= SAY_SILENT_S:
                self._seldom.add(f"this computer is busy: {late} answers late in the last s", now_s)
            return
        if self.all_silent_since_s is None:
            for servo_id in out:
                silent_s = now_s - self._silent_since[servo_id]
                if servo_id not in self._reported and silent_s >= SAY_SILENT_S:
                    self._reported.add(servo_id)
                    who = self._setups[servo_id].label()
                    if servo_id in garbling:
                        text = lateness.blame(f"{who} {GARBLES}", BAD_LINE, now_s)
                    else:
                        text = f"{who} does not answer"
                    self._log.add(text)
        elif not self._all_silent and now_s - self.all_silent_since_s >= BLAME_S:
            self._all_silent = True
            since_s = self.all_silent_since_s
            self._log.add(lateness.blame("no servo answers", CHECK_SUPPLY, now_s, since_s))

    def record_answered_again(self, now_s: float, lateness: HostLateness) -> None:
        """Report the cause of a silence of all servos, after late answers have arrived."""
        if self.all_silent_since_s is None:
            return
        if self._back_s is None:
            self._back_s = now_s
        if now_s - self._back_s < OWED_S:
            return
        silent_s = self._back_s - self.all_silent_since_s
        if silent_s >= SILENCE_S and lateness.was_late_since(self.all_silent_since_s):
            self._log.add(STOOD_STILL.format(silent_s))
        elif self._all_silent:
            who = "servos" if self._silent_since else "all servos"
            self._log.add(f"{who} answer again after {silent_s:.1f} s")
        elif silent_s >= SILENCE_S:
            fault = f"no servo answered for {silent_s:.1f} s"
            self._log.add(lateness.blame(fault, CHECK_SUPPLY, now_s))
        self.all_silent_since_s = self._back_s = None
        self._all_silent = False

    def record_stopped(self, count: int, late: str, now_s: float) -> None:
        """Record that servos were stopped by their own watchdog and continue from their position.

        late: recent lateness of this computer as text, "" for none
        """
        servos = f"the watchdog of {count} servo{'s' if count > 1 else ''}"
        if late:
            text = f"{late}, so {servos} stopped them; they continue from their position"
            self._seldom.add(text, now_s, "late")
        else:
            self._seldom.add(
                f"{servos} stopped them, as packets get lost: check cable and plugs; they continue "
                "from their position", now_s, "lost",
            )  # fmt: skip

    def silent_for_s(self, now_s: float) -> float:
        """Return the time for which no servo has answered, seconds."""
        if len(self._silent_since) < len(self._setups):
            return 0.0
        return now_s - max(self._silent_since.values())
