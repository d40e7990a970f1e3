"""Servos that fall silent and answer again, as text."""

from collections.abc import Collection, Mapping

from gazerig.drivers.event_log import EventLog, RateLimitedLog
from gazerig.drivers.process.host_lateness import BLAME_S, SILENCE_S, HostLateness
from gazerig.drivers.types import ServoConfig

GARBLES = "answers, but its bytes arrive damaged"

BAD_LINE = "a second servo with its id, or a bad cable"

CHECK_SUPPLY = "check servo power and cable"

SAY_SILENT_S, BUSY_S = 0.25, 2.0
"""Silence after which a servo is reported: one lost answer is not an event. The longer one counts
while answers arrive late."""


class SilenceLog:
    """Reports of silent servos.

    Args:
        setups: The servos by id.
        log: Records the reports.
        lateness: Delays of this computer, which are reported as the cause if there were any.
    """

    def __init__(
        self, setups: Mapping[int, ServoConfig], log: EventLog, lateness: HostLateness
    ) -> None:
        self._setups, self._log, self._lateness = setups, log, lateness
        self._seldom = RateLimitedLog(log)
        self._silent_since: dict[int, float] = {}
        self._reported: set[int] = set()
        self._all_since_s: float | None = None
        self._all_reported = False

    def update(
        self, out: Collection[int], garbling: Collection[int], answered: bool, now_s: float
    ) -> None:
        """Record the silent servos; report each once after a longer silence.

        Args:
            out: Servos without a good answer for some reads.
            garbling: Those of them whose answers arrive damaged.
            answered: Whether any servo has answered.
            now_s: Present time.
        """
        if answered and self._all_since_s is not None:
            self._report_end_of_silence(self._all_since_s, now_s)
            # While no servo answered, none in particular was silent.
            self._silent_since = dict.fromkeys(self._silent_since, now_s)
            self._all_since_s, self._all_reported = None, False
        elif not answered and self._all_since_s is None:
            self._all_since_s = now_s
        for servo_id in [i for i in self._silent_since if i not in out]:
            since_s = self._silent_since.pop(servo_id)
            if servo_id in self._reported:
                self._reported.discard(servo_id)
                self._log.add(
                    f"{self._label(servo_id)} answers again after {now_s - since_s:.1f} s"
                )
        for servo_id in out:
            self._silent_since.setdefault(servo_id, now_s)
        late = self._lateness.late_answers(now_s)
        longest_s = now_s - min(self._silent_since.values(), default=now_s)
        if late and SAY_SILENT_S <= longest_s < BUSY_S:
            self._seldom.add(f"this computer is busy: {late} answers late in the last s", now_s)
            return
        for servo_id in out if self._all_since_s is None else ():
            silent_s = now_s - self._silent_since[servo_id]
            if servo_id not in self._reported and silent_s >= SAY_SILENT_S:
                self._reported.add(servo_id)
                text = f"{self._label(servo_id)} does not answer: {CHECK_SUPPLY}"
                if servo_id in garbling:
                    fault = f"{self._label(servo_id)} {GARBLES}"
                    text = self._lateness.blame(fault, BAD_LINE, now_s)
                self._log.add(text)
        all_s = self._all_since_s
        if all_s is not None and not self._all_reported and now_s - all_s >= BLAME_S:
            self._all_reported = True
            self._log.add(self._lateness.blame("no servo answers", CHECK_SUPPLY, now_s, all_s))

    def _report_end_of_silence(self, since_s: float, now_s: float) -> None:
        silent_s = now_s - since_s
        if self._all_reported:
            self._log.add(f"servos answer again after {silent_s:.1f} s")
        elif silent_s >= SILENCE_S:
            fault = f"no servo answered for {silent_s:.1f} s"
            self._log.add(self._lateness.blame(fault, CHECK_SUPPLY, now_s, since_s))

    def silent_for_s(self, now_s: float) -> float:
        """Return the time for which no servo has answered, seconds."""
        return 0.0 if self._all_since_s is None else now_s - self._all_since_s

    def _label(self, servo_id: int) -> str:
        return self._setups[servo_id].label()
