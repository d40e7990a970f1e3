"""Care for the servos between the exchanges: faults, restarts, tripped watchdogs, limp joints.

An answer that is not that of a healthy servo only marks the servo. After the read the supervisor
asks each marked servo what is wrong with it. A fault is named, and asked about until it is gone. A
servo without a fault is set up as at the start: nothing written to it before is relied on, settings
are compared, the goal becomes the present position, and only then is torque switched on.
"""

from collections.abc import Collection, Mapping
from math import inf

from gazerig.drivers.bus.goal_limits import far_outside_steps
from gazerig.drivers.errors import ServoFault, ServoMissing
from gazerig.drivers.event_log import EventLog, RateLimitedLog
from gazerig.drivers.process.host_lateness import LATE_COMPUTER
from gazerig.drivers.servo_bus.feedback import FeedbackColumns
from gazerig.drivers.servo_bus.provisioning import Provisioning
from gazerig.drivers.servo_bus.silence import BAD_LINE
from gazerig.drivers.servo_bus.torque import (
    crosses_zero,
    enable,
    goal_speeds,
    read_positions,
    switch_off,
    write_verified,
)
from gazerig.drivers.servo_bus.transaction import TRIES, Transactions
from gazerig.drivers.types import ServoConfig

AGAIN_S = 0.5
"""Time between attempts to set a servo up, and between questions about a fault, whose bit may
flicker at its threshold."""

PAUSE_S = 0.25
"""Time after a failed attempt in which no servo is set up."""

RESTART_S = 0.1
"""Silence after which a servo may have restarted: it gets no goals until it is set up."""

TRIPPED = 255
"""Value of Bus Watchdog after it has stopped the servo."""

MOST_RESTARTS, WITHIN_S = 3, 10.0
"""A servo that restarts more often than this within this time stays without torque."""

ENTRY_S = 0.3
"""Time beyond that of its way after which a servo has moved into its limits, or never will."""

AGAIN_AND_AGAIN = "restarts again and again: supply too weak"
FAR_SIDE = "is beyond its encoder's zero: turn it into its range by hand, then restart its power"
NOT_SET_UP = "cannot be set up again"


