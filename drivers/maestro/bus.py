"""Hobby servos on a Pololu Maestro: one short question and one packet of goals a tick.

What the board cannot do, and so this bus cannot promise:

- Nobody measures a servo. Readings are goals moved by known speeds (``measured`` is
  False), no load and no current is known, and a stuck servo is not noticed.
- Where a servo is before its pulses begin is unknown. It goes to the first pulse at its
  own speed, whatever limit is armed.
- No watchdog can be armed over the serial line: when this program dies the servos hold
  their last goals, unless a guardian beside it stops the pulses (robot.guardian). The board's
  own serial timeout, set with Pololu's program, helps where the cable or the computer dies.
- The board knows nothing of its servos' supply: servos that restart alone go unnoticed.
"""

from collections.abc import Sequence
from math import inf

from drivers.bus_journal import Journal, call
from drivers.errors import BusLost, PortError, ServoMissing
from drivers.lasting_port import LastingPort
from drivers.maestro.care import Care
from drivers.maestro.channel import Channel, check
from drivers.maestro.commands import MICRO
from drivers.maestro.line import Line
from drivers.maestro.params import MaestroParams as MaestroParams
from drivers.maestro.release import TRIES, switch_off
from drivers.maestro.silence import Silence
from drivers.maestro.start import find, take_on
from drivers.serial_port import BusPort
from drivers.types import BusHealth, ServoReading, ServoSetup

UNMEASURED = "hobby servos tell no positions: what is shown is where they were sent"


