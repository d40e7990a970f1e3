"""Care for the servos between the exchanges: faults, restarts, tripped watchdogs.

An answer that is not that of a healthy servo only marks the servo. After the read the supervisor
asks each marked servo what is wrong with it. A fault is named, and asked about until it is gone. A
servo without a fault is set up as at the start: nothing written to it before is relied on, settings
are compared, the goal becomes the present position, and only then is torque switched on.
"""

from collections import deque
from collections.abc import Collection, Mapping
from math import inf

from gazerig.drivers.bus.goal_limits import far_outside_steps
from gazerig.drivers.errors import ServoFault, ServoMissing
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.process.host_lateness import LATE_COMPUTER
from gazerig.drivers.servo_bus.feedback import FeedbackColumns
from gazerig.drivers.servo_bus.poll_list import BAD_LINE
from gazerig.drivers.servo_bus.settings import apply_settings
from gazerig.drivers.servo_bus.torque import (
    WATCHDOG_S,
    enable,
    goal_speeds,
    read_positions,
    switch_off,
    write_verified,
)
from gazerig.drivers.servo_bus.transaction import TRIES, Transactions
from gazerig.drivers.types import ServoConfig

AGAIN_S = 0.5
"""Time between attempts to set a servo up, and between questions about a fault."""

PAUSE_S = 0.25
"""Time after a failed attempt, for which other servos waited, in which no servo is set up."""

TRIPPED = 255
"""Value of Bus Watchdog after it has stopped the servo."""

MOST_RESTARTS, WITHIN_S = 3, 10.0
"""A servo that restarts more often than this within this time stays without torque."""

ENTRY_S = 0.3
"""Time beyond that of its way after which a servo has moved into its limits, or never will."""

AGAIN_AND_AGAIN = "restarts again and again: supply too weak"
NOT_SET_UP = "cannot be set up again"


