"""Looking after servos between the exchanges: what does not depend on how a family tells faults."""

from abc import ABC
from collections.abc import Collection, Mapping
from math import inf

from gazerig.drivers.servo_bus.faults import Health
from gazerig.drivers.servo_bus.feedback import FeedbackColumns
from gazerig.drivers.servo_bus.recovery import Recovery
from gazerig.drivers.servo_bus.transaction import Line
from gazerig.drivers.slow_entry import SlowEntry
from gazerig.drivers.types import ServoSetup

AGAIN_S = 0.25
"""Time between attempts to set a servo up again, or to learn what an alert is about."""


class Supervisor(ABC):
    """What is done about the servos' health.

    engaged: the torque is on
    entering: servos on their slow way into their limits
    """

    _feedback: FeedbackColumns

    def __init__(
        self, line: Line, setups: Mapping[int, ServoSetup], recovery: Recovery, health: Health
    ) -> None:
        self._line = line
        self._setups = setups
        self._ids = tuple(setups)
        self._slot = {servo_id: i for i, servo_id in enumerate(self._ids)}
        self._recovery = recovery
        self._health = health
        self.engaged = False
        self.entering = SlowEntry(setups)
        self._suspects: set[int] = set()
        self._rearmed: set[int] = set()
        self._recover_at_s = -inf

    def mark_all_for_recovery(self) -> None:
        """Trust no servo to be as it was left."""
        self._suspects.update(self._ids)
        self._recover_at_s = -inf
        self._feedback.places.forget()

    def _recover(self, group: Collection[int], now_s: float) -> None:
        """Set up again who may have restarted and answers; tried again later where that fails."""
        ids = tuple(i for i in self._ids if i in self._suspects and i in group)
        if not ids:
            return
        self._recover_at_s = now_s + AGAIN_S
        found = self._recovery.recover(ids, self.engaged, now_s)
        if found is None:
            return
        self._suspects.difference_update(ids)
        at_s = self._line.port.now_s()
        for servo_id in ids:
            self._feedback.name_fault(self._slot[servo_id], self._health.faults.get(servo_id, ""))
        for servo_id, position in found.items():
            self._line.errors["rearmed"] += 1
            slot = self._slot[servo_id]
            self._feedback.hold(slot, position, at_s, self.engaged)
            self._recovered(servo_id)
            if self.engaged:
                self._rearmed.add(servo_id)
                self.entering.add_outside(servo_id, position)

    def _recovered(self, servo_id: int) -> None:  # noqa: B027  # most have nothing to add
        """Forget what was thought of a servo that is well again."""

    def _mark_rearmed(self) -> None:
        """Mark the first answer of servos whose torque came on anew."""
        for servo_id in tuple(self._rearmed):
            slot = self._slot[servo_id]
            if self._feedback.position(slot) is not None:
                self._rearmed.discard(servo_id)
                self._feedback.mark_rearmed(slot)

    def _arrived(self, now_s: float) -> tuple[int, ...]:
        """Mark the answers of servos on their slow way; return those that have arrived."""
        there = []
        for slot, servo_id in enumerate(self._ids):
            if servo_id not in self.entering:
                continue
            steps = self._feedback.position(slot)
            if steps is not None:
                self._feedback.mark_rearmed(slot)
                if self.entering.arrived(servo_id, steps, now_s):
                    there.append(servo_id)
        return tuple(there)
