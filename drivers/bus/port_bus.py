"""What every servo bus shares: torque off, a port that is unplugged, byte and error counts."""

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Sequence
from typing import ClassVar, Protocol

from gazerig.drivers.bus.released import ReleaseResult
from gazerig.drivers.errors import BusLost
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.serial.reconnect import ReconnectingPort
from gazerig.drivers.types import BusHealth, ServoConfig

CUT = "cut the servo power"


class Exchange(Protocol):
    """What carries bytes: their counts, and errors by kind."""

    tx_bytes: int
    rx_bytes: int

    @property
    def errors(self) -> Counter[str]:
        """Return the errors by kind; other parts of the bus may add to them."""
        ...


class BusSupervisor(Protocol):
    """The supervisor of a bus, as far as ``PortBus`` needs it.

    engaged: goals are followed
    """

    engaged: bool

    def torque_disabled(self) -> None:
        """Stop the supervision of servos without torque."""


class PortBus(ABC):
    """The servos behind one port; part of an implementation of gazerig.drivers.types.ServoBus.

    A bus creates its parts before any of these methods is called, and may replace them.

    holding, unconfirmed: texts about a servo whose torque is not off, or that does not confirm it
    """

    holding: ClassVar[str] = "torque still on"
    unconfirmed: ClassVar[str] = "torque-off not confirmed"

    _port: BusPort
    _line: Exchange
    _link: ReconnectingPort
    _log: EventLog
    _supervisor: BusSupervisor
    _setups: tuple[ServoConfig, ...]
    _wanted: tuple[ServoConfig, ...]
    _opened = False
    _now_s = 0.0

    @abstractmethod
    def _check_setups(self, setups: Sequence[ServoConfig]) -> None:
        """Check that servos can have these setups.

        Raises:
            ValueError: one cannot.
        """

    @abstractmethod
    def _switch_off(self) -> ReleaseResult:
        """Switch the torque of all servos off and verify that it is off.

        Raises:
            BusLost: the port is gone.
        """

    @abstractmethod
    def _servo_label(self, servo_id: int) -> str:
        """Return a servo's label for messages."""

    @abstractmethod
    def _cannot_release(self) -> str:
        """Return what the servos do when their torque cannot be switched off."""

    def retune(self, setups: Sequence[ServoConfig]) -> None:
        """Set the setups that apply when the torque comes on the next time; same ids and models.

        Under torque everything stays as it is.

        Raises:
            ValueError: these are other servos, or they cannot be set up so.
        """
        same = [(s.id, s.model) for s in setups] == [(s.id, s.model) for s in self._setups]
        if not same:
            raise ValueError("other servos need another bus: ids and models must stay")
        self._check_setups(setups)
        self._wanted = tuple(setups)

    def events(self) -> tuple[str, ...]:
        """Return what happened since the last call, one line each."""
        return self._log.drain() if self._log.lines else ()

    def health(self) -> BusHealth:
        """Return byte and error counts of all exchanges."""
        errors = {kind: count for kind, count in self._line.errors.items() if count}
        return BusHealth(self._line.tx_bytes, self._line.rx_bytes, errors)

    def disable_torque(self) -> None:
        """Torque off on every servo, confirmed; never raises for a servo that does not answer.

        Raises:
            BusLost: the port is gone, and stays so when tried once more; the
                torque is taken off by the first read after it is back.
        """
        self._supervisor.torque_disabled()
        if not self._opened:
            return
        if self._link.down and not self._link.open_once_more(self._now_s):
            self._link.refused_release()
            raise BusLost(self._cannot_release())
        self._switch_all_off()

    def close(self) -> None:
        """Close the port; safe to call twice. Servos keep their last goals."""
        self._opened = False
        self._supervisor.torque_disabled()
        self._port.closePort()

    def _reachable(self, now_s: float) -> bool:
        """Return whether the port is open, reopened if needed, and no release of torque is pending.

        Raises:
            BusLost: it has been gone for longer than ``give_up_s``.
        """
        self._now_s = now_s
        if self._link.down and not self._link.returned(now_s):
            return False
        if self._link.release_due:
            try:
                self._switch_all_off()
            except BusLost:
                return False
        return True

    def _switch_all_off(self) -> None:
        """Switch all torque off, verify it, and report the servos that keep it.

        Raises:
            BusLost: the port is gone.
        """
        try:
            released = self._switch_off()
        except BusLost as lost:
            self._lose(lost)
            self._link.refused_release()
            raise BusLost(self._cannot_release()) from lost
        self._link.released()
        self._line.errors["refused"] += len(released.holding)
        for ids, what in (
            (released.holding, self.holding),
            (released.unconfirmed, self.unconfirmed),
        ):
            for servo_id in ids:
                self._log.add(f"{self._servo_label(servo_id)}: {what}: {CUT}")

    def _lose(self, lost: BusLost) -> None:
        self._link.lose(lost, self._now_s)
