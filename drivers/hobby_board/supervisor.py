"""Supervision of a board: errors, restarts, channels that lost their pulses.

On an error a board may send its channels home: to no pulses, or to a stored position. A restart
does the same and loses the settings. One short request per tick detects both: it reads a channel's
pulse and the board's status.
"""

from collections.abc import Sequence
from math import inf

from gazerig.drivers.event_log import EventLog
from gazerig.drivers.hobby_board.board import Board
from gazerig.drivers.hobby_board.channel import Channel
from gazerig.drivers.hobby_board.params import HOBBY
from gazerig.drivers.hobby_board.start import HoldResult, hold_channel, refusal_text
from gazerig.drivers.process.host_lateness import BLAME_S, SILENCE_S, STOOD_STILL, HostLateness

MOST_RESTARTS, WITHIN_S = 3, 10.0
"""A board that releases its channels more often than this within this time stays without pulses."""

REST_S, LONGEST_REST_S = 0.1, 1.0
"""First and longest wait of channels that noise sends home more often than that; it increases each
time."""

LEAST_STEPS = HOBBY["hobby"].lowest
"""Shortest possible pulse; a shorter one is a damaged answer."""

SAME_S = 1.0
"""Shortest time between two reports of the same error."""


class BoardSupervisor:
    """Supervisor of a board's status, which recovers its channels.

    engaged: whether goals are followed
    may_send_goals: whether goals may be sent, as the board has kept its settings
    pending: channels with an unknown position, until they are held again
    """

    def __init__(self, board: Board, channels: Sequence[Channel], log: EventLog) -> None:
        self._board = board
        self._line = board.line
        self._channels = tuple(channels)
        self._log = log
        self._is_ramped_here = board.longest_ramp_s < inf
        self.engaged = False
        self.pending: list[Channel] = []
        self._channel_index = -1
        self.may_send_goals = True
        self._unhandled_errors: tuple[str, ...] = ()
        self._restarts: list[float] = []
        self._errors_s: dict[str, float] = {}
        self._disturbed: list[float] = []
        self._damages = 0
        self._last_found = -1, 0
        self._damaged_s = self._hold_at_s = self._reported_s = -inf

    def start_supervision(self) -> None:
        """Start supervision of enabled channels."""
        self.engaged = True
        self._restarts.clear()
        self._disturbed.clear()
        self._hold_at_s = -inf
        self.pending.clear()
        self.may_send_goals, self._unhandled_errors = True, ()

    def stop_supervision(self) -> None:
        """Stop supervision."""
        self.engaged = False
        self.pending.clear()
        for channel in self._channels:
            channel.record_release()

    def mark_all_for_recovery(self) -> None:
        """Mark every channel to be enabled again."""
        self.may_send_goals = False
        if self.engaged:
            for channel in self._channels:
                self._mark_for_recovery(channel)

    def record_errors(self, names: Sequence[str], now_s: float) -> None:
        """Record errors that the board has reported."""
        for name in names:
            self._line.errors[name] += 1
            if now_s - self._errors_s.get(name, -inf) >= SAME_S:
                self._log.add(f"the board reports: {name}")
            self._errors_s[name] = now_s

    def recent_errors(self, now_s: float) -> tuple[str, ...]:
        """Return the errors that the board has reported recently."""
        return tuple(name for name, at_s in self._errors_s.items() if now_s - at_s < WITHIN_S)

    # --- in every read

    def check_status(self) -> bool:
        """Read the errors and one channel's pulse, and act on them.

        Returns:
            Whether the board answered.

        Raises:
            BusLost: the port is lost.
        """
        self._channel_index = (self._channel_index + 1) % len(self._channels)
        channel = self._channels[self._channel_index]
        if self.engaged and self._is_ramped_here:
            self.advance_pulses()
        found = self._board.read_status(channel)
        if found is None:
            self.may_send_goals = False
            return False
        now_s = self._line.port.now_s()
        self.advance(now_s)
        self.record_errors(found.errors, now_s)
        if self.engaged:
            self._unhandled_errors = (*self._unhandled_errors, *found.errors)
            pulse = found.pulse_steps
            odd = channel.held and channel.is_implausible(pulse, now_s)
            if self._unhandled_errors or not self.may_send_goals or odd:
                if not self._check_all():
                    return False
            elif channel.held:
                channel.record_expected_pulse(pulse)
            if self.pending and now_s >= self._hold_at_s:
                self._recover_next(now_s)
            for one in self._channels:
                if one.entering and one.is_within_limits():
                    one.entering = False
                    self._board.send_limits([one], confirmed=False)
            return True
        channel.adopt_pulse(found.pulse_steps)
        self.may_send_goals = True
        return True

    def advance(self, now_s: float) -> None:
        """Advance the estimates of all channels to ``now_s``."""
        for channel in self._channels:
            channel.advance(now_s)

    def advance_pulses(self) -> None:
        """Advance moving pulses if the board does not do so itself."""
        if not self._is_ramped_here:
            return
        self.advance(self._line.port.now_s())
        off = [channel.id for channel in self.pending if not channel.on]
        if off:
            self._board.stop(off)  # noise may have begun their pulses
        if self.may_send_goals:
            self._board.advance_pulses([channel for channel in self._channels if channel.held])

    def _check_all(self) -> bool:
        """Compare every channel's pulse with the expected one; return whether they were read."""
        pulses = self._board.read_pulses([channel.id for channel in self._channels])
        if pulses is None:
            self.may_send_goals = False
            return False
        now_s = self._line.port.now_s()
        self.advance(now_s)
        errors, sure = tuple(dict.fromkeys(self._unhandled_errors)), self.may_send_goals
        self._unhandled_errors, self.may_send_goals = (), True
        away = bool(errors) or not sure
        found = dict(zip(self._channels, pulses, strict=True))
        held = [channel for channel in self._channels if channel.held]
        odd = [channel for channel in held if channel.is_implausible(found[channel], now_s, away)]
        home = [channel for channel in odd if not found[channel]]
        # Boards that ramp to their home are lost with any unexpected pulse as well.
        astray = not self._is_ramped_here and (home or away or len(odd) == len(held))
        lost = odd if astray else home
        if lost:
            self._record_lost_hold(lost, errors, now_s)
        for channel in odd:
            if channel not in lost:
                self._record_off_goal(channel, found[channel])
        for channel in held:
            if channel not in odd:
                channel.record_expected_pulse(found[channel])
        if away or home:
            # A restart loses the limits: they are armed before the goals are sent. A board that
            # moves its channels home at their armed speed has not moved them far yet. A goal to a
            # channel that an error has just left without pulses would not be ramped, so goals are
            # sent only if the limits arrived intact.
            held = [channel for channel in self._channels if channel.held]
            if held:
                if not self._board.send_limits(held, confirmed=True):
                    self.may_send_goals = False
                else:
                    self._board.send_goals(held)
        for channel in self.pending:
            channel.adopt_pulse(found[channel])
        return True

    def _record_off_goal(self, channel: Channel, pulse: int) -> None:
        """Record that a channel stays off its goal, at a limit of the board's own range."""
        if self._is_ramped_here:
            # Boards ramped by the driver have no range of their own: the command was lost.
            self._line.errors["other pulse"] += 1
            channel.adopt_pulse(pulse)
            return
        if channel.is_off_goal(pulse) and not channel.off_goal_reported:
            channel.off_goal_reported = True
            self._line.errors["other pulse"] += 1
            self._log.add(refusal_text(self._board, channel))

    def _record_lost_hold(
        self, lost: Sequence[Channel], errors: Sequence[str], now_s: float
    ) -> None:
        """Record that channels have lost their goals and must be enabled again."""
        named = " and ".join(errors)
        who = (
            "the board"
            if len(lost) == len(self._channels)
            else ", ".join(channel.setup.label("channel") for channel in lost)
        )
        self._line.errors["restarted"] += 1
        for channel in lost:
            self._mark_for_recovery(channel)
        if named or self._is_noisy(now_s):
            self._wait_for_quiet(who, named or "bytes arrive damaged", now_s)
            return
        self._restarts = [at_s for at_s in self._restarts if now_s - at_s < WITHIN_S]
        self._restarts.append(now_s)
        if len(self._restarts) > MOST_RESTARTS:
            # Channels that lose their pulses repeatedly stay without.
            fault = "restarts again and again: supply too weak"
            for channel in self.pending:
                channel.fault = fault
                self._log.add(f"{channel.setup.label('channel')}: {fault}")
            self._board.stop([channel.id for channel in self.pending])
            for channel in self.pending:
                channel.record_stop()
            self.pending.clear()
        else:
            self._log.add(f"{who} restarted: set up again")

    def _is_noisy(self, now_s: float) -> bool:
        """Return whether bytes to or from the board have been damaged recently."""
        errors = self._line.errors
        damages = sum(errors[name] for name in self._board.noise_errors)
        if damages != self._damages:
            self._damages, self._damaged_s = damages, now_s
        return now_s - self._damaged_s < WITHIN_S

    def _wait_for_quiet(self, who: str, named: str, now_s: float) -> None:
        """Delay enabling channels that noise has sent home: none at first, then increasing.

        Without pulses nothing moves; a servo that is enabled and released repeatedly jerks.
        """
        self._disturbed = [at_s for at_s in self._disturbed if now_s - at_s < WITHIN_S]
        self._disturbed.append(now_s)
        often = len(self._disturbed) - MOST_RESTARTS
        self._hold_at_s = now_s + min(LONGEST_REST_S, REST_S * often) if often > 0 else -inf
        if now_s - self._reported_s < WITHIN_S and often != 1:
            return
        self._reported_s = now_s
        fault = f"{who} was sent home by an error ({named})"
        if often > 0:
            fault += " again and again: held once the line is quiet"
            remedy = self._board.texts.noise_remedy
            self._log.add(self._line.lateness.blame(fault, remedy, now_s))
        else:
            self._log.add(f"{fault}: set up again")

    def _mark_for_recovery(self, channel: Channel) -> None:
        if channel.held:
            channel.record_release()
            self.pending.append(channel)

    def _recover_next(self, now_s: float) -> None:
        """Enable one channel again; the next one at the next read, to spare the supply."""
        channel = self.pending[0]
        found = self._board.read_pulses((channel.id,))
        if found is None:
            return
        pulse = found[0]
        before, self._last_found = self._last_found, (channel.id, pulse)
        if self._is_unsendable(channel, pulse, now_s):
            pulse = 0
        elif pulse and not self._is_ramped_here:
            # A goal to a channel without pulses is not ramped, so its pulse is read twice.
            twice = (
                before[0] == channel.id
                and abs(before[1] - pulse) <= channel.pulse_tolerance_steps()
            )
            if pulse < LEAST_STEPS or not twice:
                return
        channel.adopt_pulse(pulse)
        outcome = hold_channel(self._board, channel, pulse)
        if outcome is HoldResult.HELD:
            channel.record_rearm()
            self.pending.remove(channel)
        elif outcome is HoldResult.OTHER_PULSE and channel.on:
            if self._is_unsendable(channel, round(channel.ramp.pulse_steps), now_s):
                self._line.errors["damaged"] += 1
                channel.record_pulse(0)  # tried again at the next read
                return
            # It outputs other pulses: report that once, and hold it at these.
            self._record_off_goal(channel, round(channel.ramp.pulse_steps))
            channel.record_hold()
            channel.record_rearm()
            self.pending.remove(channel)

    def _is_unsendable(self, channel: Channel, pulse: int, now_s: float) -> bool:
        """Return whether this driver cannot have sent a pulse: the line may damage one bit."""
        return (
            self._is_ramped_here
            and not channel.is_pulse_allowed(pulse)
            and channel.is_implausible(pulse, now_s)
        )


