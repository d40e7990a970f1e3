"""Feetech STS servos on one serial bus: one read and one write a tick.

The packets are our own. The maker's Python SDK (feetech-servo-sdk 1.0.0, module
scservo_sdk) is the Dynamixel SDK of old with other names: it has been left alone since its
first release, its packet time-out is computed wrongly so that every user patches it, its
group reads lose every answer after a missing one and its waiting spins a core. The rest on
the package index are copies of it. The protocol is small, and the port is ours anyway.

What an STS cannot do. It has no bus watchdog: when the host falls silent, a servo goes on
to its last goal and holds it, for ever. Nothing in the servo stands in for that: whoever
runs the bus must let go before leaving (``release``) or have a guardian beside it that
does (robot.guardian), and what bounds the force until somebody cuts the power is the
torque limit (``strength``) and the servo's own overload protection, which leaves a fifth
of the torque after two seconds. So goals are sent a tick at a time, never far ahead.
Faults do not latch: their bits come and go, and so do the names in ``faults``.
"""

from collections.abc import Sequence

from drivers.errors import BusLost, PortError, ServoFault, ServoMissing
from drivers.event_log import EventLog, servo_label
from drivers.feetech.care import RESTART_S, Care
from drivers.feetech.family import FEETECH
from drivers.feetech.memory_table import STEPS_PER_TURN
from drivers.feetech.params import FeetechParams as FeetechParams
from drivers.feetech.protocol import MOST_GOALS, GoalWrite
from drivers.feetech.reader import Heard, Reader
from drivers.feetech.readings import Readings
from drivers.feetech.registers import StsRegisters
from drivers.feetech.views import again_turns, alone_turns, together_turns
from drivers.serial.port import BusPort
from drivers.serial.reconnect import LastingPort
from drivers.servo_bus.discovery import find
from drivers.servo_bus.faults import Health
from drivers.servo_bus.goals import clipped
from drivers.servo_bus.poll_list import Roll
from drivers.servo_bus.provisioning import Provisioning
from drivers.servo_bus.recovery import Recovery
from drivers.servo_bus.torque import switch_off
from drivers.servo_bus.transaction import Line
from drivers.types import BusHealth, ServoReading, ServoSetup


