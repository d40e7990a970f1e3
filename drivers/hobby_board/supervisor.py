"""Supervision of a board: errors, silence, and channels that lost their pulses.

After an error or a restart a board outputs no pulses, and after a restart it has lost its settings.
One short request per tick detects both: it reads a channel's pulse and the board's status. Channels
without pulses are enabled again one after another; if that happens too often, they stay without.
"""

from collections.abc import Sequence
from math import inf

from gazerig.drivers.errors import BusLost, ServoMissing
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.hobby_board.board import Board
from gazerig.drivers.hobby_board.channel import BEHIND_S, FINE_STEPS, Channel
from gazerig.drivers.hobby_board.params import HOBBY
from gazerig.drivers.hobby_board.release import TRIES
from gazerig.drivers.process.host_lateness import BLAME_S, SILENCE_S
from gazerig.drivers.serial.port import wait_until
from gazerig.drivers.types import ServoConfig

MOST_RESTARTS, WITHIN_S = 3, 10.0
"""A board that loses its pulses more often than this within this time stays without."""

MOST_TRIES = 300
"""Failed attempts to enable a channel again after which it stays without pulses."""

SAME_S = 1.0
"""Shortest time between two reports of the same error."""

IN_A_ROW, AGAIN_S = 3, 0.25
"""A board is asked less often after so many missing answers, as each costs a read its time-out."""

SILENT, CHECK_SUPPLY = "the board does not answer", "check its power and the cable"


