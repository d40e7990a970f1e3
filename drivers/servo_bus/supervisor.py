"""Looking after servos between the exchanges: what does not depend on how a family tells faults."""

from abc import ABC
from collections.abc import Collection, Mapping
from math import inf
from typing import Protocol

from gazerig.drivers.plausibility import Plausibility
from gazerig.drivers.servo_bus.faults import Health
from gazerig.drivers.servo_bus.recovery import Recovery
from gazerig.drivers.servo_bus.transaction import Line
from gazerig.drivers.slow_entry import SlowEntry
from gazerig.drivers.types import ServoReading, ServoSetup

AGAIN_S = 0.25
"""Time between attempts to set a servo up again, or to learn what an alert is about."""


class Feedback(Protocol):
    """What the supervisor asks of whoever makes readings.

    places: which positions can be true
    """

    places: Plausibility

    def name_fault(self, slot: int, fault: str) -> None:
        """Record what a servo suffers from, "" for nothing."""

    def held(self, slot: int, position: int, at_s: float, torque: bool) -> ServoReading:
        """Return the first reading of a servo that was just set up again and stands still."""


class Supervisor(ABC):
    """What is done about the servos' health.

    engaged: the torque is on
    entering: servos on their slow way into their limits
    """

    _readings: Feedback

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
        self._readings.places.forget()

    def _recover(
        self, readings: list[ServoReading | None], group: Collection[int], now_s: float
    ) -> None:
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
            self._readings.name_fault(self._slot[servo_id], self._health.faults.get(servo_id, ""))
        for servo_id, position in found.items():
            self._line.errors["rearmed"] += 1
            slot = self._slot[servo_id]
            readings[slot] = self._readings.held(slot, position, at_s, self.engaged)
            self._recovered(servo_id)
            if self.engaged:
                self._rearmed.add(servo_id)
                self.entering.add_outside(servo_id, position)

    def _recovered(self, servo_id: int) -> None:  # noqa: B027  # most have nothing to add
        """Forget what was thought of a servo that is well again."""

    def _mark_rearmed(self, readings: list[ServoReading | None]) -> None:
        for i, servo_id in enumerate(self._ids):
            reading = readings[i]
            if servo_id in self._rearmed and reading is not None:
                self._rearmed.discard(servo_id)
                readings[i] = reading._replace(rearmed=True)