class FeetechBus:
    """A chain of STS servos in position mode; implements drivers.types.ServoBus.

    Args:
        port: drivers.serial.port.BlockingPort, or an emulated port with its methods.
        setups: the servos, in the order of every sequence given and taken.
        params: how to speak with them.

    Raises:
        ValueError: more servos than one packet of goals can hold, or a range beyond one turn.
    """

    def __init__(self, port: BusPort, setups: Sequence[ServoSetup], params: FeetechParams) -> None:
        if len(setups) > MOST_GOALS:
            raise ValueError(f"{len(setups)} servos are too many for one bus: {MOST_GOALS} at most")
        _check_ranges(setups)
        self._port = port
        self._setups = self._wanted = tuple(setups)
        self._params = params
        self._ids = tuple(setup.id for setup in setups)
        self._slot = {servo_id: i for i, servo_id in enumerate(self._ids)}
        self._limits = tuple((setup.min_steps, setup.max_steps) for setup in setups)
        self._goals = GoalWrite(self._ids)
        self._log = EventLog()
        self._line = Line(
            port,
            FEETECH,
            params.prompt_timeout_ms / 1000.0,
            params.reply_timeout_ms / 1000.0,
            params.baud,
            {setup.id: servo_label(setup) for setup in setups},
        )
        self._opened = False
        self._now_s = 0.0
        self._damaged = 0
        self._assemble()

    def _assemble(self) -> None:
        """Make the parts, with a clean sheet."""
        by_id = self._by_id = {setup.id: setup for setup in self._setups}
        line, log = self._line, self._log
        self._link = LastingPort(
            self._port, self._params.baud, self._params.give_up_s, self._log, self._trust_nobody
        )
        self._roll = Roll(self._ids)
        self._readings = Readings(self._setups)
        self._health = Health(by_id, log)
        turns = together_turns(self._params.torque_every)
        self._reader = Reader(line, self._roll, turns, alone_turns(), again_turns())
        self._provisioning = Provisioning(
            line, StsRegisters(self._port, tries=1), self._setups, log
        )
        self._recovery = Recovery(line, self._provisioning, by_id, 0, self._health, log)
        self._care = Care(line, by_id, self._recovery, self._health, self._readings)
        self._speeds = self._recovery.speeds(self._ids, ())

    # --- the bus as others see it

    def open(self) -> None:
        """Open the port, find every servo, check and prepare it; torque stays off.

        Raises:
            drivers.errors.PortError: the port cannot be opened.
            drivers.errors.ServoMissing: servos are absent, of another model or refuse.
        """
        self._take_wanted()
        where, baud = self._port.port_name, self._params.baud
        if not self._port.setBaudRate(baud):
            raise PortError(f"{where} cannot run at {baud} bit/s: choose 115200 or 1000000")
        registers = StsRegisters(self._port)
        try:
            find(self._line, registers, self._setups, self._log)
            self._assemble()
            provisioning = Provisioning(self._line, registers, self._setups, self._log)
            provisioning.disable(self._ids)
            provisioning.apply(self._ids)
        except (ServoMissing, BusLost):
            self._port.closePort()
            raise
        self._opened = True

    def read(self, now_s: float) -> tuple[ServoReading | None, ...]:
        """Read all servos in one exchange; None where no fresh answer came.

        A servo that keeps silent is left out of the exchange and asked alone now and
        then, so whatever is wrong, a read takes a bounded time. While the port is gone all
        is None, and the port is tried again now and then.

        Raises:
            drivers.errors.BusLost: port or servos have been gone for longer than ``give_up_s``.
        """
        self._now_s = now_s
        if self._link.down and not self._link.returned(now_s):
            return (None,) * len(self._ids)
        if self._link.release_due and not self._caught_up():
            return (None,) * len(self._ids)
        try:
            readings = self._take(self._reader.read(now_s), now_s)
            self._care.tend(readings, self._roll.group, now_s)
        except BusLost as lost:
            self._lose(lost)
            return (None,) * len(self._ids)
        if self._roll.troubled:
            self._mind_silence(now_s)
        return tuple(readings)

    def engage(self) -> tuple[int, ...]:
        """Set every goal to the present position (clipped to its limits), then torque on.

        A joint outside its limits is brought inside at 30 deg/s. Returns the goals that
        are now in force, in steps.

        Raises:
            drivers.errors.BusLost: the port is gone.
            drivers.errors.ServoMissing: a servo does not answer or does not take its goal.
            drivers.errors.ServoFault: a servo refuses its torque, or stands beyond its
                encoder's zero, from where it would go the wrong way into its range.
        """
        try:
            self._take_wanted()
            # A servo may have restarted since it was prepared.
            self._provisioning.apply(self._ids)
            goals, outside = self._recovery.enable(self._ids)
        except (ServoMissing, ServoFault):
            self.release()
            raise
        except BusLost:
            self._link.refused_release()  # some may have their torque already
            raise
        self._link.release_due = False
        self._care.take_on(outside)
        self._speeds = self._recovery.speeds(self._ids, ())
        return goals

    def write(self, goals_steps: Sequence[int]) -> None:
        """Send one goal to every servo in one packet; goals are clipped to the limits.

        Sends nothing while the torque is off or the port is gone, and nothing to servos
        that may have restarted: the next reads set those up first.

        Raises:
            ValueError: a goal is not a number, or there are not as many as servos.
        """
        goals = clipped(goals_steps, self._limits)
        if not self._care.engaged or self._link.down:
            return
        try:
            self._send(goals)
        except BusLost as lost:
            self._lose(lost)

    def retune(self, setups: Sequence[ServoSetup]) -> None:
        """Set the servos up so when the torque comes on the next time; the same ids and models.

        Ranges and gains are in the servos' EEPROM, which is written without torque, so under
        torque everything stays as it is.

        Raises:
            ValueError: these are other servos, or a range is beyond one turn.
        """
        same = [(s.id, s.model) for s in setups] == [(s.id, s.model) for s in self._setups]
        if not same:
            raise ValueError("other servos need another bus: ids and models must stay")
        _check_ranges(setups)
        self._wanted = tuple(setups)

    def faults(self) -> tuple[str, ...]:
        """Name every fault that servos suffer from now, e.g. "neck_yaw (servo 7): overload".

        They come and go: a fault is no more in the list when its cause has been gone for 1 s.
        """
        return tuple(
            f"{self._line.who(i)}: {fault}" for i, fault in sorted(self._health.faults.items())
        )

    def events(self) -> tuple[str, ...]:
        """Say what has happened since the last call."""
        return self._log.drain()

    def release(self) -> None:
        """Torque off on every servo, confirmed; never raises for a servo that does not answer.

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
        for servo_id in released.holding:
            self._log.add(f"{self._line.who(servo_id)} still reports torque: {_CUT}")
        for servo_id in released.mute:
            who = self._line.who(servo_id)
            self._log.add(f"{who} does not confirm that its torque is off: {_CUT}")

    def health(self) -> BusHealth:
        """Give byte and error counts of all exchanges."""
        errors = {kind: count for kind, count in self._line.errors.items() if count}
        return BusHealth(self._line.tx_bytes, self._line.rx_bytes, errors)

    def close(self) -> None:
        """Close the port; safe to call twice."""
        self._opened = False
        self._care.let_go()
        self._port.closePort()

    # --- reading and writing

    def _take(self, heard: dict[int, Heard], now_s: float) -> list[ServoReading | None]:
        """Take an answer servo by servo."""
        readings: list[ServoReading | None] = [None] * len(self._ids)
        if heard and self._health.silent_for_s(now_s) >= RESTART_S:
            # All were silent together: their power may have been cut.
            self._care.suspect_all()
        places = self._readings.places
        if (damaged := self._line.errors["corrupt"]) != self._damaged:
            self._damaged = damaged
            places.damaged(now_s)
        disturbed = places.disturbed(now_s)
        doubtful = {i: h for i, h in heard.items() if disturbed or self._reader.owing(i, now_s)}
        if doubtful:
            sure = {i: h for i, h in heard.items() if i not in doubtful}
            heard = sure | self._confirmed(doubtful)
        believed, dark = self._readings.all_believed(heard), not self._roll.group
        for servo_id, one in heard.items():
            slot = self._slot[servo_id]
            if self._roll.answered(servo_id) and dark:
                continue  # the first answer after long silence may be an old one
            if believed or self._readings.believes(slot, one):
                self._care.judge(servo_id, one.sample, now_s)
                readings[slot] = self._readings.one(slot, one)
            else:
                self._line.errors["implausible"] += 1
        self._care.note_out(self._roll.out, now_s)
        self._health.note_silent(
            self._roll.out, now_s, self._roll.garbling, self._line.lateness, bool(heard)
        )
        return readings

    def _confirmed(self, heard: dict[int, Heard]) -> dict[int, Heard]:
        """Ask everybody who answered once more, and keep what both answers say.

        Raises:
            drivers.errors.BusLost: the port is gone.
        """
        again = self._reader.again(tuple(heard))
        kept: dict[int, Heard] = {}
        for servo_id, first in heard.items():
            self._roll.answered(servo_id)
            second = again.get(servo_id)
            both = second and self._readings.confirmed(self._slot[servo_id], first, second)
            if both:
                kept[servo_id] = both
            else:
                self._line.errors["unconfirmed"] += 1
        return kept

    def _send(self, goals: Sequence[int]) -> None:
        """Send goals with the speeds that may be used for them.

        Raises:
            drivers.errors.BusLost: the port is gone.
        """
        entering, speeds = self._care.entering, self._speeds
        if entering:
            speeds = self._recovery.speeds(self._ids, entering.ids)
        withheld = self._care.withheld(self._now_s)
        if not withheld:
            self._line.send(self._goals.packet(goals, speeds))
            return
        kept = [k for k, servo_id in enumerate(self._ids) if servo_id not in withheld]
        if kept:
            some = GoalWrite([self._ids[k] for k in kept])
            self._line.send(some.packet([goals[k] for k in kept], [speeds[k] for k in kept]))

    def _take_wanted(self) -> None:
        """Put in force what was asked for since the torque was on last."""
        if self._wanted == self._setups:
            return
        self._setups = self._wanted
        self._limits = tuple((setup.min_steps, setup.max_steps) for setup in self._setups)
        self._by_id.update({setup.id: setup for setup in self._setups})
        self._provisioning.set_target(self._setups)
        self._readings.want(self._setups)

    def _mind_silence(self, now_s: float) -> None:
        """Give up where nobody has answered for too long.

        Raises:
            drivers.errors.BusLost: so it is.
        """
        silent_s = self._health.silent_for_s(now_s)
        if silent_s >= self._params.give_up_s:
            raise BusLost(
                f"{self._port.port_name}: no servo has answered for {silent_s:.1f} s: "
                "check servo power and the cable"
            )

    # --- a port that goes away

    def _lose(self, lost: BusLost) -> None:
        self._link.lose(lost, self._now_s)

    def _trust_nobody(self) -> None:
        """Begin anew with a port that was away."""
        self._roll = self._reader.roll = Roll(self._ids)
        self._care.suspect_all()

    def _cannot_release(self) -> str:
        """Say what servos do that cannot be told to let go."""
        return (
            f"{self._port.port_name} is gone: torque could not be switched off; servos that have "
            "power go on to their last goal and hold it, as this kind has no bus watchdog: "
            f"{_CUT} to free them"
        )


_CUT = "cut the servo power"


def _check_ranges(setups: Sequence[ServoSetup]) -> None:
    """See that every range lies within one turn: beyond, positions mean nothing after a restart.

    Raises:
        ValueError: one does not.
    """
    for setup in setups:
        if not 0 <= setup.min_steps <= setup.max_steps < STEPS_PER_TURN:
            raise ValueError(
                f"{servo_label(setup)}: {setup.min_steps}..{setup.max_steps} is no range within "
                f"0..{STEPS_PER_TURN - 1} steps"
            )
