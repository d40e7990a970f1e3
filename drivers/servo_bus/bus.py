"""Smart servos of one family on one serial bus: one read and one write a tick."""

from abc import abstractmethod
from collections.abc import Collection, Mapping, Sequence
from typing import Protocol

from gazerig.drivers.errors import BusLost, PortError, ServoFault, ServoMissing
from gazerig.drivers.event_log import EventLog, servo_label
from gazerig.drivers.port_bus import PortBus, Supervising
from gazerig.drivers.released import Released
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.serial.reconnect import LastingPort
from gazerig.drivers.servo_bus.discovery import find
from gazerig.drivers.servo_bus.family import Family
from gazerig.drivers.servo_bus.faults import Health
from gazerig.drivers.servo_bus.feedback import FeedbackColumns
from gazerig.drivers.servo_bus.goals import clipped
from gazerig.drivers.servo_bus.poll_list import Roll
from gazerig.drivers.servo_bus.provisioning import AddressMap, Provisioning
from gazerig.drivers.servo_bus.recovery import Recovery
from gazerig.drivers.servo_bus.registers import Registers
from gazerig.drivers.servo_bus.torque import switch_off
from gazerig.drivers.servo_bus.transaction import Line
from gazerig.drivers.types import Feedback, ServoSetup

RESTART_S = 0.1
"""Servos that were silent for so long may have restarted: their power was cut."""


class BusParams(Protocol):
    """What a rig file chooses for a bus of any family."""

    @property
    def baud(self) -> int:
        """Bit/s."""

    @property
    def reply_timeout_ms(self) -> float:
        """Longest patience for an answer beyond its time on the wire."""

    @property
    def prompt_timeout_ms(self) -> float:
        """Shortest patience."""

    @property
    def give_up_s(self) -> float:
        """How long port or servos may be gone."""


class SmartSupervising(Supervising, Protocol):
    """What the bus asks of whoever looks after its servos."""

    def take_on(self, entering: Collection[int]) -> None:
        """Begin to look after servos under torque; some of them are outside their limits."""

    def mark_all_for_recovery(self) -> None:
        """Trust no servo to be as it was left."""


class Polled(Protocol):
    """What reads all servos of a poll list."""

    roll: Roll


