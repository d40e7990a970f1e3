"""Who is asked in the group read, who is left out of it, and when to ask those again.

Servos later in a group read wait for the ones before them, so one that keeps silent must
leave the group at once; it is then asked alone, at once and after that ever more seldom.
"""

from collections.abc import Collection, Sequence

AGAIN_FIRST_S, AGAIN_LAST_S = 0.0625, 0.5
"""Time between attempts at a servo that stays silent: doubled from the first to the last."""

DAMAGED_IN_A_ROW = 3
"""A servo whose answers arrive damaged so often costs every read its time limit: out."""


class PollList:
    """The servos by id, in the order of the bus.

    group: those asked together
    troubled: whether a servo is out of the group or has answered badly recently
    garbling: those who are out because what they answer arrives damaged
    """

    def __init__(self, ids: Sequence[int]) -> None:
        self._ids = tuple(ids)
        self._due_s: dict[int, float] = {}
        self._wait_s: dict[int, float] = {}
        self._damaged: dict[int, int] = {}
        self.group = self._ids
        self.troubled = False
        self.garbling: set[int] = set()

    @property
    def out(self) -> tuple[int, ...]:
        """Name those who are out of the group."""
        return tuple(self._due_s)

    def due(self, now_s: float) -> int | None:
        """Name one servo to be asked alone now; where all are out there is always one."""
        waiting = self._due_s
        ready = [i for i, due_s in waiting.items() if due_s <= now_s or not self.group]
        return min(ready, key=waiting.__getitem__, default=None)

    def silent(self, servo_id: int, now_s: float) -> None:
        """Record that a servo did not answer; one that is new to that is due at once."""
        if servo_id in self._due_s:
            wait_s = self._wait_s.get(servo_id, AGAIN_FIRST_S)
            self._due_s[servo_id] = now_s + wait_s
            self._wait_s[servo_id] = min(2.0 * wait_s, AGAIN_LAST_S)
        else:
            self._due_s[servo_id] = now_s
        self._regroup()

    def damaged(self, servo_id: int, now_s: float) -> None:
        """Record that a servo's answer arrived damaged."""
        self._damaged[servo_id] = self._damaged.get(servo_id, 0) + 1
        self.troubled = True
        if self._damaged[servo_id] >= DAMAGED_IN_A_ROW or servo_id in self._due_s:
            self.garbling.add(servo_id)
            self.silent(servo_id, now_s)

    def answered(self, servo_id: int) -> bool:
        """Record a good answer; return whether the servo had been out."""
        self.garbling.discard(servo_id)
        if self._damaged.pop(servo_id, None) is not None:
            self.troubled = bool(self._due_s or self._damaged)
        if self._due_s.pop(servo_id, None) is None:
            return False
        self._wait_s.pop(servo_id, None)
        if not self.group:
            # The whole line was dead and is back: no reason to let the others wait.
            self._due_s.clear()
            self._wait_s.clear()
        self._regroup()
        return True

    def _regroup(self) -> None:
        self.group = tuple(servo_id for servo_id in self._ids if servo_id not in self._due_s)
        self.troubled = bool(self._due_s or self._damaged)


def silent_servos(ids: Sequence[int], answered: Collection[int]) -> tuple[int, ...]:
    """Name the servos that kept silent of their own accord.

    A servo waits for the one before it, so behind the last one heard only the first is
    to blame; what is missing before the last one heard has no other cause.
    """
    missing = [i for i, servo_id in enumerate(ids) if servo_id not in answered]
    last_heard = max((i for i, servo_id in enumerate(ids) if servo_id in answered), default=-1)
    behind = [i for i in missing if i > last_heard][:1]
    return tuple(ids[i] for i in [i for i in missing if i < last_heard] + behind)
