"""Bus of hobby servos on a board without feedback: a short request and goals in every tick.

Limits of such a board, and so of this bus:

- Servo positions are not measured. They are estimated from goals and known speeds (``measured`` is
False), load and current are unknown, and a stuck servo is not detected.
- The position of a servo before its pulses begin is unknown. It moves to the first pulse at its own
speed, with any armed limit.
- No watchdog can be armed over the line: when this program dies the servos hold their last goals,
unless the guardian process stops the pulses (gazerig.robot.guardian).
- The board does not measure the servos' supply: a restart of a single servo is not detected.
"""

from collections.abc import Collection, Sequence
from math import inf, nan
from typing import ClassVar

from gazerig.drivers.bus.goal_limits import clip_goals
from gazerig.drivers.bus.port_bus import CUT, PortBus
from gazerig.drivers.bus.release_result import ReleaseResult
from gazerig.drivers.bus.timing import TIMING, BusTiming
from gazerig.drivers.errors import BusLost, PortError, ServoMissing
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.hobby_board.board import Board
from gazerig.drivers.hobby_board.channel import Channel
from gazerig.drivers.hobby_board.params import HobbyBoardParams
from gazerig.drivers.hobby_board.release import TRIES, switch_off
from gazerig.drivers.hobby_board.supervisor import BoardSupervisor
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.types import Feedback, ServoConfig

UNMEASURED = "hobby servos report no positions: those shown are their goals"


