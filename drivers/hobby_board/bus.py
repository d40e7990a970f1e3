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

from gazerig.drivers.bus.goal_limits import clip_goals
from gazerig.drivers.bus.port_bus import CUT, PortBus
from gazerig.drivers.bus.release_result import ReleaseResult
from gazerig.drivers.errors import BusLost, PortError, ServoMissing
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.hobby_board.board import Board, BoardLine
from gazerig.drivers.hobby_board.channel import Channel
from gazerig.drivers.hobby_board.release import TRIES, switch_off
from gazerig.drivers.hobby_board.start import HoldResult, enable_channels, hold_channel
from gazerig.drivers.hobby_board.supervisor import CHECK_SUPPLY, BoardSupervisor, SilenceMonitor
from gazerig.drivers.serial.reconnect import ReconnectingPort
from gazerig.drivers.types import Feedback, ServoConfig

UNMEASURED = "hobby servos report no positions: those shown are their goals"


class HobbyBoardBus(PortBus):
    """The channels of one board; implements gazerig.drivers.types.ServoBus.

    Args:
        board: Board that sends the pulses.
        setups: The servos, in the order of all sequences; a servo's id is its channel, and steps
            are quarter microseconds.

    Raises:
        ValueError: a servo has a channel or a pulse width that the board does not have.
    """

    holding_text = "pulses still on"
    unconfirmed_text = "end of pulses not confirmed"
    _line: BoardLine
    _supervisor: BoardSupervisor

    def __init__(self, board: Board, setups: Sequence[ServoConfig]) -> None:
        self._board, self._line, self._port = board, board.line, board.line.port
        self._check_setups(setups)
        self._setups = self._target_setups = tuple(setups)
        self._ids = tuple(setup.id for setup in setups)
        if len(set(self._ids)) < len(self._ids):
            raise ValueError(f"channels {self._ids}: each can move one servo only")
        self._log = EventLog()
        self._nothing = Feedback.create_missing(len(self._ids))
        self._loads, self._unmeasured = (0.0,) * len(self._ids), (False,) * len(self._ids)
        self._apply_limits()
        self._reported = False
        self._create_parts()

    def _create_parts(self) -> None:
        """Create the stateful parts in their initial state."""
        timing = self._board.timing
        self._channels = tuple(Channel(setup, self._board.longest_ramp_s) for setup in self._setups)
        self._supervisor = BoardSupervisor(self._board, self._channels, self._log)
        self._silence = SilenceMonitor(self._log, self._line.lateness)
        self._rx_bytes, self._byte_s = 0, -inf
        self._link = ReconnectingPort(
            self._port,
            self._board.params.baud,
            timing.give_up_s,
            self._log,
            self._supervisor.mark_all_for_recovery,
        )
        self._heard_s = -inf
        self._limp = set[Channel]()

    # --- public interface

    def open(self) -> None:
        """Open the port, find the board and every channel; nothing moves.

        Raises:
            PortError: the port cannot be opened.
            ServoMissing: the board or a channel does not answer.
        """
        self._setups = self._target_setups
        self._apply_limits()
        self._create_parts()
        baud = self._board.params.baud
        if not self._port.setBaudRate(baud):
            raise PortError(f"{self._port.port_name} cannot run at {baud} bit/s: choose 115200")
        try:
            self._port.clearPort()
            pulses = self._board.find(self._setups, self._log)
            for channel, pulse in zip(self._channels, pulses, strict=True):
                channel.adopt_position(pulse)
        except (ServoMissing, BusLost):
            self._port.closePort()
            raise
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
        link = self._link
        if (link.down or link.release_due) and not self._reopen_if_needed(now_s):
            return self._nothing
        try:
            answered = self._check_board(now_s)
        except BusLost as lost:
            self._record_loss(lost)
            return self._nothing
        if not answered:
            # If any byte arrives the board is present, and noise corrupts its answers.
            silent_s = min(self._silence.silent_for_s(now_s), now_s - self._byte_s)
            if silent_s >= self._board.timing.give_up_s:
                fault = f"{self._port.port_name}: the board has not answered for {silent_s:.1f} s"
                lateness = self._line.lateness
                raise BusLost(lateness.blame(fault, CHECK_SUPPLY, now_s, now_s - silent_s))
            return self._nothing
        # All positions are estimated, none is measured.
        at_s = self._heard_s
        channels, nothing, pending = self._channels, self._nothing, self._supervisor.pending
        position, velocity, on, faults = list[float](), list[float](), list[bool](), list[str]()
        rearmed, missing = [False] * len(channels), list[int]()
        for i, channel in enumerate(channels):
            position.append(round(channel.ramp.shaft_steps))
            velocity.append(channel.ramp.shaft_steps_s)
            on.append(channel.on)
            faults.append(channel.fault)
            if pending and channel in pending:
                position[i] = velocity[i] = nan
                missing.append(i)
            elif channel.rearmed or channel.entering:
                rearmed[i] = channel.pop_rearmed()
        load, times = self._loads, (at_s,) * len(channels)
        if missing:
            load = tuple([nan if i in missing else 0.0 for i in range(len(channels))])
            times = tuple([-inf if i in missing else at_s for i in range(len(channels))])
        return Feedback(
            tuple(position), tuple(velocity), load, times, nothing.temperature_c, nothing.voltage_v,
            tuple(on), tuple(faults), self._unmeasured, tuple(rearmed), tuple(missing),
        )  # fmt: skip

    def enable_torque(self) -> tuple[int, ...]:
        """Hold every channel at its present pulse, clipped to its limits.

        A channel without pulses begins at its servo's last position, or at rest if it has not been
        held yet: the servo moves there immediately at its own speed, and the next such channel
        follows ``stagger_ms`` later. A joint outside its limits moves inside at 30 deg/s.

        Returns:
            The goals that are now active, in steps.

        Raises:
            BusLost: the port is lost.
            ServoMissing: the board does not answer, or a channel does not accept its goal.
        """
        self._setups = self._target_setups
        self._apply_limits()
        for channel, setup in zip(self._channels, self._setups, strict=True):
            channel.set_target(setup)
        try:
            if not self._reported:
                self._reported = True
                self._log.add(UNMEASURED)
            enable_channels(self._board, self._channels, self._log)
        except ServoMissing:
            self.disable_torque()
            raise
        except BusLost:
            self._link.record_failed_release()  # some channels may already have pulses
            raise
        self._link.release_due = False
        self._limp.clear()
        self._supervisor.start_supervision()
        return tuple(channel.goal_steps for channel in self._channels)

    def set_limp(self, servos: Collection[int]) -> None:
        """Stop the pulses of these servos, by index; all others that were limp get them again.

        Their first pulse is the last one before: a joint that was moved by hand returns there at
        the servo's own speed, as its position is not known. A channel that does not stop, is held.
        """
        if not self._supervisor.engaged or self._link.down:
            return
        wanted = [self._channels[i] for i in servos]
        try:
            off = [channel for channel in wanted if channel.held]
            for _ in range(TRIES if off else 0):
                self._board.stop([channel.id for channel in off])
                pulses = self._board.read_pulses([channel.id for channel in off])
                if pulses is not None and not any(pulses):
                    for channel in off:
                        channel.record_stop()
                    self._limp.update(off)
                    break
            for channel in self._limp.difference(wanted):
                self._limp.discard(channel)
                if hold_channel(self._board, channel, 0) is not HoldResult.HELD:
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
        goals = [*map(int, clip_goals(goals_steps, self._lowest, self._highest))]
        held = [channel for channel in self._channels if channel.held]
        if not self._supervisor.engaged or self._link.down or not held:
            return
        now_s = self._port.now_s()
        try:
            if not self._supervisor.may_send_goals:
                self._board.resend_pulses(held)
                return
            for channel, goal in zip(self._channels, goals, strict=True):
                if channel.held:
                    channel.record_goal(goal, now_s)
            self._board.send_goals(held)
        except BusLost as lost:
            self._record_loss(lost)

    def faults(self) -> tuple[str, ...]:
        """Return the present faults of channels and the board's errors of the last 10 s."""
        channels = (f"{c.setup.label('channel')}: {c.fault}" for c in self._channels if c.fault)
        errors = self._supervisor.recent_errors(self._port.now_s())
        return (*channels, *(f"{self._board.texts.name}: {name}" for name in errors))

    def _check_setups(self, setups: Sequence[ServoConfig]) -> None:
        for setup in setups:
            self._board.params.check_servo(setup)

    # --- holding

    def _apply_limits(self) -> None:
        """Apply the ranges of the active setups."""
        self._lowest = tuple(setup.min_steps for setup in self._setups)
        self._highest = tuple(setup.max_steps for setup in self._setups)

    # --- reading

    def _check_board(self, now_s: float) -> bool:
        """Read the board's status; return whether the board is known to be alive."""
        if not self._silence.is_due(now_s):
            return False
        if self._silence.missed > TRIES:
            errors = self._board.read_errors()
            if errors is None:
                self._silence.record_miss(now_s, self._last_byte_s(now_s))
                return False
            self._supervisor.record_errors(errors, self._port.now_s())
        if not self._supervisor.check_status():
            self._silence.record_miss(now_s, self._last_byte_s(now_s))
            return False
        self._heard_s = self._port.now_s()
        self._rx_bytes, self._byte_s = self._board.line.rx_bytes, now_s
        self._silence.record_answer(now_s)
        return True

    def _last_byte_s(self, now_s: float) -> float:
        """Return the time of the last received byte, damaged or not."""
        if self._board.line.rx_bytes != self._rx_bytes:
            self._rx_bytes, self._byte_s = self._board.line.rx_bytes, now_s
        return self._byte_s

    # --- loss of the port

    def _switch_off(self) -> ReleaseResult:
        released = switch_off(self._board, self._ids)
        for channel in self._channels:
            if channel.id not in (*released.holding_ids, *released.unconfirmed_ids):
                channel.record_stop()
        return released

    def _servo_label(self, servo_id: int) -> str:
        return next(c.setup for c in self._channels if c.id == servo_id).label("channel")

    def _cannot_release(self) -> str:
        """Return the text about servos whose pulses cannot be switched off."""
        return (
            f"{self._port.port_name} is gone: pulses could not be stopped; "
            f"{self._board.texts.unreachable_behaviour}: {CUT} to free them"
        )