class BoardSupervisor:
    """Supervisor of a board's status, which enables its channels and recovers them.

    engaged: whether goals are followed
    may_send_goals: whether goals may be sent, as the board has kept its settings
    pending: channels with an unknown position, until they are held again
    """

    def __init__(self, board: Board, channels: Sequence[Channel], log: EventLog) -> None:
        self._board, self._log = board, log
        self._channels = tuple(channels)
        self.is_ramped_by_board = board.longest_ramp_s == inf
        self.engaged, self.may_send_goals = False, True
        self.pending: list[Channel] = []
        self._channel_index = -1
        self._restarts: list[float] = []
        self._failed_tries = 0
        self._errors_s: dict[str, float] = {}
        self._missed, self._is_silence_reported = 0, False
        self._since_s, self._due_s = 0.0, -inf

    def stop_supervision(self) -> None:
        """Stop supervision."""
        self.engaged = False
        self.pending.clear()
        for channel in self._channels:
            channel.record_release()

    def mark_all_for_recovery(self) -> None:
        """Mark every channel to be enabled again."""
        self._mark([channel for channel in self._channels if channel.held])

    def recent_errors(self, now_s: float) -> tuple[str, ...]:
        """Return the errors that the board has reported recently."""
        return tuple(name for name, at_s in self._errors_s.items() if now_s - at_s < WITHIN_S)

    # --- torque on

    def enable(self) -> None:
        """Enable every channel; channels without pulses one after another.

        Raises:
            BusLost: the port is lost.
            ServoMissing: the board does not answer, or a channel does not accept its goal.
        """
        board, port = self._board, self._board.port
        board.prepare(self._log)
        pulses = read_every_pulse(board, [channel.setup for channel in self._channels])
        for channel, pulse in zip(self._channels, pulses, strict=True):
            channel.adopt_pulse(pulse)
        off = [channel.label for channel in self._channels if not channel.on]
        if off:
            self._log.add(f"{', '.join(off)} had no pulses: they move to their goals immediately")
        start_s = -inf
        for channel, pulse in zip(self._channels, pulses, strict=True):
            if not pulse:
                wait_until(port, start_s + board.timing.stagger_s)
                start_s = port.now_s()
            for _ in range(TRIES):
                fault = self.hold(channel, pulse)
                if not fault:
                    break
            else:
                text = f"{port.port_name}: {channel.label} {fault}"
                raise ServoMissing(_blame(board, text, board.remedy))
        self.engaged = self.may_send_goals = True
        self._restarts.clear()
        self.pending.clear()

    def hold(self, channel: Channel, pulse_steps: int) -> str:
        """Hold a channel at its present pulse, or without one at its last position.

        A channel that already outputs pulses is held there. Without pulses the servo's position is
        unknown, and a first pulse is not ramped: the servo moves there at its own speed.

        Speed and acceleration are armed before the goal is sent, and the pulse is read afterwards.
        A joint outside its limits moves inside at 30 deg/s.

        Returns:
            "" if it is held, else the reason why not.

        Raises:
            BusLost: the port is lost.
        """
        goal = channel.start(pulse_steps, self._board.port.now_s())
        found = None
        if self._board.send_limits([channel]):
            self._board.send_goals([channel])
            found = self._board.read_pulses((channel.id,))
        channel.advance(self._board.port.now_s())
        if found is None:
            return "does not answer"
        low, high = sorted((pulse_steps or goal, goal))
        # A first pulse is exact; another one may have been moving when it was read.
        room = FINE_STEPS + (BEHIND_S * channel.ramp.speed_steps_s if pulse_steps else 0.0)
        if not found[0] or not low - room <= found[0] <= high + room:
            fault = channel.difference_text(found[0])
            channel.adopt_pulse(found[0])
            return fault
        channel.record_hold(found[0])
        return ""

    # --- in every read

    def check(self, now_s: float) -> bool:
        """Read the errors and one channel's pulse, and act on them.

        Returns:
            Whether the board answered.

        Raises:
            BusLost: the port is lost.
        """
        if now_s < self._due_s:
            return False
        if self._check_status():
            self._record_answer(now_s)
            return True
        self.may_send_goals = False
        self._record_miss(now_s)
        return False

    def check_silence(self, now_s: float) -> None:
        """Check how long the board has been silent.

        Raises:
            BusLost: for longer than ``give_up_s``.
        """
        silent_s = now_s - self._since_s
        if silent_s >= self._board.timing.give_up_s:
            fault = f"{self._board.port.port_name}: the board has not answered for {silent_s:.1f} s"
            raise BusLost(self._board.lateness.blame(fault, CHECK_SUPPLY, now_s, self._since_s))

    def _record_miss(self, now_s: float) -> None:
        """Record a missing or damaged answer."""
        if not self._missed:
            self._since_s = now_s
        self._missed += 1
        if self._missed >= IN_A_ROW:
            self._due_s = now_s + AGAIN_S
        lateness = self._board.lateness
        patience_s = SILENCE_S if lateness.cause(now_s, self._since_s) else BLAME_S
        if not self._is_silence_reported and now_s - self._since_s >= patience_s:
            self._is_silence_reported = True
            self._log.add(lateness.blame(SILENT, CHECK_SUPPLY, now_s, self._since_s))

    def _record_answer(self, now_s: float) -> None:
        """Record an answer."""
        if not self._missed:
            return
        silent_s = now_s - self._since_s
        if self._is_silence_reported or silent_s >= SILENCE_S:
            fault = f"the board did not answer for {silent_s:.1f} s"
            self._log.add(self._board.lateness.blame(fault, CHECK_SUPPLY, now_s, self._since_s))
        self._missed, self._due_s, self._is_silence_reported = 0, -inf, False

    def _check_status(self) -> bool:
        self._channel_index = (self._channel_index + 1) % len(self._channels)
        channel = self._channels[self._channel_index]
        found = self._board.read_status(channel)
        if found is None:
            return False
        pulse, errors = found
        now_s = self._board.port.now_s()
        for one in self._channels:
            one.advance(now_s)
        self._record_errors(errors, now_s)
        if not channel.held:
            if not self.engaged:
                channel.adopt_pulse(pulse)
        elif errors or not channel.is_expected(pulse):
            confirmed = self._board.read_pulses((channel.id,))
            if confirmed is None:
                return False
            self._handle_trouble(channel, confirmed[0], errors)
        else:
            channel.adopt_pulse(pulse)
            self.may_send_goals = True
        if self.pending:
            self._rearm_next()
        for one in self._channels:
            if one.entering and one.is_within_limits():
                one.entering = False
                self.may_send_goals = self._board.send_limits([one])
        return True

    def _handle_trouble(self, channel: Channel, pulse: int, errors: Sequence[str]) -> None:
        """Handle an error, or a channel's pulse that was not expected; both may concern all."""
        now_s = self._board.port.now_s()
        channel.advance(now_s)
        held = [one for one in self._channels if one.held]
        is_corrected = pulse > 0 and not self.is_ramped_by_board  # by the next goals
        if is_corrected or channel.is_expected(pulse):
            self._board.errors["other pulse"] += not channel.is_expected(pulse)
            self.may_send_goals = self._board.send_limits(held)
            return
        self._board.errors["restarted"] += 1
        self._mark(held)
        text, remedy = "the board restarted", "check its supply, cable and ground"
        if errors:
            text = f"the board was sent home by an error ({' and '.join(errors)})"
        elif pulse:
            text, remedy = f"{channel.label} {channel.difference_text(pulse)}", self._board.remedy
        self._restarts = [at_s for at_s in self._restarts if now_s - at_s < WITHIN_S]
        self._restarts.append(now_s)
        if len(self._restarts) > MOST_RESTARTS:
            self._stop(self.pending, f"{text} again and again", remedy)
        else:
            self._log.add(f"{text}: set up again")

    def _record_errors(self, names: Sequence[str], now_s: float) -> None:
        for name in names:
            self._board.errors[name] += 1
            if now_s - self._errors_s.get(name, -inf) >= SAME_S:
                self._log.add(f"the board reports: {name}")
            self._errors_s[name] = now_s

    # --- channels without pulses

    def _mark(self, channels: Sequence[Channel]) -> None:
        """Mark channels to be enabled again."""
        self._failed_tries, self.may_send_goals = 0, True
        for channel in channels:
            channel.record_release()
            self.pending.append(channel)

    def _rearm_next(self) -> None:
        """Enable one channel again; the next one at the next read, to spare the supply."""
        channel, pulse = self.pending[0], 0
        # A pulse that the driver ramps continues at the estimate.
        if self.is_ramped_by_board:
            found = self._board.read_pulses((channel.id,))
            if found is None:
                return
            pulse = found[0]
        fault = "gets an impossible pulse"  # answers have no checksum
        if not pulse or pulse >= HOBBY["hobby"].lowest:
            channel.adopt_pulse(pulse)
            fault = self.hold(channel, pulse)
        if not fault:
            channel.record_rearm()
            self.pending.remove(channel)
            self._failed_tries = 0
            return
        self._failed_tries += 1
        self.pending.append(self.pending.pop(0))
        if self._failed_tries >= MOST_TRIES:
            self._stop([channel], fault, self._board.remedy)

    def _stop(self, channels: Sequence[Channel], fault: str, remedy: str) -> None:
        """Stop the pulses of channels, which stay without, and name their fault."""
        self._board.stop([channel.id for channel in channels])
        text = _blame(self._board, fault, remedy)
        self._log.add(f"{', '.join(channel.label for channel in channels)}: {text}")
        for channel in tuple(channels):
            channel.record_stop(text)
            self.pending.remove(channel)


def _blame(board: Board, fault: str, remedy: str) -> str:
    """Return a fault with its remedy, or with this computer as its cause if it was late."""
    return board.lateness.blame(fault, remedy, board.port.now_s())


def read_every_pulse(board: Board, setups: Sequence[ServoConfig]) -> tuple[int, ...]:
    """Read every pulse.

    Raises:
        BusLost: the port is lost.
        ServoMissing: a channel does not answer.
    """
    for _ in range(TRIES):
        pulses = board.read_pulses([setup.id for setup in setups])
        if pulses is not None:
            return pulses
    where = board.port.port_name
    for setup in setups:
        if board.read_pulses((setup.id,)) is None:
            fault = f"{where}: {setup.label('channel')} does not answer"
            remedy = f"{CHECK_SUPPLY}; has the board {board.params.channels} channels?"
            raise ServoMissing(_blame(board, fault, remedy))
    raise ServoMissing(_blame(board, f"{where}: answers are lost", CHECK_SUPPLY))