class HobbyBoardBus(PortBus):
    """The channels of one board; implements gazerig.drivers.types.ServoBus.

    board_class: class of the board that sends the pulses

    Args:
        port: gazerig.drivers.serial.port.BlockingPort, or a port with its methods.
        setups: The servos, in the order of all sequences; a servo's id is its channel, and steps
            are quarter microseconds.
        params: Parameters of the board.
        timing: Times of the bus.

    Raises:
        ValueError: a servo has a channel or a pulse width that the board does not have.
    """

    board_class: ClassVar[type[Board]]
    holding_text = "pulses still on"
    unconfirmed_text = "end of pulses not confirmed"
    _supervisor: BoardSupervisor

    def __init__(
        self,
        port: BusPort,
        setups: Sequence[ServoConfig],
        params: HobbyBoardParams,
        timing: BusTiming = TIMING,
    ) -> None:
        self._port = port
        self._board = self._line = self.board_class(port, params, timing)
        self._check_setups(setups)
        self._setups = self._target_setups = tuple(setups)
        self._ids = tuple(setup.id for setup in setups)
        if len(set(self._ids)) < len(self._ids):
            raise ValueError(f"channels {self._ids}: each can move one servo only")
        self._log = EventLog()
        self._nothing = Feedback.create_missing(len(self._ids))
        self._baud, self._give_up_s = params.baud, timing.give_up_s
        self._reported = False
        self._create_parts()

    def _create_parts(self) -> None:
        """Create the stateful parts in their initial state."""
        self._setups = self._target_setups
        self._channels = tuple(Channel(setup, self._board.longest_ramp_s) for setup in self._setups)
        self._supervisor = BoardSupervisor(self._board, self._channels, self._log)
        self._is_down = self._release_due = False
        self._limp = set[Channel]()

    # --- public interface

    def open(self) -> None:
        """Open the port, find the board and every channel; nothing moves.

        Raises:
            PortError: the port cannot be opened.
            ServoMissing: the board or a channel does not answer.
        """
        self._create_parts()
        if not self._port.setBaudRate(self._baud):
            where = self._port.port_name
            raise PortError(f"{where} cannot run at {self._baud} bit/s: choose 115200")
        try:
            self._port.clearPort()
            pulses = self._board.find(self._setups, self._log)
        except (ServoMissing, BusLost):
            self._port.closePort()
            raise
        for channel, pulse in zip(self._channels, pulses, strict=True):
            channel.adopt_position(pulse)
        self._opened = True

    def read(self, now_s: float) -> Feedback:
        """Read the board's errors and one pulse; return the estimated state of all servos.

        All servos are missing if the board did not answer, and channels that lost their pulses are
        missing until they are held again. A read always takes a bounded time. While the port is
        lost all servos are missing, and the port is tried again at intervals.

        Raises:
            BusLost: port or board have been lost for longer than ``give_up_s``.
        """
        self._now_s = now_s
        if (self._is_down or self._release_due) and not self._reopen_if_needed(now_s):
            return self._nothing
        try:
            answered = self._supervisor.check(now_s)
        except BusLost as lost:
            self._record_loss(lost)
            return self._nothing
        if answered:
            return self._estimate()
        self._supervisor.check_silence(now_s)
        return self._nothing

    def _estimate(self) -> Feedback:
        """Return the estimated state of all servos; none is measured."""
        at_s, pending = self._port.now_s(), self._supervisor.pending
        position, velocity, on, faults = list[float](), list[float](), list[bool](), list[str]()
        rearmed, missing = list[bool](), list[int]()
        for i, channel in enumerate(self._channels):
            lost = channel in pending
            position.append(nan if lost else round(channel.ramp.shaft_steps))
            velocity.append(nan if lost else channel.ramp.shaft_steps_s)
            on.append(channel.on)
            faults.append(channel.fault)
            rearmed.append(not lost and channel.pop_rearmed())
            if lost:
                missing.append(i)
        nothing = self._nothing
        load = tuple([nan if i in missing else 0.0 for i in range(len(on))])
        times = tuple([-inf if i in missing else at_s for i in range(len(on))])
        return Feedback(
            tuple(position), tuple(velocity), load, times, nothing.temperature_c, nothing.voltage_v,
            tuple(on), tuple(faults), (False,) * len(on), tuple(rearmed), tuple(missing),
        )  # fmt: skip

    def enable_torque(self) -> tuple[int, ...]:
        """Hold every channel at its present pulse, clipped to its limits.

        A channel without pulses begins at its servo's last position, or at rest if it has not been
        held yet: the servo moves there immediately at its own speed, and the next such channel
        follows ``stagger_s`` later. A joint outside its limits moves inside at 30 deg/s.

        Returns:
            The goals that are now active, in steps.

        Raises:
            BusLost: the port is lost.
            ServoMissing: the board does not answer, or a channel does not accept its goal.
        """
        self._setups = self._target_setups
        for channel, setup in zip(self._channels, self._setups, strict=True):
            channel.set_target(setup)
        try:
            if not self._reported:
                self._reported = True
                self._log.add(UNMEASURED)
            self._supervisor.enable()
        except ServoMissing:
            self.disable_torque()
            raise
        except BusLost:
            self._release_due = True  # some channels may already have pulses
            raise
        self._release_due = False
        self._limp.clear()
        return tuple(channel.goal_steps for channel in self._channels)

    def set_limp(self, servos: Collection[int]) -> None:
        """Stop the pulses of these servos, by index; all others that were limp get them again.

        Their first pulse is the last one before: a joint that was moved by hand returns there at
        the servo's own speed, as its position is not known. A channel that does not stop, is held.
        """
        if not self._supervisor.engaged or self._is_down:
            return
        wanted = [self._channels[i] for i in servos]
        off = [channel for channel in wanted if channel.held]
        ids = [channel.id for channel in off]
        try:
            for _ in range(TRIES if off else 0):
                self._board.stop(ids)
                pulses = self._board.read_pulses(ids)
                if pulses is not None and not any(pulses):
                    for channel in off:
                        channel.record_stop()
                    self._limp.update(off)
                    break
            for channel in self._limp.difference(wanted):
                self._limp.discard(channel)
                if self._supervisor.hold(channel, 0):
                    self._supervisor.pending.append(channel)
        except BusLost as lost:
            self._record_loss(lost)

    def write(self, goals_steps: Sequence[int]) -> None:
        """Send one goal to every channel in one write; goals are clipped to the limits.

        Nothing is sent while no channel is held or the port is lost. While the board does not
        answer, pulses do not change: it may have restarted, and would apply goals without any speed
        limit.

        Raises:
            ValueError: a goal is not a number, or their number is wrong.
        """
        lowest = [setup.min_steps for setup in self._setups]
        highest = [setup.max_steps for setup in self._setups]
        goals = clip_goals(goals_steps, lowest, highest)
        held = [channel for channel in self._channels if channel.held]
        supervisor = self._supervisor
        if not supervisor.engaged or self._is_down or not held:
            return
        now_s = self._port.now_s()
        try:
            if supervisor.may_send_goals:
                for channel, goal in zip(self._channels, goals, strict=True):
                    if channel.held:
                        channel.advance(now_s)
                        channel.goal_steps = goal
                self._board.send_goals(held)
            elif not supervisor.is_ramped_by_board:
                self._board.send_goals(held)  # the same once more: a write may have been damaged
        except BusLost as lost:
            self._record_loss(lost)

    def faults(self) -> tuple[str, ...]:
        """Return the present faults of channels and the board's errors of the last 10 s."""
        channels = (f"{c.label}: {c.fault}" for c in self._channels if c.fault)
        errors = self._supervisor.recent_errors(self._port.now_s())
        return (*channels, *(f"{self._board.name}: {name}" for name in errors))

    # --- parts of PortBus

    def _check_setups(self, setups: Sequence[ServoConfig]) -> None:
        for setup in setups:
            self._board.params.check_servo(setup)

    def _switch_off(self) -> ReleaseResult:
        released = switch_off(self._board, self._ids)
        for channel in self._channels:
            if channel.id not in (*released.holding_ids, *released.unconfirmed_ids):
                channel.record_stop()
        return released

    def _servo_label(self, servo_id: int) -> str:
        return next(c.label for c in self._channels if c.id == servo_id)

    def _cannot_release(self) -> str:
        """Return the text about servos whose pulses cannot be switched off."""
        return (
            f"{self._port.port_name} is gone: pulses could not be stopped; the board keeps its "
            f"last ones while it has power: {CUT} to free them"
        )

    def _reset_after_reconnect(self) -> None:
        self._supervisor.mark_all_for_recovery()
