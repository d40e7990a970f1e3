"""Supervision of servos between the exchanges, independent of a family's fault reports."""

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterable, Mapping
from math import inf, isfinite

from gazerig.drivers.bus.goal_limits import LimitRecovery
from gazerig.drivers.process.host_lateness import LATE_COMPUTER
from gazerig.drivers.servo_bus.faults import ServoHealth
from gazerig.drivers.servo_bus.feedback import FeedbackColumns
from gazerig.drivers.servo_bus.read_plan import ReadPlan, Sample
from gazerig.drivers.servo_bus.recovery import Recovery
from gazerig.drivers.servo_bus.torque import rearm_tripped
from gazerig.drivers.servo_bus.transaction import TRIES, Transactions
from gazerig.drivers.types import ServoConfig

AGAIN_S = 0.25
"""Time between attempts to set a servo up again, or to read the cause of an alert."""


class Supervisor(ABC):
    """Supervisor of the servos' health.

    Args:
        line: Exchanges on the bus.
        setups: The servos by id.
        recovery: Sets them up again.
        health: Their faults.
        feedback: Their feedback.
        plan: Plan of their reads.
        watchdog: Armed value of Bus Watchdog, in its units; 0 for none.

    engaged: whether torque is on
    entering: servos that move slowly into their limits
    withholds_goals: whether the supervisor may ever withhold goals
    due_s: ``service`` has nothing to do before this time
    limp: servos whose torque is off on purpose
    """

    withholds_goals = False

    def __init__(
        self,
        line: Transactions,
        setups: Mapping[int, ServoConfig],
        recovery: Recovery,
        health: ServoHealth,
        feedback: FeedbackColumns,
        plan: ReadPlan,
        watchdog: int = 0,
    ) -> None:
        self._line, self._family = line, line.family
        self._setups = setups
        self._ids = tuple(setups)
        self._slot = {servo_id: i for i, servo_id in enumerate(self._ids)}
        self._recovery = recovery
        self._health = health
        self._feedback = feedback
        self._plan = plan
        self._watchdog = watchdog
        self.engaged = False
        self.limp: frozenset[int] = frozenset()
        self.due_s = -inf
        self.entering = LimitRecovery(setups)
        self._suspects: set[int] = set()
        self._rearmed: set[int] = set()
        self._recover_at_s = self._check_at_s = -inf
        self._checked = 0
        self._failures = 0

    @property
    def is_idle(self) -> bool:
        """Return whether no servo has a condition that an answer could change."""
        return True

    def start_supervision(self, entering: Collection[int]) -> None:
        """Start supervision under torque; ``entering``: servos outside their limits."""
        self.engaged, self.limp = True, frozenset()
        for servo_id in tuple(self._recovery.astray):
            self._end_astray(servo_id)
        self.entering.begin(entering)
        self._suspects.clear()
        unit = self._family.watchdog_unit_s or 0.0
        self._line.starving_s, self._line.tries = self._watchdog * unit or inf, 1
        self._feedback.expect_torque(True)
        self._feedback.places.forget()

    def stop_supervision(self) -> None:
        """Stop supervision, as the servos have no torque."""
        self.engaged, self.limp = False, frozenset()
        self.entering.clear()
        self._suspects.clear()
        self._rearmed.clear()
        self._line.starving_s, self._line.starved, self._line.tries = inf, False, TRIES
        self._feedback.expect_torque(False)

    def set_limp(self, ids: Collection[int]) -> None:
        """Record the servos whose torque is off on purpose; others have it, limited slowly."""
        for servo_id in self.limp.difference(ids):
            steps = self._feedback.now.position_steps[self._slot[servo_id]]
            if isfinite(steps):
                self.entering.add_if_outside(servo_id, round(steps))
        self.limp, self.due_s = frozenset(ids), -inf
        self._feedback.expect_limp([self._slot[servo_id] for servo_id in ids])

    def mark_for_recovery(self, ids: Collection[int]) -> None:
        """Mark servos for recovery."""
        self._suspects.update(ids)
        self._recover_at_s = self.due_s = -inf

    def mark_all_for_recovery(self) -> None:
        """Mark every servo for recovery."""
        self._suspects.update(self._ids)
        self._recover_at_s = -inf
        self._feedback.places.forget()

    @abstractmethod
    def check_prepared(self) -> None:
        """Check servos that have just been prepared."""

    @abstractmethod
    def check_status(self, servo_id: int, sample: Sample, now_s: float) -> None:
        """Check one servo's answer for faults and for lost torque or limits."""

    @abstractmethod
    def service(self, group: Collection[int], now_s: float) -> None:
        """Do the tasks due after a read from ``due_s`` on; recover servos that work again.

        Raises:
            BusLost: the port is lost.
        """

    def withheld_ids(self, now_s: float) -> frozenset[int]:
        """Return the servos that must get no goals now."""
        return frozenset()

    def check_after_silence(self, servo_id: int) -> None:  # noqa: B027  # some have nothing to do
        """Check a servo that was out of the group."""

    def record_out_of_group(self, out: Collection[int], now_s: float) -> None:  # noqa: B027
        """Record the servos that are out of the group."""

    # --- servos to be set up again

    def _recover(self, group: Collection[int], now_s: float) -> None:
        """Set up servos again that may have restarted and answer; try again later after a failure.

        After a failure each is set up alone, so that no other servo waits for the failing one.
        """
        ids = tuple(i for i in self._ids if i in self._suspects and i in group)
        if not ids:
            return
        if self._failures:
            ids = (ids[self._failures % len(ids)],)
        self._recover_at_s = now_s + AGAIN_S
        found = self._recovery.recover(ids, self.engaged, now_s)
        if found is None:
            if self._failures:
                self._health.record_not_set_up(ids[0], now_s, self._line.lateness)
            self._failures += 1
            return
        self._suspects.difference_update(ids)
        if not self._suspects:
            self._failures = 0
        elif self._failures:
            self._recover_at_s = now_s
        at_s = self._line.port.now_s()
        for servo_id in ids:
            self._health.record_set_up(servo_id)
            self._name_fault(servo_id)
        if self.limp:
            self.set_limp(self.limp.difference(found))
        for servo_id, position in found.items():
            self._line.errors["rearmed"] += 1
            slot = self._slot[servo_id]
            self._feedback.hold(slot, position, at_s, self.engaged)
            self._clear_state(servo_id)
            if self.engaged:
                self._rearmed.add(servo_id)
                self.entering.add_if_outside(servo_id, position)

    def _check_turned_back(self, servo_id: int, sample: Sample) -> None:
        """Set a servo without torque up again that was turned back into its range by hand."""
        if not sample.is_blank and not self._recovery.astray_text(servo_id, sample.position):
            self._end_astray(servo_id)
            self.mark_for_recovery((servo_id,))

    def _end_astray(self, servo_id: int) -> None:
        self._recovery.astray.discard(servo_id)
        if servo_id in self._health.faults:
            self._health.latches.add(servo_id)
            self._health.record_cleared(servo_id)
            self._name_fault(servo_id)

    def _clear_state(self, servo_id: int) -> None:  # noqa: B027  # most have nothing to add
        """Clear the state of a servo that works again."""

    def recover_tripped(self, group: Iterable[int]) -> None:
        """Rearm servos that were stopped by their own watchdog."""
        self._line.starved = False
        ids = tuple(group)
        if not ids:
            return
        healed = rearm_tripped(self._line, ids, self._watchdog, self._recovery.clip)
        self._rearmed.update(healed)
        self.due_s = -inf
        if healed:
            now_s = self._line.port.now_s()
            late = self._line.lateness.cause(now_s)
            self._line.errors[LATE_COMPUTER if late else "watchdog"] += len(healed)
            self._health.record_stopped(len(healed), late, now_s)

    def _name_fault(self, servo_id: int) -> None:
        """Copy a servo's fault to the feedback."""
        self._feedback.record_fault(self._slot[servo_id], self._health.faults.get(servo_id, ""))

    def _next_to_check(self, group: Collection[int], again_s: float) -> int | None:
        """Return the next servo in rotation, None if it is out of the group."""
        self._check_at_s = again_s
        self._checked = (self._checked + 1) % len(self._ids)
        servo_id = self._ids[self._checked]
        return servo_id if servo_id in group else None

    # --- marks on answers

    def _mark_feedback(self, now_s: float) -> None:
        """Mark servos that enter their limits slowly, and once those that got torque again.

        On arrival a servo gets its full speed.
        """
        for slot, servo_id in enumerate(self._ids if self.entering.places else ()):
            if servo_id not in self.entering:
                continue
            steps = self._feedback.position(slot)
            if steps is not None:
                self._feedback.mark_rearmed(slot)
                if self.entering.has_arrived(servo_id, steps, now_s) and self._restore_full_speed(
                    servo_id
                ):
                    self.entering.end(servo_id)
        for servo_id in tuple(self._rearmed):
            slot = self._slot[servo_id]
            if self._feedback.position(slot) is not None:
                self._rearmed.discard(servo_id)
                self._feedback.mark_rearmed(slot)

    def _restore_full_speed(self, servo_id: int) -> bool:
        """Restore full speed, with the next goal or by a write; return whether a servo has it."""
        if self._family.goal_speed:
            return True
        name = self._family.arming.register
        (speed,) = self._recovery.speeds((servo_id,), ())
        self._line.write_all((servo_id,), name, (speed,))
        return self._line.ask((servo_id,), name).get(servo_id) == speed
