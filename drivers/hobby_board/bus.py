"""Bus of hobby servos on a board without feedback: a short request and goals in every tick.

Nothing is measured: positions are the commanded pulses (``measured`` is False). Before its first
pulse a servo's position is unknown: it moves to that pulse at its own speed. No watchdog can be
armed over the line: if this program dies, the guardian stops the pulses (gazerig.robot.guardian).

After an error or a restart a board outputs no pulses, and has perhaps lost its settings. All
channels are then enabled again, one after another; if that happens again soon, all stay without.
"""

from collections.abc import Sequence
from math import inf

from gazerig.drivers.bus.goal_limits import clip_goals
from gazerig.drivers.bus.port_bus import PortBus
from gazerig.drivers.bus.release_result import ReleaseResult
from gazerig.drivers.errors import BusLost, ServoMissing
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.hobby_board.board import CHECK_SUPPLY, TRIES, Board, are_alike
from gazerig.drivers.hobby_board.channel import FINE_STEPS, Channel
from gazerig.drivers.serial.port import open_port, wait_until
from gazerig.drivers.types import Feedback, ServoConfig

UNMEASURED = "hobby servos report no positions: those shown are their goals"

WITHIN_S = 10.0
"""A board that loses its pulses twice within this time stays without."""

MOST_TRIES = 300
"""Failed attempts to enable channels again after which all stay without pulses."""


