"""Servos that are read together, and those that are silent.

Later servos in a group read wait for the earlier ones, so a silent servo must leave the group
immediately, and so must one whose answer is damaged, as it may spoil those of others. It is then
read alone, at once and after that at intervals.
"""

from collections.abc import Collection, Mapping, Sequence
from math import inf

from gazerig.drivers.event_log import EventLog
from gazerig.drivers.process.host_lateness import SILENCE_S, HostLateness

AGAIN_S = 0.15
"""Interval of attempts to read silent servos, which take turns; less than a servo's watchdog."""

BAD_LINE = "a second servo with its id, or a bad cable"

CHECK_SUPPLY = "check servo power and cable"


class PollList:
    """List of the servos to read, by id, in the order of the bus.

    Args:
        labels: Labels of the servos by id, in the order of the bus.
        log: Records silent servos, each once after a longer silence.
        lateness: Delays of this computer, which are reported as the cause if there were any.

    group: ids that are read together
    silent_since_s: beginning of the silence of servos out of the group
    """

    def __init__(self, labels: Mapping[int, str], log: EventLog, lateness: HostLateness) -> None:
        self._labels, self._log, self._lateness = labels, log, lateness
        self._silent: list[int] = []
        self._next_s = -inf
        self._damaged: set[int] = set()
        self._reported: set[int] = set()
        self._all_silent_until_s = -inf
        self.group = tuple(labels)
        self.silent_since_s: dict[int, float] = {}

    def next_due(self, now_s: float) -> int | None:
        """Return a silent servo to be read alone now."""
        return self._silent[0] if self._silent and now_s >= self._next_s else None

    def record_failure(self, servo_id: int, now_s: float, damaged: bool = False) -> None:
        """Record that a servo did not answer well; it is due immediately the first time."""
        if damaged:
            self._damaged.add(servo_id)
        else:
            self._damaged.discard(servo_id)
        if servo_id in self._silent:
            self._silent.remove(servo_id)
            self._silent.append(servo_id)
            self._next_s = now_s + AGAIN_S
        else:
            self._silent.insert(0, servo_id)
            self._next_s = now_s
        self.silent_since_s.setdefault(servo_id, now_s)
        self._regroup()

    def record_answer(self, servo_id: int) -> None:
        """Record a good answer: the other silent servos need not wait either."""
        if servo_id in self._silent:
            self._silent = [i for i in self._silent if i != servo_id and self.group]
            self._next_s = -inf
            self._regroup()

    def restore(self) -> None:
        """Read all servos together again, as the port was lost."""
        self._silent.clear()
        self._regroup()

    def _regroup(self) -> None:
        self.group = tuple(servo_id for servo_id in self._labels if servo_id not in self._silent)

    def report(self, answered: bool, now_s: float) -> dict[int, float]:
        """Report silent servos; return those that answer again, with the times of their silence.

        Args:
            answered: Whether any servo has answered.
            now_s: Present time.
        """
        if not answered:
            self._all_silent_until_s = now_s
        back = [servo_id for servo_id in self.silent_since_s if servo_id not in self._silent]
        silences_s = {i: now_s - self.silent_since_s.pop(i) for i in back}
        for servo_id in self._reported.intersection(back):
            self._reported.discard(servo_id)
            silent_s = silences_s[servo_id]
            self._log.add(f"{self._labels[servo_id]} answers again after {silent_s:.1f} s")
        for servo_id, since_s in self.silent_since_s.items() if answered else ():
            # While no servo answered, none in particular was silent.
            silent_s = now_s - max(since_s, self._all_silent_until_s)
            if servo_id not in self._reported and silent_s >= SILENCE_S:
                self._reported.add(servo_id)
                fault, remedy = "does not answer", CHECK_SUPPLY
                if servo_id in self._damaged:
                    fault, remedy = "answers, but its bytes arrive damaged", BAD_LINE
                fault = f"{self._labels[servo_id]} {fault}"
                self._log.add(self._lateness.blame(fault, remedy, now_s))
        return silences_s


def silent_servos(ids: Sequence[int], answered: Collection[int]) -> tuple[int, ...]:
    """Return the servos that were silent without being blocked by another.

    A servo waits for the one before it. So after the last answer only the first missing servo is to
    blame, while every servo missing before the last answer was silent itself.
    """
    missing = [i for i, servo_id in enumerate(ids) if servo_id not in answered]
    last_heard = max((i for i, servo_id in enumerate(ids) if servo_id in answered), default=-1)
    behind = [i for i in missing if i > last_heard][:1]
    return tuple(ids[i] for i in [i for i in missing if i < last_heard] + behind)