class Supervisor:
    """Supervisor of the servos of one bus; whatever uses the line raises BusLost if it is lost.

    Args:
        line: Exchanges on the bus.
        setups: The servos by id, with the present setups.
        feedback: Their feedback.
        log: Records events.

    engaged: whether torque is on
    held: servos that get no goals until they are set up, as some firmware switches torque on with a
        goal
    faults: present fault of a servo, by id
    speeds: speed limits of all servos in register units, slow for those outside their limits
    due_s: ``service`` has nothing to do before this time
    """

    def __init__(
        self,
        line: Transactions,
        setups: Mapping[int, ServoConfig],
        feedback: FeedbackColumns,
        log: EventLog,
    ) -> None:
        self._line, self._family = line, line.family
        self._setups, self._feedback, self._log = setups, feedback, log
        self._ids = tuple(setups)
        self._slot = {servo_id: i for i, servo_id in enumerate(self._ids)}
        self.engaged = False
        self.held: set[int] = set()
        self.faults: dict[int, str] = {}
        self.due_s = self._pause_until_s = -inf
        self._restarts_s = {i: deque[float](maxlen=MOST_RESTARTS) for i in self._ids}
        self._expected: dict[int, dict[str, int]] = {}  # registers under torque
        self._marked: dict[int, float] = {}  # time of the next attempt to set it up
        self._rearmed: dict[int, float] = {}  # end of its slow way, -inf if it has none
        self._set_speeds()

    def _set_speeds(self) -> None:
        slow = [servo_id for servo_id, until_s in self._rearmed.items() if until_s > -inf]
        self.speeds = goal_speeds(self._family, [*self._setups.values()], slow)

    # --- torque of all servos

    def enable_torque(self) -> tuple[int, ...]:
        """Set all servos up, switch their torque on, and supervise them; return their goals.

        Raises:
            ServoMissing: a servo does not answer or rejects a setting or its goal.
            ServoFault: a servo refuses its torque, or would move in the wrong direction.
        """
        # A servo may have restarted since it was prepared.
        apply_settings(self._line, self._setups, self._ids, self._log)
        goals, outside = enable(self._line, self._setups, self._ids)
        self.stop_supervision()
        self._marked.clear()
        for servo_id in [*self.faults]:
            self._set_fault(servo_id, "")
        for servo_id, setup in self._setups.items():
            expected = {**self._family.wanted_settings(setup), "torque_enable": 1}
            if self._family.goal_speed:
                acceleration = self._family.acceleration_units(setup.max_accel_steps_s2)
                expected[self._family.arming_register] = acceleration
            self._expected[servo_id] = expected
        self.engaged = True
        self._line.starving_s = WATCHDOG_S if self._family.watchdog_unit_s else inf
        self._line.tries = 1
        self._feedback.expect_torque(True)
        self._feedback.places.forget()
        self._record_rearmed(outside)
        return goals

    def stop_supervision(self) -> None:
        """Stop supervision, as the servos have no torque."""
        self.engaged = False
        self.held.clear()
        self._rearmed.clear()
        self._line.starving_s, self._line.starved, self._line.tries = inf, False, TRIES
        self._feedback.expect_torque(False)

    def _enable_again(self, ids: tuple[int, ...]) -> bool:
        """Give some servos torque again at their present positions; return whether they have it."""
        try:
            _, outside = enable(self._line, self._setups, ids)
        except (ServoMissing, ServoFault):
            for servo_id in ids:
                self.mark(servo_id)
            return False
        self._record_rearmed(outside)
        return True

    def _record_rearmed(self, ways_s: Mapping[int, float]) -> None:
        """Record servos that got torque, and the times of their ways into their limits."""
        now_s = self._line.port.now_s()
        self._rearmed |= {i: now_s + way_s + ENTRY_S for i, way_s in ways_s.items()}
        self._set_speeds()
        self.due_s = -inf

    # --- what answers tell

    def mark(self, servo_id: int, is_held: bool = True) -> None:
        """Mark a servo to be set up; ``is_held``: it gets no goals until then."""
        if servo_id not in self._marked:
            self._marked[servo_id] = self.due_s = -inf
        if is_held and self.engaged:
            self.held.add(servo_id)

    def mark_all(self) -> None:
        """Mark every servo, as the port was lost."""
        for servo_id in self._ids:
            self.mark(servo_id)
        self._feedback.places.forget()

    def check_polled(self, servo_id: int, values: Mapping[str, int]) -> None:
        """Check registers of one servo, by name, that are read at intervals."""
        if values.get(self._family.error_register):
            self.mark(servo_id, is_held=False)
        if not self.engaged:
            return
        expected = self._expected[servo_id]
        if any(expected.get(name, value) != value for name, value in values.items()):
            self.mark(servo_id)

    # --- after every read

    def service(self, group: Collection[int], now_s: float) -> None:
        """Do the tasks that are due after a read; set up one servo at most.

        Args:
            group: Servos that answer.
            now_s: Present time.
        """
        due = [i for i, at_s in self._marked.items() if at_s <= now_s and i in group]
        if due and now_s >= self._pause_until_s:
            self._attend(min(due, key=self._marked.__getitem__), now_s)
        for servo_id, until_s in [*self._rearmed.items()]:
            self._mark_rearmed(servo_id, until_s, now_s)
        self.due_s = -inf if self._rearmed else min(self._marked.values(), default=inf)

    def _mark_rearmed(self, servo_id: int, until_s: float, now_s: float) -> None:
        """Mark the answer of a servo that got torque again: plans must begin at its position.

        A servo outside its limits is marked until it has moved inside; then it gets its full speed,
        with its next goal or by a write.
        """
        slot = self._slot[servo_id]
        if slot in self._feedback.now.missing:
            return
        self._feedback.set(slot, rearmed=True)
        if now_s < until_s:
            return
        if until_s > -inf and not self._family.goal_speed:
            (speed,) = goal_speeds(self._family, (self._setups[servo_id],), ())
            try:
                write_verified(self._line, self._family.arming_register, {servo_id: speed})
            except ServoMissing:
                return
        del self._rearmed[servo_id]
        self._set_speeds()

    def recover_tripped(self, group: Collection[int]) -> None:
        """Rearm servos that were stopped by their own watchdog; they refuse goals until then."""
        self._line.starved = False
        values = self._line.ask(tuple(group), "bus_watchdog") if group else {}
        tripped = tuple(servo_id for servo_id, value in values.items() if value == TRIPPED)
        if not tripped or not self._enable_again(tripped):
            return
        self._rearmed = {**dict.fromkeys(tripped, -inf), **self._rearmed}
        late = self._line.lateness.cause(self._line.port.now_s())
        self._line.errors[LATE_COMPUTER if late else "watchdog"] += len(tripped)
        cause = late or "packets get lost (check cable and plugs)"
        stopped = f"so the watchdog of {len(tripped)} servos stopped them"
        self._log.add(f"{cause}, {stopped}; they continue from their position")

    # --- one marked servo

    def _attend(self, servo_id: int, now_s: float) -> None:
        """Set a marked servo up, or find out why that is not possible."""
        line, again_s = self._line, now_s + AGAIN_S
        tries, line.tries = line.tries, 1
        try:
            problem = self._set_up(servo_id, now_s)
        except ServoFault as error:
            problem = f"{NOT_SET_UP}: {error}"
            switch_off(line, (servo_id,))
        except ServoMissing:
            problem = line.lateness.blame(NOT_SET_UP, BAD_LINE, now_s)
            self._pause_until_s = now_s + PAUSE_S
        finally:
            line.tries = tries
        if problem:
            self._marked[servo_id] = inf if problem == AGAIN_AND_AGAIN else again_s
            self._set_fault(servo_id, problem)
            return
        del self._marked[servo_id]
        self.held.discard(servo_id)
        if servo_id in self.faults:
            self._set_fault(servo_id, "")
            self._log.add(f"{line.label(servo_id)}: the fault is gone")

    def _set_up(self, servo_id: int, now_s: float) -> str:
        """Set a servo up as at the start, with torque if the others have it; return its fault.

        Raises:
            ServoMissing: it does not answer or rejects something.
            ServoFault: it refuses its torque.
        """
        line, family, setup, ids = self._line, self._family, self._setups[servo_id], (servo_id,)
        arms, slot = self.engaged, self._slot[servo_id]
        line.write_all(ids, "status_return_level", [family.answer_level])
        found = dict[str, int]()
        for name in ("torque_enable", "model_number", family.error_register):
            values = line.ask(ids, name)
            if not values:
                raise ServoMissing(f"{line.label(servo_id)} does not answer")
            found[name] = values[servo_id]
        if found["model_number"] != family.models[setup.model].number:
            return f"is no longer {setup.model}: exchanged?"
        has_restarted = arms and not found["torque_enable"]
        if has_restarted:
            self.held.add(servo_id)
            self._feedback.set(slot, torque=False)
        if found[family.error_register]:
            return " and ".join(family.name_errors(found[family.error_register]))
        position = read_positions(line, ids)[servo_id]
        misplaced = far_outside_steps(setup, position)
        if arms and misplaced:
            switch_off(line, ids)
            return misplaced
        apply_settings(line, self._setups, ids, self._log)
        if arms:
            restarts_s = self._restarts_s[servo_id]
            often = len(restarts_s) == MOST_RESTARTS and now_s - restarts_s[0] < WITHIN_S
            if has_restarted and often:
                return AGAIN_AND_AGAIN
            _, outside = enable(line, self._setups, ids)
            self._record_rearmed({servo_id: -inf, **outside})
            line.errors["rearmed"] += 1
            if has_restarted:
                line.errors["restarted"] += 1
                restarts_s.append(now_s)
                self._log.add(f"{line.label(servo_id)} restarted: set up again")
        self._feedback.hold(slot, position, line.port.now_s(), arms)
        return ""

    def _set_fault(self, servo_id: int, fault: str) -> None:
        """Record and report the fault of a servo; "" clears it."""
        if self.faults.pop(servo_id, "") != fault and fault:
            self._line.errors["alert"] += 1
            self._log.add(f"{self._line.label(servo_id)}: {fault}")
        if fault:
            self.faults[servo_id] = fault
        self._feedback.set(self._slot[servo_id], fault=fault)