class HobbyBoardBus(PortBus):
    """The channels of one board; implements gazerig.drivers.types.ServoBus.

    Args:
        board: Board that sends the pulses.
        setups: The servos, in the order of all sequences; a servo's id is its channel, and steps
            are quarter microseconds.

    Raises:
        ValueError: a servo has a channel or a pulse width that the board does not have.
    """

    def __init__(self, board: Board, setups: Sequence[ServoConfig]) -> None:
        self._board = self._line = board
        self._port, self._baud = board.port, board.params.baud
        self._give_up_s = board.timing.give_up_s
        self._check_setups(setups)
        self._target_setups = tuple(setups)
        self._labels = {setup.id: setup.label("channel") for setup in setups}
        if len(self._labels) < len(setups):
            raise ValueError("two servos have one channel: each can move one servo only")
        self._log = EventLog()
        self._nothing = Feedback.create_missing(len(setups))
        self._reset()

    def _reset(self) -> None:
        self._setups = self._target_setups
        self._channels = tuple(Channel(setup, self._board.longest_ramp_s) for setup in self._setups)
        # Whether goals are followed, and whether the board has kept its settings.
        self._engaged, self._may_send = False, True
        self._failed_tries, self._trouble_s, self._fault = 0, -inf, ""
        self._rearmed, self._turn = False, 0
        self._silent_since_s, self._is_silence_told = inf, False
        self._is_down = self._release_due = False

    # --- torque on and off

    def open(self) -> None:
        """Open the port, find the board and every channel; nothing moves."""
        self._reset()
        open_port(self._port, self._baud)
        try:
            self._port.drain(0.0)
            self._adopt(self._board.find(self._setups))
        except (ServoMissing, BusLost):
            self._port.closePort()
            raise
        self._log.add(UNMEASURED)
        self._opened = True

    def _adopt(self, pulses: Sequence[int]) -> None:
        for channel, pulse in zip(self._channels, pulses, strict=True):
            channel.adopt_pulse(pulse)

    def enable_torque(self) -> tuple[int, ...]:
        """Hold every channel at its present pulse, clipped to its limits.

        A channel without pulses begins at its servo's last position, or at rest if it has not been
        held yet: the servo moves there immediately at its own speed, and the next such channel
        follows ``stagger_s`` later. A joint outside its limits moves inside at 30 deg/s.
        """
        self._setups = self._target_setups
        for channel, setup in zip(self._channels, self._setups, strict=True):
            channel.set_target(setup)
        try:
            self._adopt(self._board.read_all(self._setups))
            self._hold_all()
        except ServoMissing:
            self.disable_torque()
            raise
        except BusLost:
            self._release_due = True  # some channels may already have pulses
            raise
        self._engaged = self._may_send = True
        self._release_due, self._trouble_s, self._fault = False, -inf, ""
        return tuple(channel.goal_steps for channel in self._channels)

    def _hold_all(self) -> None:
        """Hold every channel; channels without pulses one after another."""
        board, start_s = self._board, -inf
        off = [channel.label for channel in self._channels if not channel.on]
        if off:
            self._log.add(f"{', '.join(off)} had no pulses: they move to their goals immediately")
        for channel in self._channels:
            pulse = channel.goal_steps if channel.on else 0
            if not pulse:
                wait_until(self._port, start_s + board.timing.stagger_s)
                start_s = self._port.now_s()
            for _ in range(TRIES):
                fault = self._hold(channel, pulse)
                if not fault:
                    break
            else:
                raise board.missing(f"{channel.label} {fault}", board.remedy)

    def _hold(self, channel: Channel, pulse_steps: int = 0) -> str:
        """Hold a channel at its present pulse, or at its last position; return why it is not held.

        Speed and acceleration are armed before the goal is sent, and the pulse is read afterwards.
        """
        goal = channel.start(pulse_steps, self._port.now_s())
        pulses = None
        if self._board.send_limits([channel]):
            self._board.send_goals([channel])
            pulses = self._board.read_pulses((channel.id,))
        channel.advance(self._port.now_s())
        if pulses is None:
            return "does not answer"
        # A first pulse is exact; another one may have been moving when it was read.
        is_right = pulse_steps or abs(pulses[0] - goal) <= FINE_STEPS
        if is_right and channel.is_expected(pulses[0]):
            channel.record_hold()
            return ""
        channel.on = pulses[0] > 0
        return channel.difference_text(pulses[0])

    # --- every tick

    def read(self, now_s: float) -> Feedback:
        """Read the board's errors and one pulse; return the estimated state of all servos.

        All servos are missing if port or board are silent, or while channels that lost their pulses
        are not yet held again.
        """
        self._now_s = now_s
        if (self._is_down or self._release_due) and not self._reopen_if_needed(now_s):
            return self._nothing
        try:
            answered = self._check()
        except BusLost as lost:
            self._record_loss(lost)
            return self._nothing
        self._check_silence(answered, "the board has not answered", CHECK_SUPPLY)
        self._may_send &= answered
        return self._estimate() if answered and not self._due else self._nothing

    @property
    def _due(self) -> list[Channel]:
        return [channel for channel in self._channels if channel.due]

    def _check(self) -> bool:
        """Read the status and one channel's pulse, and act on them; return whether it answered."""
        self._turn = (self._turn + 1) % len(self._channels)
        channel = self._channels[self._turn]
        status = self._read_status(channel)
        if status is None:
            return False
        pulse, errors = status
        if not self._engaged:
            channel.adopt_pulse(pulse)
        elif channel.held and (errors or not channel.is_expected(pulse)):
            again = self._read_status(channel)
            if again is None:
                return False
            if not channel.is_expected(again[0]):
                if not are_alike(pulse, again[0]):
                    return False
                self._handle_trouble(channel, again[0], (*errors, *again[1]))
        self._may_send |= channel.held
        # One channel is enabled again at each read, to spare the supply.
        if due := self._due:
            self._enable_again(due[self._failed_tries % len(due)])
        for one in self._channels:
            if one.entering and one.setup.min_steps <= one.pulse_steps <= one.setup.max_steps:
                one.entering = False
                self._may_send = self._board.send_limits([one])
        return True

    def _read_status(self, channel: Channel) -> tuple[int, tuple[str, ...]] | None:
        status, now_s = self._board.read_status(channel.id), self._port.now_s()
        for one in self._channels:
            one.advance(now_s)
        return status

    def _handle_trouble(self, channel: Channel, pulse: int, errors: Sequence[str]) -> None:
        """Handle a channel's pulse that was not expected, which may concern all channels."""
        self._board.errors["restarted"] += 1
        fault, remedy = "the board restarted", CHECK_SUPPLY
        if errors:
            fault = f"the board was sent home by an error ({' and '.join(errors)})"
        elif pulse:
            fault, remedy = f"{channel.label} {channel.difference_text(pulse)}", self._board.remedy
        since_s, self._trouble_s = self._now_s - self._trouble_s, self._now_s
        self._reset_after_reconnect()
        if since_s < WITHIN_S:
            self._stop_all(f"{fault}, for the second time in {since_s:.1f} s", remedy)
        else:
            self._log.add(f"{fault}: set up again")

    def _enable_again(self, channel: Channel) -> None:
        fault = self._hold(channel)
        self._rearmed |= not fault
        self._failed_tries += bool(fault)
        if self._failed_tries >= MOST_TRIES:
            self._stop_all(f"{channel.label} {fault}", self._board.remedy)

    def _stop_all(self, fault: str, remedy: str) -> None:
        """Stop the pulses of all channels, which stay without; name why."""
        self._fault = self._board.blame(fault, remedy)
        self._log.add(f"no pulses any more: {self._fault}")
        for channel in self._channels:
            channel.record_release()
        self._switch_off()

    def _estimate(self) -> Feedback:
        """Return the estimated state of all servos; none is measured."""
        channels, rearmed, self._rearmed = self._channels, self._rearmed, False
        return self._nothing._replace(
            position_steps=tuple([round(channel.pulse_steps) for channel in channels]),
            velocity_steps_s=tuple([channel.mean_steps_s for channel in channels]),
            load=(0.0,) * len(channels),
            at_s=(self._port.now_s(),) * len(channels),
            torque=tuple([channel.on for channel in channels]),
            fault=(self._fault,) * len(channels),
            measured=(False,) * len(channels),
            rearmed=tuple([rearmed or channel.entering for channel in channels]),
            missing=(),
        )

    def write(self, goals_steps: Sequence[int]) -> None:
        """Send one goal to every channel in one write; goals are clipped to the limits.

        While the board does not answer, pulses do not change: it may have restarted, and would
        apply goals without any speed limit. Pulses that the driver ramps are repeated then, as a
        write may have been damaged.
        """
        lowest = [setup.min_steps for setup in self._setups]
        highest = [setup.max_steps for setup in self._setups]
        goals = clip_goals(goals_steps, lowest, highest)
        held = [channel for channel in self._channels if channel.held]
        if not self._engaged or self._is_down or not held or self._due:
            return
        if self._may_send:
            now_s = self._port.now_s()
            for channel, goal in zip(self._channels, goals, strict=True):
                if channel.held:
                    channel.advance(now_s)
                    channel.goal_steps = goal
        elif self._board.longest_ramp_s == inf:
            return
        try:
            self._board.send_goals(held)
        except BusLost as lost:
            self._record_loss(lost)

    def faults(self) -> tuple[str, ...]:
        """Return the present faults of channels, one line each."""
        return tuple(f"{c.label}: {self._fault}" for c in self._channels if self._fault)

    # --- parts of PortBus

    def _check_setups(self, setups: Sequence[ServoConfig]) -> None:
        for setup in setups:
            self._board.params.check_servo(setup)

    def _stop_supervision(self) -> None:
        self._engaged = False
        for channel in self._channels:
            channel.record_release()

    def _switch_off(self, channels: Sequence[Channel] = ()) -> ReleaseResult:
        """Stop the pulses of channels, by default of all, and verify it."""
        channels = channels or self._channels
        released = self._board.switch_off([channel.id for channel in channels])
        for channel in channels:
            if channel.id not in (*released.holding_ids, *released.unconfirmed_ids):
                channel.record_stop()
        return released

    def _reset_after_reconnect(self) -> None:
        self._failed_tries, self._may_send = 0, True
        for channel in self._channels:
            channel.record_release(due=channel.held or channel.due)