AGAIN_FIRST_S, AGAIN_LAST_S = 0.0625, 0.5
"""Interval of requests to a silent board: doubled from the first to the last value."""

IN_A_ROW = 3
"""Consecutive missing answers after which it is read less often, as each costs a read its
time-out."""

OWED_S = 0.1
"""Time after the first answer by which the pending ones have arrived."""


DAMAGED, CHECK_LINE = "the board's answers arrive damaged", "check cable, ground and baud rate"
LATE = "the board's answers arrive late"
SILENT, CHECK_SUPPLY = "the board does not answer", "check its power and the cable"


class SilenceMonitor:
    """Monitor of missing answers.

    missed: number of consecutive missing answers
    """

    def __init__(self, log: EventLog, lateness: HostLateness) -> None:
        self._log, self._lateness = log, lateness
        self.missed = 0
        self._reported = False
        self._damaged_answers = 0
        self._back_s: float | None = None
        self._since_s, self._due_s, self._wait_s = 0.0, -inf, AGAIN_FIRST_S

    def is_due(self, now_s: float) -> bool:
        """Return whether a request is due."""
        return now_s >= self._due_s

    def record_miss(self, now_s: float, heard_s: float = -inf) -> None:
        """Record a missing or damaged answer; ``heard_s``: time of the last received byte."""
        if not self.missed:
            self._wait_s = AGAIN_FIRST_S
            if self._back_s is None:
                self._since_s, self._damaged_answers = now_s, 0
        self._back_s = None
        self.missed += 1
        if self.missed >= IN_A_ROW:
            self._due_s = now_s + self._wait_s
            self._wait_s = min(AGAIN_LAST_S, 2.0 * self._wait_s)
        self._damaged_answers += heard_s >= now_s
        damaged = self._damaged_answers >= IN_A_ROW
        if not self._reported and now_s - self._since_s >= (SILENCE_S if damaged else BLAME_S):
            self._reported = True
            fault, remedy = (DAMAGED, CHECK_LINE) if damaged else (SILENT, CHECK_SUPPLY)
            if damaged and self._lateness.was_late_since(self._since_s):
                fault = LATE  # an answer that comes in two parts looks damaged
            self._log.add(self._lateness.blame(fault, remedy, now_s, self._since_s))

    def record_answer(self, now_s: float) -> None:
        """Record an answer."""
        if self.missed:
            self.missed, self._due_s, self._back_s = 0, -inf, now_s
        if self._back_s is None or now_s - self._back_s < OWED_S:
            return
        silent_s = self._back_s - self._since_s
        if silent_s >= SILENCE_S and self._lateness.was_late_since(self._since_s):
            self._log.add(STOOD_STILL.format(silent_s))
        elif self._reported:
            self._log.add(f"the board answers again after {silent_s:.1f} s")
        elif silent_s >= SILENCE_S:
            self._log.add(f"the board did not answer for {silent_s:.1f} s: {CHECK_SUPPLY}")
        self._reported, self._back_s = False, None

    def silent_for_s(self, now_s: float) -> float:
        """Return the time without an answer, seconds; 0 if the last request was answered."""
        return now_s - self._since_s if self.missed else 0.0
