"""Base of servo buses: torque off, reconnection of an unplugged port, byte and error counts."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from contextlib import suppress
from math import inf
from typing import Any

from gazerig.drivers.bus.release_result import ReleaseResult
from gazerig.drivers.errors import BusLost, PortError
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.process.host_lateness import BLAME_S
from gazerig.drivers.serial.port import BusPort, open_port
from gazerig.drivers.types import BusHealth, ServoConfig

CUT = "cut the servo power"

AGAIN_S = 0.2
"""Interval of attempts to open a lost port."""


class PortBus(ABC):
    """The servos on one port; base of implementations of gazerig.drivers.types.ServoBus.

    A bus creates its parts before any of these methods is called, and may replace them.

    _line: has the counts tx_bytes, rx_bytes and errors, and lateness
    _labels: labels of servos for messages, by id
    _give_up_s: longest loss of the port, seconds
    _is_down: whether the port is lost
    _release_due: whether torque must be switched off as soon as the port is open
    """

    _port: BusPort
    _line: Any
    _log: EventLog
    _labels: Mapping[int, str]
    _setups: tuple[ServoConfig, ...]
    _target_setups: tuple[ServoConfig, ...]
    _baud: int
    _give_up_s: float
    _opened = _is_down = _release_due = _is_silence_told = False
    _now_s = _lost_s = _next_s = 0.0
    _silent_since_s = inf

    @abstractmethod
    def _check_setups(self, setups: Sequence[ServoConfig]) -> None:
        """Raise ValueError if a servo cannot have its setup."""

    @abstractmethod
    def _stop_supervision(self) -> None:
        """Stop supervision, as the servos have no torque."""

    @abstractmethod
    def _switch_off(self) -> ReleaseResult:
        """Switch the torque of all servos off and verify it; raise BusLost if the port is lost."""

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
        return self._log.drain()

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
        if self._opened:
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
        self._now_s, gone_s = now_s, now_s - self._lost_s
        if self._is_down and now_s >= self._next_s:
            self._next_s = now_s + AGAIN_S
            if self._reopen():
                self._log.add(f"port back after {gone_s:.1f} s")
        if self._is_down and gone_s >= self._give_up_s:
            raise BusLost(
                f"{self._port.port_name} has been gone for {gone_s:.1f} s: check the USB cable"
            )
        if self._release_due and not self._is_down:
            with suppress(BusLost):
                self._switch_all_off()
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
        released = None
        if not self._is_down or self._reopen():
            try:
                released = self._switch_off()
            except BusLost as lost:
                self._record_loss(lost)
        if released is None:
            self._release_due = True
            raise BusLost(
                f"{self._port.port_name} is gone: torque could not be switched off; servos that "
                f"have power hold their position or last goal: {CUT} to free them"
            )
        if self._release_due:
            self._log.add("torque switched off, as requested while the port was gone")
        self._release_due = False
        self._line.errors["refused"] += len(released.holding_ids)
        for servo_id in released.holding_ids:
            self._log.add(f"{self._labels[servo_id]}: torque still on: {CUT}")
        for servo_id in released.unconfirmed_ids:
            self._log.add(f"{self._labels[servo_id]}: torque-off not confirmed: {CUT}")

    def _check_silence(self, answered: bool, fault: str, remedy: str) -> None:
        """Report that nothing answers any more, once after a longer silence.

        Raises:
            BusLost: it has lasted for longer than ``_give_up_s``.
        """
        if answered:
            self._silent_since_s, self._is_silence_told = inf, False
            return
        since_s = self._silent_since_s = min(self._silent_since_s, self._now_s)
        silent_s = self._now_s - since_s
        if silent_s < min(BLAME_S, self._give_up_s):
            return
        text = f"{fault} for {silent_s:.1f} s"
        text = self._line.lateness.blame(text, remedy, self._now_s, since_s)
        if silent_s >= self._give_up_s:
            raise BusLost(f"{self._port.port_name}: {text}")
        if not self._is_silence_told:
            self._is_silence_told = True
            self._log.add(text)

    def _record_loss(self, lost: BusLost) -> None:
        self._is_down, self._lost_s, self._next_s = True, self._now_s, self._now_s + AGAIN_S
        self._port.closePort()
        self._log.add(f"port lost: {lost}")