class SmartServoBus(PortBus):
    """A chain of smart servos in position mode; implements gazerig.drivers.types.ServoBus.

    A family's own bus says how an answer becomes feedback, and who looks after the servos.

    Args:
        port: gazerig.drivers.serial.port.BlockingPort, or an emulated port with its methods.
        setups: the servos, in the order of every sequence given and taken.
        family: the make of the servos.
        params: how to speak with them.
        watchdog: Bus Watchdog to arm, in its units; 0 for none.

    Raises:
        ValueError: more servos than one packet of goals can hold, or a range beyond one turn.
    """

    _line: Line
    _supervisor: SmartSupervising
    _reader: Polled
    _feedback: FeedbackColumns

    def __init__(
        self,
        port: BusPort,
        setups: Sequence[ServoSetup],
        family: Family,
        params: BusParams,
        watchdog: int = 0,
    ) -> None:
        if len(setups) > family.most_goals:
            raise ValueError(
                f"{len(setups)} servos are too many for one bus: {family.most_goals} at most"
            )
        self._family, self._watchdog = family, watchdog
        self._check_setups(setups)
        self._port = port
        self._setups = self._wanted = tuple(setups)
        self._bus_params = params
        self._ids = tuple(setup.id for setup in setups)
        self._slot = {servo_id: i for i, servo_id in enumerate(self._ids)}
        self._limits = tuple((setup.min_steps, setup.max_steps) for setup in setups)
        self._goals = family.goals(self._ids)
        self._nothing = Feedback.of_none(len(self._ids))
        self._log = EventLog()
        self._line = Line(
            port,
            family,
            params.prompt_timeout_ms / 1000.0,
            params.reply_timeout_ms / 1000.0,
            params.baud,
            {setup.id: servo_label(setup) for setup in setups},
        )
        self._block: AddressMap | None = None
        self._assemble(None)

    def _assemble(self, firmware: Mapping[int, int] | None) -> None:
        """Make the parts, with a clean sheet, for what the servos can do.

        firmware: of each servo, None before it is known
        """
        line, log = self._line, self._log
        by_id = self._by_id = {setup.id: setup for setup in self._setups}
        self._link = LastingPort(
            self._port, self._bus_params.baud, self._bus_params.give_up_s, log, self._trust_nobody
        )
        self._roll = Roll(self._ids)
        self._health = Health(by_id, log)
        self._block = self._address_map(firmware)
        single = Registers(self._port, self._family, 1)
        self._provisioning = Provisioning(line, single, self._setups, log, self._block)
        self._recovery = Recovery(
            line, self._provisioning, by_id, self._watchdog, self._health, log
        )
        self._speeds = self._recovery.speeds(self._ids, ())
        self._assemble_family(firmware)

    @abstractmethod
    def _assemble_family(self, firmware: Mapping[int, int] | None) -> None:
        """Make the parts that differ from family to family."""

    def _address_map(self, firmware: Mapping[int, int] | None) -> AddressMap | None:
        """Return what indirect blocks must hold, None where there are none."""
        return None

    @abstractmethod
    def _read(self, now_s: float) -> None:
        """Read all servos into the feedback's columns while the port is there."""

    def _send(self, goals: Sequence[int]) -> None:
        """Send goals, each within its limits."""
        self._line.send(self._goals.packet(goals, self._speeds))

    @abstractmethod
    def _first_look(self) -> None:
        """Look at servos that have just been prepared."""

    # --- the bus as others see it

    def open(self) -> None:
        """Open the port, find every servo, check and prepare it; torque stays off.

        Raises:
            PortError: the port cannot be opened.
            ServoMissing: servos are absent, of another model or refuse.
        """
        self._take_wanted()
        where, baud = self._port.port_name, self._bus_params.baud
        if not self._port.setBaudRate(baud):
            raise PortError(
                f"{where} cannot run at {baud} bit/s: choose {self._family.usual_bauds}"
            )
        registers = Registers(self._port, self._family)
        try:
            firmware = find(self._line, registers, self._setups, self._log)
            self._assemble(firmware)
            first = Provisioning(self._line, registers, self._setups, self._log, self._block)
            first.disable(self._ids)
            first.apply(self._ids)
            self._line.starved = False
            self._first_look()
        except (ServoMissing, BusLost):
            self._port.closePort()
            raise
        self._opened = True

    def read(self, now_s: float) -> Feedback:
        """Read all servos in one exchange.

        A servo that keeps silent is left out of the exchange and asked alone now and
        then, so whatever is wrong, a read takes a bounded time. While the port is gone all
        are missing, and the port is tried again now and then.

        Raises:
            BusLost: port or servos have been gone for longer than ``give_up_s``.
        """
        if not self._reachable(now_s):
            return self._nothing
        try:
            self._read(now_s)
        except BusLost as lost:
            self._lose(lost)
            return self._nothing
        if self._roll.troubled:
            self._mind_silence(now_s)
        return self._feedback.feedback()

    def engage(self) -> tuple[int, ...]:
        """Set every goal to the present position (clipped to its limits), then torque on.

        A joint outside its limits is brought inside at 30 deg/s. Returns the goals that
        are now in force, in steps.

        Raises:
            BusLost: the port is gone.
            ServoMissing: a servo does not answer or does not take its goal.
            ServoFault: a servo has latched an error, refuses its torque, or
                stands beyond its encoder's zero, from where it would go the wrong way.
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
        self._supervisor.take_on(outside)
        self._speeds = self._recovery.speeds(self._ids, ())
        return goals

    def write(self, goals_steps: Sequence[int]) -> None:
        """Send one goal to every servo in one packet; goals are clipped to the limits.

        Sends nothing while the torque is off or the port is gone, and nothing to servos that
        stopped by themselves or may have restarted: the next reads set those up first.

        Raises:
            ValueError: a goal is not a number, or there are not as many as servos.
        """
        goals = clipped(goals_steps, self._limits)
        if not self._supervisor.engaged or self._link.down or self._line.starved:
            return
        try:
            self._send(goals)
        except BusLost as lost:
            self._lose(lost)

    def _take_wanted(self) -> None:
        """Put in force what was asked for since the torque was on last."""
        if self._wanted == self._setups:
            return
        self._setups = self._wanted
        self._limits = tuple((setup.min_steps, setup.max_steps) for setup in self._setups)
        self._by_id.update({setup.id: setup for setup in self._setups})
        self._provisioning.set_target(self._setups)
        self._feedback.set_limits(self._setups)

    def faults(self) -> tuple[str, ...]:
        """Name every fault that servos suffer from now, e.g. "neck_yaw (servo 7): overload"."""
        return tuple(
            f"{self._line.who(i)}: {fault}" for i, fault in sorted(self._health.faults.items())
        )

    def _switch_off(self) -> Released:
        return switch_off(self._line, self._ids)

    def _servo_label(self, servo_id: int) -> str:
        return self._line.who(servo_id)

    def _mind_silence(self, now_s: float) -> None:
        """Give up where nobody has answered for too long.

        Raises:
            BusLost: so it is.
        """
        silent_s = self._health.silent_for_s(now_s)
        if silent_s >= self._bus_params.give_up_s:
            raise BusLost(
                f"{self._port.port_name}: no servo has answered for {silent_s:.1f} s: "
                "check servo power and the cable"
            )

    def _trust_nobody(self) -> None:
        """Begin anew with a port that was away."""
        self._roll = self._reader.roll = Roll(self._ids)
        self._line.starved = False
        self._supervisor.mark_all_for_recovery()

    def _check_setups(self, setups: Sequence[ServoSetup]) -> None:
        """See that ranges lie within one turn: beyond, positions mean nothing after a restart.

        Raises:
            ValueError: one does not.
        """
        turn = self._family.steps_per_turn
        for setup in setups if self._family.single_turn else ():
            if not 0 <= setup.min_steps <= setup.max_steps < turn:
                raise ValueError(
                    f"{servo_label(setup)}: {setup.min_steps}..{setup.max_steps} is no range "
                    f"within 0..{turn - 1} steps"
                )