class Supervisor:
    """Supervisor of the servos of one bus.

    Args:
        line: Exchanges on the bus.
        setups: The servos by id.
        provisioning: Their settings.
        feedback: Their feedback.
        log: Records events.
        watchdog: Armed value of Bus Watchdog, in its units; 0 for none.

    engaged: whether torque is on
    limp: servos whose torque is off on purpose
    faults: present fault of a servo, by id
    speeds: speed limits of all servos in register units, slow for those outside their limits
    due_s: ``service`` has nothing to do before this time
    """

    def __init__(
        self,
        line: Transactions,
        setups: Mapping[int, ServoConfig],
        provisioning: Provisioning,
        feedback: FeedbackColumns,
        log: EventLog,
        watchdog: int = 0,
    ) -> None:
        self._line, self._family = line, line.family
        self._setups = setups
        self._ids = tuple(setups)
        self._slot = {servo_id: i for i, servo_id in enumerate(self._ids)}
        self._provisioning = provisioning
        self._feedback = feedback
        self._log, self._seldom = log, RateLimitedLog(log)
        self._watchdog = watchdog
        self.engaged = False
        self.limp: frozenset[int] = frozenset()
        self.faults: dict[int, str] = {}
        self.due_s = self._pause_until_s = -inf
        self._restarts: dict[int, list[float]] = {servo_id: [] for servo_id in self._ids}
        self._marked: dict[int, float] = {}  # time of the next attempt to set it up
        self._problems: dict[int, tuple[str, int]] = {}  # result of attempts, and their number
        self._prepared: dict[int, bool] = {}  # only lacks torque; whether it had it
        self._held: set[int] = set()  # gets no goals until it is set up
        self._silent_since_s: dict[int, float] = {}
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
        self._provisioning.apply(self._ids)
        goals, outside = enable(self._line, self._setups, self._ids, self._watchdog)
        self.stop_supervision()
        self._marked.clear()
        self._problems.clear()
        for servo_id in [*self.faults]:
            self._clear_fault(servo_id)
        self.engaged = True
        unit_s = self._family.watchdog_unit_s or 0.0
        self._line.starving_s, self._line.tries = self._watchdog * unit_s or inf, 1
        self._feedback.expect_torque(True)
        self._feedback.places.forget()
        self._record_rearmed(outside)
        return goals

    def stop_supervision(self) -> None:
        """Stop supervision, as the servos have no torque."""
        self.engaged, self.limp = False, frozenset()
        self._held.clear()
        self._prepared.clear()
        self._silent_since_s.clear()
        self._rearmed.clear()
        self._line.starving_s, self._line.starved, self._line.tries = inf, False, TRIES
        self._feedback.expect_torque(False)

    def set_limp(self, wanted: Collection[int]) -> None:
        """Switch torque off on these servos; all others that were limp get it again.

        A servo that does not confirm keeps its torque. One that refuses it is set up by later
        reads.

        Raises:
            BusLost: the port is lost.
        """
        off, on = tuple(set(wanted) - self.limp), tuple(self.limp.difference(wanted))
        if not off and not on:
            return
        limp = self.limp.difference(on)
        if off:
            released = switch_off(self._line, off)
            limp |= set(off).difference(released.holding_ids, released.unconfirmed_ids)
        self.limp = limp
        self._enable_again(on)
        self._feedback.expect_limp([self._slot[servo_id] for servo_id in limp])

    def _enable_again(self, ids: tuple[int, ...]) -> bool:
        """Give some servos torque again at their present positions; return whether they have it."""
        try:
            _, outside = enable(self._line, self._setups, ids, self._watchdog)
        except (ServoMissing, ServoFault):
            for servo_id in ids:
                self._mark(servo_id, is_held=True)
            return False
        self._record_rearmed(outside)
        return True

    def _record_rearmed(self, ways_s: Mapping[int, float]) -> None:
        """Record servos that got torque, and the times of their ways into their limits."""
        now_s = self._line.port.now_s()
        self._rearmed |= {i: now_s + way_s + ENTRY_S for i, way_s in ways_s.items()}
        self._set_speeds()
        self.due_s = -inf

    # --- goals

    def withheld_ids(self, now_s: float) -> frozenset[int]:
        """Return the servos that must get no goals now.

        Some firmware switches torque on with a goal, so a servo that may have restarted, or has no
        torque, first gets its present position as goal.
        """
        if not self._silent_since_s and not self._held:
            return self.limp
        silent = {i for i, at_s in self._silent_since_s.items() if now_s - at_s >= RESTART_S}
        return self.limp | silent | self._held

    # --- what answers tell

    def check_status(self, servo_id: int, error: int) -> None:
        """Check the error bits of an answer: those of the packet, and of the fault's register."""
        if error:
            self._mark(servo_id)

    def check_polled(self, servo_id: int, values: Mapping[str, int]) -> None:
        """Check registers of one servo, by name, that are read at intervals."""
        if values.get(self._family.error_register):
            self._mark(servo_id)
        if not self.engaged or servo_id in self.limp:
            return
        speed, accel = self._family.arming.limits_speed, self._setups[servo_id].max_accel_steps_s2
        wanted = {**self._provisioning.wanted(servo_id), "torque_enable": 1}
        if not speed:
            wanted[self._family.arming.register] = self._family.acceleration_units(accel)
        if any(values.get(name, value) != value for name, value in wanted.items()):
            self._mark(servo_id, is_held=True)

    def record_out_of_group(self, out: Collection[int], now_s: float) -> None:
        """Record the servos that do not answer; those that return later may have restarted."""
        for servo_id in [i for i in self._silent_since_s if i not in out]:
            if now_s - self._silent_since_s.pop(servo_id) >= RESTART_S:
                self._mark(servo_id, is_held=True)
        for servo_id in out:
            self._silent_since_s.setdefault(servo_id, now_s)

    def mark_all_for_recovery(self) -> None:
        """Mark every servo, as the port was lost."""
        for servo_id in self._ids:
            self._mark(servo_id, is_held=True)
        self._feedback.places.forget()

    def _mark(self, servo_id: int, is_held: bool = False) -> None:
        """Mark a servo; ``is_held``: it gets no goals until it is set up."""
        if servo_id not in self._marked:
            self._marked[servo_id] = self.due_s = -inf
        if is_held:
            self._prepared.pop(servo_id, None)
            if self.engaged:
                self._held.add(servo_id)

    # --- after every read

    def service(self, group: Collection[int], now_s: float) -> None:
        """Do the tasks that are due after a read: one step of setting up one servo at most.

        Args:
            group: Servos that answer.
            now_s: Present time.

        Raises:
            BusLost: the port is lost.
        """
        due = [i for i, at_s in self._marked.items() if at_s <= now_s and i in group]
        if due and now_s >= self._pause_until_s:
            self._attend(min(due, key=self._marked.__getitem__), now_s)
        if self._rearmed:
            self._mark_feedback(now_s)
        self.due_s = -inf if self._rearmed else min(self._marked.values(), default=inf)

    def recover_tripped(self, group: Collection[int]) -> None:
        """Rearm servos that were stopped by their own watchdog; they refuse goals until then.

        Raises:
            BusLost: the port is lost.
        """
        self._line.starved = False
        values = self._line.ask(tuple(group), "bus_watchdog") if group else {}
        tripped = tuple(servo_id for servo_id, value in values.items() if value == TRIPPED)
        if not tripped or not self._enable_again(tripped):
            return
        self._rearmed = {**dict.fromkeys(tripped, -inf), **self._rearmed}
        now_s = self._line.port.now_s()
        late = self._line.lateness.cause(now_s)
        self._line.errors[LATE_COMPUTER if late else "watchdog"] += len(tripped)
        cause = late or "packets get lost (check cable and plugs)"
        self._seldom.add(
            f"{cause}, so the watchdog of {len(tripped)} servos stopped them; they continue from "
            "their position", now_s,
        )  # fmt: skip

    # --- one marked servo

    def _attend(self, servo_id: int, now_s: float) -> None:
        """Find out what a marked servo lacks, set it up if it has no fault, and give it torque.

        Torque follows in the next read, as other servos are waiting.
        """
        arms, position, problem = self.engaged and servo_id not in self.limp, 0, ""
        before, self._line.tries = self._line.tries, 1
        try:
            if servo_id not in self._prepared:
                problem = self._prepare(servo_id, arms, now_s)
                if arms and not problem:
                    return
            if not problem:
                position = self._arm(servo_id, now_s) if arms else self._position(servo_id)
        except (ServoMissing, ServoFault) as error:
            self._prepared.pop(servo_id, None)
            problem = NOT_SET_UP
            self._pause_until_s = now_s + PAUSE_S  # it takes time that other servos wait
            if isinstance(error, ServoFault):
                problem = f"{NOT_SET_UP}: {error}"
                switch_off(self._line, (servo_id,))
        finally:
            self._line.tries = before
        # Damaged bytes may look like a fault: it must be found twice.
        before_problem, times = self._problems.get(servo_id, ("", 0))
        times = times + 1 if problem == before_problem else 1
        if problem:
            self._problems[servo_id] = problem, times
            self._marked[servo_id] = now_s
            if times > 1 or problem == NOT_SET_UP:
                self._marked[servo_id] = inf if problem == AGAIN_AND_AGAIN else now_s + AGAIN_S
            if times == 2 and problem == NOT_SET_UP:
                fault = f"{self._line.label(servo_id)} {NOT_SET_UP}"
                self._log.add(self._line.lateness.blame(fault, BAD_LINE, now_s))
            elif times == 2:
                self._record_fault(servo_id, problem)
            return
        del self._marked[servo_id]
        self._problems.pop(servo_id, None)
        self._held.discard(servo_id)
        if servo_id in self.faults:
            self._clear_fault(servo_id)
            self._log.add(f"{self._line.label(servo_id)}: the fault is gone")
        self._prepared.pop(servo_id, None)
        self._feedback.hold(self._slot[servo_id], position, self._line.port.now_s(), arms)

    def _prepare(self, servo_id: int, arms: bool, now_s: float) -> str:
        """Set a servo up as at the start, but for its torque; return its fault, "" for none.

        Raises:
            ServoMissing: it does not answer or rejects something.
        """
        line, family, setup, ids = self._line, self._family, self._setups[servo_id], (servo_id,)
        line.write_all(ids, "status_return_level", [family.answer_level])
        names = ("torque_enable", "model_number", family.error_register)
        found = [line.ask(ids, name).get(servo_id) for name in names]
        if None in found:
            raise ServoMissing(f"{line.label(servo_id)} does not answer")
        torque, number, bits = found
        if number != family.models[setup.model].number:
            return f"is no longer {setup.model}: exchanged?"
        if arms and not torque:
            self._held.add(servo_id)
            self._feedback.set_torque(self._slot[servo_id], False)
        if bits:
            return " and ".join(family.name_errors(bits))
        if arms and (text := self._misplaced_text(setup, self._position(servo_id))):
            switch_off(line, ids)
            return text
        self._provisioning.apply(ids)
        restarts = [t_s for t_s in self._restarts[servo_id] if now_s - t_s < WITHIN_S]
        self._restarts[servo_id] = restarts
        if arms and not torque and len(restarts) >= MOST_RESTARTS:
            return AGAIN_AND_AGAIN
        self._prepared[servo_id] = bool(torque)
        return ""

    def _arm(self, servo_id: int, now_s: float) -> int:
        """Give a prepared servo torque; return its position.

        Raises:
            ServoMissing: it does not answer or rejects something.
            ServoFault: it refuses its torque.
        """
        line = self._line
        (position,), outside = enable(line, self._setups, (servo_id,), self._watchdog)
        self._record_rearmed({servo_id: -inf, **outside})
        line.errors["rearmed"] += 1
        if not self._prepared[servo_id]:
            line.errors["restarted"] += 1
            self._restarts[servo_id].append(now_s)
            self._log.add(f"{line.label(servo_id)} restarted: set up again")
        return self._position(servo_id) if outside else position

    def _position(self, servo_id: int) -> int:
        (position,) = read_positions(self._line, (servo_id,))
        return position

    def _misplaced_text(self, setup: ServoConfig, position: int) -> str:
        """Return why a servo must get no torque where it is, "" if it may."""
        if crosses_zero(self._family, setup, position):
            return FAR_SIDE
        return far_outside_steps(setup, position)

    def _record_fault(self, servo_id: int, fault: str) -> None:
        if self.faults.get(servo_id) != fault:
            self.faults[servo_id] = fault
            self._line.errors["alert"] += 1
            self._log.add(f"{self._line.label(servo_id)}: {fault}")
            self._feedback.record_fault(self._slot[servo_id], fault)

    def _clear_fault(self, servo_id: int) -> None:
        del self.faults[servo_id]
        self._feedback.record_fault(self._slot[servo_id], "")

    # --- marks on answers

    def _mark_feedback(self, now_s: float) -> None:
        """Mark answers of servos that got torque again: plans must begin at their positions.

        A servo outside its limits is marked until it has moved inside; then it gets its full speed.
        """
        for servo_id, until_s in [*self._rearmed.items()]:
            slot = self._slot[servo_id]
            if self._feedback.position(slot) is not None:
                self._feedback.mark_rearmed(slot)
                if until_s == -inf or now_s >= until_s and self._restore_full_speed(servo_id):
                    del self._rearmed[servo_id]
                    self._set_speeds()

    def _restore_full_speed(self, servo_id: int) -> bool:
        """Restore full speed, with the next goal or by a write; return whether a servo has it."""
        speed = goal_speeds(self._family, (self._setups[servo_id],), ())
        try:
            if not self._family.goal_speed:
                write_verified(self._line, (servo_id,), self._family.arming.register, speed)
        except ServoMissing:
            return False
        return True