class MaestroBus:
    """The channels of one board; implements drivers.types.ServoBus.

    Args:
        port: drivers.serial_port.BlockingPort, or an emulated port with its methods.
        setups: the servos, in the order of every sequence given and taken; a servo's id is
            its channel, and steps are quarter microseconds.
        params: how to speak with the board.

    Raises:
        ValueError: a servo is on a channel or at a pulse width that the board cannot have.
    """

    def __init__(self, port: BusPort, setups: Sequence[ServoSetup], params: MaestroParams) -> None:
        for setup in setups:
            check(setup, params.channels)
        self._port = port
        self._params = params
        self._setups = self._wanted = tuple(setups)
        self._ids = tuple(setup.id for setup in setups)
        if len(set(self._ids)) < len(self._ids):
            raise ValueError(f"channels {self._ids}: each can move one servo only")
        self._journal = Journal()
        self._line = Line(port, params)
        self._opened = self._told = False
        self._now_s = 0.0
        self._begin()

    def _begin(self) -> None:
        """Make the parts that have memory, with a clean sheet."""
        self._channels = tuple(Channel(setup) for setup in self._setups)
        self._care = Care(self._line, self._channels, self._journal)
        self._silence = Silence(self._journal)
        self._link = LastingPort(
            self._port, self._params.baud, self._params.give_up_s, self._journal, self._trust_nobody
        )
        self._heard_s = -inf

    # --- the bus as others see it

    def open(self) -> None:
        """Open the port, find the board and every channel; nothing moves.

        Raises:
            drivers.errors.PortError: the port cannot be opened.
            drivers.errors.ServoMissing: the board or a channel does not answer.
        """
        self._setups = self._wanted
        self._begin()
        if not self._port.setBaudRate(self._params.baud):
            raise PortError(
                f"{self._port.port_name} cannot run at {self._params.baud} bit/s: choose 115200"
            )
        try:
            self._port.clearPort()
            find(self._line, self._channels, self._params, self._journal)
        except (ServoMissing, BusLost):
            self._port.closePort()
            raise
        self._opened = True

    def read(self, now_s: float) -> tuple[ServoReading | None, ...]:
        """Ask the board for its errors and one pulse, and say where all servos must be.

        None where the board did not answer, and for channels that lost their pulses until
        they are held again. Whatever is wrong, a read takes a bounded time. While the port
        is gone all is None, and the port is tried again now and then.

        Raises:
            drivers.errors.BusLost: port or board have been gone for longer than ``give_up_s``.
        """
        self._now_s = now_s
        if self._link.down and not self._link.returned(now_s):
            return (None,) * len(self._ids)
        if self._link.release_due and not self._caught_up():
            return (None,) * len(self._ids)
        try:
            answered = self._watch(now_s)
        except BusLost as lost:
            self._lose(lost)
            return (None,) * len(self._ids)
        if not answered:
            self._mind_silence(now_s)
            return (None,) * len(self._ids)
        return tuple(
            channel.reading(self._heard_s) if self._care.believed(channel) else None
            for channel in self._channels
        )

    def engage(self) -> tuple[int, ...]:
        """Hold every channel at the pulse that it gives, clipped to its limits.

        A channel without pulses begins at its servo's last place, or at its rest where it
        has not been held yet: the servo goes there at once, at its own speed, and the next
        such channel follows ``stagger_ms`` later. A joint outside its limits is brought
        inside at 30 deg/s. Returns the goals that are now in force, in steps.

        Raises:
            drivers.errors.BusLost: the port is gone.
            drivers.errors.ServoMissing: the board does not answer, or a channel does not take
                its goal.
        """
        self._take_wanted()
        try:
            if not self._told:
                self._told = True
                self._journal.say(UNMEASURED)
            take_on(self._line, self._channels, self._params, self._journal)
        except ServoMissing:
            self.release()
            raise
        except BusLost:
            self._link.refused_release()  # some may have their pulses already
            raise
        self._link.release_due = False
        self._care.take_on()
        return tuple(channel.goal_steps for channel in self._channels)

    def write(self, goals_steps: Sequence[int]) -> None:
        """Send one goal to every channel in one write; goals are clipped to the limits.

        Sends nothing while nothing is held, the port is gone, or the board did not answer:
        it may have restarted, and would take goals without any limit of speed.

        Raises:
            ValueError: a goal is not a number, or there are not as many as servos.
        """
        goals = [
            channel.clip(goal) for channel, goal in zip(self._channels, goals_steps, strict=True)
        ]
        if not self._care.engaged or self._link.down or not self._care.sure:
            return
        held = {
            channel.id: goal
            for channel, goal in zip(self._channels, goals, strict=True)
            if channel.held
        }
        if not held:
            return
        try:
            self._line.send(self._line.speech.targets(held))
        except BusLost as lost:
            self._lose(lost)
            return
        now_s = self._port.now_s()
        for channel in self._channels:
            if channel.held:
                channel.aim(held[channel.id], now_s)

    def retune(self, setups: Sequence[ServoSetup]) -> None:
        """Set the servos up so when they are held the next time; the same ids and models.

        Raises:
            ValueError: these are other servos, or limits that the board cannot have.
        """
        same = [(s.id, s.model) for s in setups] == [(s.id, s.model) for s in self._setups]
        if not same:
            raise ValueError("other servos need another bus: ids and models must stay")
        for setup in setups:
            check(setup, self._params.channels)
        self._wanted = tuple(setups)

    def faults(self) -> tuple[str, ...]:
        """Name what channels suffer from now, and the board's errors of the last 10 s."""
        channels = (f"{call(c.setup)}: {c.fault}" for c in self._channels if c.fault)
        errors = self._care.errors_of_late(self._port.now_s())
        return (*channels, *(f"board {self._params.device}: {name}" for name in errors))

    def events(self) -> tuple[str, ...]:
        """Say what has happened since the last call."""
        return self._journal.take()

    def release(self) -> None:
        """Stop all pulses, confirmed; never raises for a board that does not answer.

        Raises:
            drivers.errors.BusLost: the port is gone, and stays so when tried once more; the
                torque is taken off by the first read after it is back.
        """
        self._care.let_go()
        if not self._opened:
            return
        if self._link.down and not self._link.open_once_more(self._now_s):
            self._link.refused_release()
            raise BusLost(self._cannot_release())
        self._switch_all_off()

    def _caught_up(self) -> bool:
        """Take off the torque that was asked off while the port was gone; True if that is done."""
        try:
            self._switch_all_off()
        except BusLost:
            return False
        return True

    def _switch_all_off(self) -> None:
        """Take the torque off, see that it is gone, and say where it is not.

        Raises:
            drivers.errors.BusLost: the port is gone.
        """
        try:
            released = switch_off(self._line, self._ids)
        except BusLost as lost:
            self._lose(lost)
            self._link.refused_release()
            raise BusLost(self._cannot_release()) from lost
        self._link.released()
        self._line.errors["refused"] += len(released.holding)
        for channel in self._channels:
            if channel.id in released.holding:
                self._journal.say(f"{call(channel.setup)} still gets pulses: cut the servo power")
            elif channel.id in released.mute:
                self._journal.say(
                    f"{call(channel.setup)} does not confirm that its pulses have stopped: "
                    "cut the servo power"
                )
            else:
                channel.stop()

    def health(self) -> BusHealth:
        """Give byte and error counts of all exchanges."""
        errors = {kind: count for kind, count in self._line.errors.items() if count}
        return BusHealth(self._line.tx_bytes, self._line.rx_bytes, errors)

    def close(self) -> None:
        """Close the port; safe to call twice. The board goes on as it was last told."""
        self._opened = False
        self._care.let_go()
        self._port.closePort()

    # --- what only a Maestro can do

    def go_home(self) -> None:
        """Send all channels to their home as set in Pololu's program, and let go of them.

        Home may be a place, to which servos go at the armed speed, or no pulses at all.

        Raises:
            drivers.errors.BusLost: the port is gone.
        """
        self._care.let_go()
        self._line.send(self._line.speech.go_home())

    def moving(self) -> bool | None:
        """Tell whether any channel with a limit is on its way; None where nobody can say.

        The Micro Maestro knows no such question.

        Raises:
            drivers.errors.BusLost: the port is gone.
        """
        if self._params.channels <= MICRO:
            return None
        answer = self._line.ask(self._line.speech.moving(), 1)
        return None if answer is None else bool(answer[0])

    # --- holding

    def _take_wanted(self) -> None:
        """Put in force what was asked for since the servos were held last."""
        self._setups = self._wanted
        for channel, setup in zip(self._channels, self._setups, strict=True):
            channel.want(setup)

    # --- reading

    def _watch(self, now_s: float) -> bool:
        """Ask the board, where that is due; tells whether it is known to be alive."""
        if self._care.sure and now_s - self._heard_s < self._params.watch_ms / 1000.0:
            self._care.advance(self._port.now_s())
            return True
        if not self._silence.due(now_s):
            return False
        if self._silence.missed > TRIES and not self._wake(now_s):
            return False
        if not self._care.watch():
            self._silence.miss(now_s)
            return False
        self._heard_s = self._port.now_s()
        self._silence.answer(now_s)
        return True

    def _wake(self, now_s: float) -> bool:
        """Ask a board that has long been silent; it may have to detect its baud rate anew."""
        register = self._line.wake()
        if register is None:
            self._silence.miss(now_s)
            return False
        self._care.note_errors(register, self._port.now_s())
        return True

    def _mind_silence(self, now_s: float) -> None:
        """Give up where the board has not answered for too long.

        Raises:
            drivers.errors.BusLost: so it is.
        """
        silent_s = self._silence.seconds(now_s)
        if silent_s >= self._params.give_up_s:
            raise BusLost(
                f"{self._port.port_name}: the board has not answered for {silent_s:.1f} s: "
                "check its power and the cable"
            )

    # --- a port that goes away

    def _lose(self, lost: BusLost) -> None:
        self._link.lose(lost, self._now_s)

    def _trust_nobody(self) -> None:
        """Begin anew with a port that was away."""
        self._care.suspect_all()

    def _cannot_release(self) -> str:
        """Say what servos do that cannot be told to let go."""
        return (
            f"{self._port.port_name} is gone: pulses could not be stopped; the board goes on with "
            "its last goals as long as it has power: cut the servo power to free them"
        )
