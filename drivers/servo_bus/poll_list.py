"""Servos of the group read, servos removed from it, and times of the next attempts.

Later servos in a group read wait for the earlier ones, so a silent servo must leave the group
immediately. It is then read alone, immediately and after that at increasing intervals.
"""

from collections.abc import Collection, Sequence

AGAIN_FIRST_S, AGAIN_LAST_S = 0.0625, 0.5
"""Interval of attempts to read a silent servo: doubled from the first to the last value."""

DAMAGED_IN_A_ROW = 3
"""Consecutive damaged answers after which a servo leaves the group, as it costs every read its time
limit."""


class PollList:
    """List of the servos to read, by id, in the order of the bus.

    group: ids that are read together
    is_troubled: whether a servo is out of the group or has answered badly recently
    garbling_ids: ids of servos out of the group because their answers arrive damaged
    """

    def __init__(self, ids: Sequence[int]) -> None:
        self._ids = tuple(ids)
        self._due_s: dict[int, float] = {}
        self._wait_s: dict[int, float] = {}
        self._damaged: dict[int, int] = {}
        self.group = self._ids
        self.is_troubled = False
        self.garbling_ids: set[int] = set()

    @property
    def out_ids(self) -> tuple[int, ...]:
        """Return the ids of servos out of the group."""
        return tuple(self._due_s)

    def next_due(self, now_s: float) -> int | None:
        """Return a servo to be read alone now; if all are out there is always one."""
        waiting = self._due_s
        ready = [i for i, due_s in waiting.items() if due_s <= now_s or not self.group]
        return min(ready, key=waiting.__getitem__, default=None)

    def record_silent(self, servo_id: int, now_s: float) -> None:
        """Record that a servo did not answer; it is due immediately the first time."""
        if servo_id in self._due_s:
            wait_s = self._wait_s.get(servo_id, AGAIN_FIRST_S)
            self._due_s[servo_id] = now_s + wait_s
            self._wait_s[servo_id] = min(2.0 * wait_s, AGAIN_LAST_S)
        else:
            self._due_s[servo_id] = now_s
        self._regroup()

    def record_damaged(self, servo_id: int, now_s: float) -> None:
        """Record that a servo's answer arrived damaged."""
        self._damaged[servo_id] = self._damaged.get(servo_id, 0) + 1
        self.is_troubled = True
        if self._damaged[servo_id] >= DAMAGED_IN_A_ROW or servo_id in self._due_s:
            self.garbling_ids.add(servo_id)
            self.record_silent(servo_id, now_s)

    def record_answer(self, servo_id: int) -> bool:
        """Record a good answer; return whether the servo had been out."""
        self.garbling_ids.discard(servo_id)
        if self._damaged.pop(servo_id, None) is not None:
            self.is_troubled = bool(self._due_s or self._damaged)
        if self._due_s.pop(servo_id, None) is None:
            return False
        self._wait_s.pop(servo_id, None)
        if not self.group:
            # The whole line has recovered: the other servos need not wait.
            self._due_s.clear()
            self._wait_s.clear()
        self._regroup()
        return True

    def _regroup(self) -> None:
        self.group = tuple(servo_id for servo_id in self._ids if servo_id not in self._due_s)
        self.is_troubled = bool(self._due_s or self._damaged)


def silent_servos(ids: Sequence[int], answered: Collection[int]) -> tuple[int, ...]:
    """Return the servos that were silent without being blocked by another.

    A servo waits for the one before it. So after the last answer only the first missing servo is to
    blame, while every servo missing before the last answer was silent itself.
    """
    missing = [i for i, servo_id in enumerate(ids) if servo_id not in answered]
    last_heard = max((i for i, servo_id in enumerate(ids) if servo_id in answered), default=-1)
    behind = [i for i in missing if i > last_heard][:1]
    return tuple(ids[i] for i in [i for i in missing if i < last_heard] + behind)
