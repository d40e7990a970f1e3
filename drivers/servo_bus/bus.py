"""Smart servos of one family on one serial bus: one read and one write per tick."""

from collections.abc import Mapping, Sequence
from math import inf

from gazerig.drivers.bus.goal_limits import clip_goals
from gazerig.drivers.bus.port_bus import PortBus
from gazerig.drivers.bus.release_result import ReleaseResult
from gazerig.drivers.errors import BusLost, ServoFault, ServoMissing
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.serial.port import TIMING, BusPort, BusTiming, open_port
from gazerig.drivers.servo_bus.discovery import find, name_firmware
from gazerig.drivers.servo_bus.family import Family, GoalWrite
from gazerig.drivers.servo_bus.feedback import FeedbackColumns
from gazerig.drivers.servo_bus.poll_list import CHECK_SUPPLY, PollList
from gazerig.drivers.servo_bus.settings import apply_settings
from gazerig.drivers.servo_bus.supervisor import Supervisor
from gazerig.drivers.servo_bus.sync_read import ServoReply, SyncReader
from gazerig.drivers.servo_bus.torque import raise_missing, switch_off
from gazerig.drivers.servo_bus.transaction import Transactions
from gazerig.drivers.types import Feedback, ServoConfig

RESTART_S = 0.1
"""Silence after which a servo may have restarted: it gets no goals until it is set up."""

POLL_S = 0.05
"""Interval of the reads of values that a group read does not cover; the servos take turns."""


