"""Base of servo buses: torque off, reconnection of an unplugged port, byte and error counts."""

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Protocol

from gazerig.drivers.bus.release_result import ReleaseResult
from gazerig.drivers.errors import BusLost, PortError
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.serial.port import BusPort, open_port
from gazerig.drivers.types import BusHealth, ServoConfig

CUT = "cut the servo power"

AGAIN_S = 0.2
"""Interval of attempts to open a lost port."""


class Exchange(Protocol):
    """Byte and error counts of the exchanges on a line."""

    tx_bytes: int
    rx_bytes: int
    errors: Counter[str]


class PortBus(ABC):
    """The servos on one port; base of implementations of gazerig.drivers.types.ServoBus.

    A bus creates its parts before any of these methods is called, and may replace them.

    _labels: labels of servos for messages, by id
    _give_up_s: longest loss of the port, seconds
    _is_down: whether the port is lost
    _release_due: whether torque must be switched off as soon as the port is open
    """

    _port: BusPort
    _line: Exchange
    _log: EventLog
    _labels: Mapping[int, str]
    _setups: tuple[ServoConfig, ...]
    _target_setups: tuple[ServoConfig, ...]
    _baud: int
    _give_up_s: float
    _opened = _is_down = _release_due = False
    _now_s = _lost_s = _next_s = 0.0

    @abstractmethod
    def _check_setups(self, setups: Sequence[ServoConfig]) -> None:
        """Check that the servos accept these setups.

        Raises:
            ValueError: a setup is not possible.
        """

    @abstractmethod
    def _stop_supervision(self) -> None:
        """Stop supervision, as the servos have no torque."""

    @abstractmethod
    def _switch_off(self) -> ReleaseResult:
        """Switch the torque of all servos off and verify that it is off.

        Raises:
            BusLost: the port is lost.
        """

    @abstractmethod
    def _reset_after_reconnect(self) -> None:
        """Reset the state after the port was opened again: every servo must be checked."""

    def retune(self, setups: Sequence[ServoConfig]) -> None:
        """Store setups, with the same ids and models, for the next time torque is switched on.

        While torque is on nothing changes.

        Raises:
            ValueError: the servos are not the same, or a setup is not possible.
        """
        if [(s.id, s.model) for s in setups] != [(s.id, s.model) for s in self._setups]:
            raise ValueError("ids and models must not change: create another bus for other servos")
        self._check_setups(setups)
        self._target_setups = tuple(setups)

    def events(self) -> tuple[str, ...]:
        """Return the events since the last call, one line each."""
        return self._log.drain() if self._log.lines else ()

    def health(self) -> BusHealth:
        """Return byte and error counts of all exchanges."""
        errors = {kind: count for kind, count in self._line.errors.items() if count}
        return BusHealth(self._line.tx_bytes, self._line.rx_bytes, errors)

    def disable_torque(self) -> None:
        """Switch torque off on every servo and confirm it; never raises for a silent servo.

        Raises:
            BusLost: the port is lost and cannot be reopened; the first read after it reconnects
                switches torque off.
        """
        self._stop_supervision()
        if not self._opened:
            return
        if self._is_down and not self._reopen():
            self._release_due = True
            raise self._release_failure()
        self._switch_all_off()

    def close(self) -> None:
        """Close the port; safe to call twice. Servos keep their last goals."""
        self._opened = False
        self._stop_supervision()
        self._port.closePort()

    def _reopen_if_needed(self, now_s: float) -> bool:
        """Reopen the port if needed; return whether it is open and no torque release is pending.

        Raises:
            BusLost: it has been lost for longer than ``_give_up_s``.
        """
        self._now_s = now_s
        if self._is_down:
            gone_s = now_s - self._lost_s
            if now_s >= self._next_s:
                self._next_s = now_s + AGAIN_S
                if self._reopen():
                    self._log.add(f"port back after {gone_s:.1f} s")
            if self._is_down and gone_s >= self._give_up_s:
                raise BusLost(
                    f"{self._port.port_name} has been gone for {gone_s:.1f} s: check the USB cable"
                )
        if self._release_due and not self._is_down:
            try:
                self._switch_all_off()
            except BusLost:
                return False
        return not self._is_down

    def _reopen(self) -> bool:
        """Try to open the port; return whether it is open."""
        try:
            open_port(self._port, self._baud)
            self._port.drain(0.0)
        except (PortError, BusLost):
            self._port.closePort()
            return False
        self._is_down = False
        self._reset_after_reconnect()
        return True

    def _switch_all_off(self) -> None:
        """Switch all torque off, verify it, and report the servos that keep it."""
        try:
            released = self._switch_off()
        except BusLost as lost:
            self._record_loss(lost)
            self._release_due = True
            raise self._release_failure() from lost
        if self._release_due:
            self._log.add("torque switched off, as requested while the port was gone")
        self._release_due = False
        self._line.errors["refused"] += len(released.holding_ids)
        for servo_id in (*released.holding_ids, *released.unconfirmed_ids):
            holds = servo_id in released.holding_ids
            what = "torque still on" if holds else "torque-off not confirmed"
            self._log.add(f"{self._labels[servo_id]}: {what}: {CUT}")

    def _release_failure(self) -> BusLost:
        return BusLost(
            f"{self._port.port_name} is gone: torque could not be switched off; servos that have "
            f"power hold their position or last goal: {CUT} to free them"
        )

    def _record_loss(self, lost: BusLost) -> None:
        """Record that the port is lost."""
        self._is_down, self._lost_s, self._next_s = True, self._now_s, self._now_s + AGAIN_S
        self._port.closePort()
        self._log.add(f"port lost: {lost}")