class SmartServoBus(PortBus):
    """A chain of smart servos in position mode; implements gazerig.drivers.types.ServoBus.

    The supervisor requests latched faults; other faults are in every answer.

    Args:
        family: Family of the servos.
        port: gazerig.drivers.serial.port.BlockingPort, or an emulated port with its methods.
        setups: The servos; all sequences of arguments and results have their order.
        baud: Bit/s.
        timing: Times of the bus.

    Raises:
        ValueError: too many servos for one packet of goals, or a range beyond one turn.
    """

    _line: Transactions
    _supervisor: Supervisor

    def __init__(
        self,
        family: Family,
        port: BusPort,
        setups: Sequence[ServoConfig],
        baud: int = 1_000_000,
        timing: BusTiming = TIMING,
    ) -> None:
        if len(setups) > family.most_goals:
            raise ValueError(
                f"{len(setups)} servos are too many for one bus: {family.most_goals} at most"
            )
        self._family = family
        self._check_setups(setups)
        self._port = port
        self._setups = self._target_setups = tuple(setups)
        self._baud, self._give_up_s = baud, timing.give_up_s
        self._ids = tuple(setup.id for setup in setups)
        self._slot = {servo_id: i for i, servo_id in enumerate(self._ids)}
        self._by_id: dict[int, ServoConfig] = {}
        self._goals = GoalWrite(family, self._ids)
        self._nothing = Feedback.create_missing(len(self._ids))
        self._labels = {setup.id: setup.label() for setup in setups}
        self._log = EventLog()
        self._line = Transactions(port, family, baud, timing.reply_timeout_s, self._labels)
        self._poll_at_s, self._turn = -inf, 0
        self._corrupt, self._is_troubled = 0, False
        self._assemble({})

    def _assemble(self, firmware: Mapping[int, int]) -> None:
        """Create the parts in their initial state, for servos with this firmware, by id."""
        line, log, family = self._line, self._log, self._family
        self._apply_target()
        self._is_down = self._release_due = False
        self._silent_since_s, self._is_silence_told = inf, False
        self._poll_list = PollList(self._labels, log, line.lateness)
        self._feedback = FeedbackColumns(family, self._setups)
        since = family.fast_read_since
        is_fast = bool(firmware) and all(
            firmware[setup.id] >= since.get(setup.model, inf) for setup in self._setups
        )
        self._reader = SyncReader(line, self._poll_list, is_fast)
        self._polls = [(span, servo_id) for span in family.polled for servo_id in self._ids]
        self._supervisor = Supervisor(line, self._by_id, self._feedback, log)

    # --- one reading

    def _apply_one_by_one(self, replies: Mapping[int, ServoReply], now_s: float) -> None:
        """Apply answers servo by servo, each with its errors."""
        line, supervisor, feedback = self._line, self._supervisor, self._feedback
        feedback.begin()
        if line.errors["corrupt"] != self._corrupt:
            self._corrupt = line.errors["corrupt"]
            feedback.places.record_damaged(now_s)
        for servo_id, reply in replies.items():
            if not reply.values:
                line.errors["refused"] += 1
            elif not feedback.apply_reply(self._slot[servo_id], reply):
                line.errors["implausible"] += 1
                continue
            if reply.error & self._family.codec.ALERT:
                supervisor.mark(servo_id, is_held=False)
        for servo_id, silent_s in self._poll_list.report(bool(replies), now_s).items():
            if silent_s >= RESTART_S:
                supervisor.mark(servo_id)
        self._is_troubled = len(replies) < len(self._ids)

    def _poll(self, now_s: float) -> None:
        """Read what a group read does not cover of one servo; servos and spans take turns."""
        self._poll_at_s = now_s + POLL_S
        self._turn = (self._turn + 1) % len(self._polls)
        span, servo_id = self._polls[self._turn]
        if servo_id not in self._poll_list.group:
            return
        address, length = self._family.span(*span)
        found = self._line.ask_once((servo_id,), address, length)
        if servo_id in found:
            values = self._family.decode(address, found[servo_id])
            self._feedback.apply_polled(self._slot[servo_id], values)
            self._supervisor.check_polled(servo_id, values)

    # --- public interface

    def open(self) -> None:
        """Open the port, and find, check and prepare every servo; torque stays off.

        Raises:
            PortError: the port cannot be opened.
            ServoMissing: servos are absent, of another model or refuse a setting.
        """
        where = self._port.port_name
        open_port(self._port, self._baud)
        try:
            firmware = find(self._line, self._setups)
            self._assemble(firmware)
            for text in name_firmware(self._line, self._setups, firmware):
                self._log.add(text)
            # A servo may be set to answer only reads; this write needs no answer.
            level = [self._family.answer_level] * len(self._ids)
            self._line.write_all(self._ids, "status_return_level", level)
            released = switch_off(self._line, self._ids)
            raise_missing(self._line, released.unconfirmed_ids)
            for servo_id in released.holding_ids:
                fault = f"{where}: {self._line.label(servo_id)} keeps its torque"
                raise ServoMissing(f"{fault}: restart its power")
            apply_settings(self._line, self._by_id, self._ids, self._log)
            self._line.starved = False
        except (ServoMissing, BusLost):
            self._port.closePort()
            raise
        self._opened = True

    def read(self, now_s: float) -> Feedback:
        """Read all servos in one exchange.

        A silent servo is removed from the exchange and read alone at intervals, so a read always
        takes a bounded time. While the port is lost all servos are missing, and the port is tried
        again at intervals.

        Raises:
            BusLost: port or servos have been lost for longer than ``give_up_s``.
        """
        self._now_s = now_s
        if (self._is_down or self._release_due) and not self._reopen_if_needed(now_s):
            return self._nothing
        line, reader, feedback = self._line, self._reader, self._feedback
        supervisor = self._supervisor
        try:
            if line.starved:
                supervisor.recover_tripped(self._poll_list.group)
            group, out = reader.group(now_s), len(self._ids) - len(self._poll_list.group)
            if group is None:
                self._apply_one_by_one(reader.read_each(now_s), now_s)
            else:
                raw, at_s = line.exchange(group.request, group.reply_length)
                if self._is_troubled or not feedback.apply_whole(group, raw, at_s):
                    self._apply_one_by_one(reader.sort_out(group, raw, at_s, now_s), now_s)
            if len(feedback.now.missing) == out:
                # All servos that were read have answered: there is time for other exchanges.
                due = self._poll_list.next_due(now_s) if out else None
                if due is not None:
                    # Its values are not used: after a long silence an answer may be an old one.
                    reader.read_again((due,), now_s)
                if now_s >= self._poll_at_s:
                    self._poll(now_s)
                if now_s >= supervisor.due_s:
                    supervisor.service(self._poll_list.group, now_s)
        except BusLost as lost:
            self._record_loss(lost)
            return self._nothing
        if self._is_troubled or self._silent_since_s < inf:
            answered = len(feedback.now.missing) < len(self._ids)
            self._check_silence(answered, "no servo has answered", CHECK_SUPPLY)
        return feedback.now

    def enable_torque(self) -> tuple[int, ...]:
        """Set every goal to the present position (clipped to its limits), then switch torque on.

        A joint outside its limits moves inside at 30 deg/s.

        Returns:
            The goals that are now active, in steps.

        Raises:
            BusLost: the port is lost.
            ServoMissing: a servo does not answer or does not take its goal.
            ServoFault: a servo has latched an error, refuses its torque, or is beyond its encoder's
                zero, so that it would move in the wrong direction.
        """
        try:
            self._apply_target()
            goals = self._supervisor.enable_torque()
            for slot, goal in enumerate(goals):
                if self._lowest[slot] < goal < self._highest[slot]:
                    self._feedback.places.record(slot, goal, self._port.now_s())
        except (ServoMissing, ServoFault):
            self.disable_torque()
            raise
        except BusLost:
            self._release_due = True  # some servos may already have torque
            raise
        self._release_due = False
        return goals

    def write(self, goals_steps: Sequence[int]) -> None:
        """Send one goal to every servo in one packet; goals are clipped to the limits.

        Nothing is sent while torque is off or the port is lost, nor to servos that stopped on their
        own or may have restarted: the next reads set those up first.

        Raises:
            ValueError: a goal is not a number, or their number is wrong.
        """
        goals = clip_goals(goals_steps, self._lowest, self._highest)
        supervisor, line = self._supervisor, self._line
        if not supervisor.engaged or self._is_down or line.starved:
            return
        builder, speeds = self._goals, supervisor.speeds
        if supervisor.held or self._poll_list.silent_since_s:
            kept = [k for k, servo_id in enumerate(self._ids) if not self._is_withheld(servo_id)]
            if not kept:
                return
            builder = GoalWrite(self._family, [self._ids[k] for k in kept])
            goals, speeds = [goals[k] for k in kept], [speeds[k] for k in kept]
        try:
            line.send(builder.packet(goals, speeds))
        except BusLost as lost:
            self._record_loss(lost)

    def _is_withheld(self, servo_id: int) -> bool:
        """Return whether a servo gets no goals: it is held or may have restarted."""
        if servo_id in self._supervisor.held:
            return True
        return self._now_s - self._poll_list.silent_since_s.get(servo_id, inf) >= RESTART_S

    def _apply_target(self) -> None:
        """Apply the setups stored since torque was last on."""
        self._setups = self._target_setups
        self._lowest = tuple(setup.min_steps for setup in self._setups)
        self._highest = tuple(setup.max_steps for setup in self._setups)
        self._by_id.update({setup.id: setup for setup in self._setups})

    def faults(self) -> tuple[str, ...]:
        """Return the present faults, one line each, e.g. "neck_yaw (servo 7): overload"."""
        return tuple(
            f"{self._line.label(i)}: {fault}"
            for i, fault in sorted(self._supervisor.faults.items())
        )

    def _stop_supervision(self) -> None:
        self._supervisor.stop_supervision()

    def _switch_off(self) -> ReleaseResult:
        return switch_off(self._line, self._ids)

    def _reset_after_reconnect(self) -> None:
        self._poll_list.restore()
        self._line.starved = False
        self._supervisor.mark_all()

    def _check_setups(self, setups: Sequence[ServoConfig]) -> None:
        # Ranges are within one turn: a servo forgets whole turns when it restarts.
        turn = self._family.steps_per_turn
        for setup in setups if self._family.single_turn else ():
            if not 0 <= setup.min_steps <= setup.max_steps < turn:
                raise ValueError(
                    f"{setup.label()}: {setup.min_steps}..{setup.max_steps} is not a range "
                    f"within 0..{turn - 1} steps"
                )
