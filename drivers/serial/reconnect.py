"""Reconnection of a port that was unplugged in use."""

from collections.abc import Callable

from gazerig.drivers.errors import BusLost, PortError
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.serial.port import BusPort

FIRST_S, LAST_S = 0.1, 1.0
"""Interval of attempts: doubled from the first to the last value."""


class Reconnect:
    """State of a port: open, or lost with the times of its loss and of the next attempt.

    down: whether the port is lost
    """

    def __init__(self) -> None:
        self.down = False
        self._since_s = self._next_s = 0.0
        self._wait_s = FIRST_S

    def record_lost(self, now_s: float) -> None:
        """Record that the port is lost."""
        self.down = True
        self._since_s, self._wait_s = now_s, FIRST_S
        self._next_s = now_s + FIRST_S

    def is_due(self, now_s: float) -> bool:
        """Return whether an attempt is due."""
        return now_s >= self._next_s

    def record_failed(self, now_s: float, longest_s: float = LAST_S) -> None:
        """Record a failed attempt; the next one follows within ``longest_s``."""
        self._wait_s = min(longest_s, 2.0 * self._wait_s)
        self._next_s = now_s + self._wait_s

    def record_reopened(self, now_s: float) -> float:
        """Record that the port is open again; return the time for which it was lost, seconds."""
        self.down = False
        return now_s - self._since_s

    def gone_for_s(self, now_s: float) -> float:
        """Return the time for which the port has been lost, seconds."""
        return now_s - self._since_s if self.down else 0.0


class ReconnectingPort:
    """A port that is reopened after it was unplugged.

    Args:
        port: Port, opened once already.
        baud: Baud rate, bit/s.
        give_up_s: Longest loss, seconds.
        log: Records loss and reconnection.
        on_reconnect: Called when it is open again: every servo must be checked.

    down: whether the port is lost
    release_due: whether torque must be switched off as soon as the port is open; set and cleared by
        the bus
    """

    def __init__(
        self,
        port: BusPort,
        baud: int,
        give_up_s: float,
        log: EventLog,
        on_reconnect: Callable[[], None],
    ) -> None:
        self._port, self._baud, self._give_up_s = port, baud, give_up_s
        self._log, self._on_reconnect = log, on_reconnect
        self._link = Reconnect()
        self.down = self.release_due = False

    def record_loss(self, lost: BusLost, now_s: float) -> None:
        """Record that the port is lost."""
        self._link.record_lost(now_s)
        self.down = True
        self._port.closePort()
        self._log.add(f"port lost: {lost}")

    def try_reopen(self, now_s: float) -> bool:
        """Try to open the port if an attempt is due; return whether it is open.

        Raises:
            BusLost: it has been lost for longer than ``give_up_s``.
        """
        gone_s = self._link.gone_for_s(now_s)
        if self._link.is_due(now_s):
            if self._open():
                self.down = False
                where = getattr(self._port, "opened_as", self._port.port_name)
                renamed = f" as {where}" if where != self._port.port_name else ""
                self._log.add(f"port back after {self._link.record_reopened(now_s):.1f} s{renamed}")
                return True
            self._link.record_failed(now_s, FIRST_S if self.release_due else LAST_S)
        if gone_s >= self._give_up_s:
            raise BusLost(
                f"{self._port.port_name} has been gone for {gone_s:.1f} s: check the USB cable"
            )
        return False

    def record_failed_release(self) -> None:
        """Record that torque could not be switched off; it is after the port reconnects."""
        self.release_due = True

    def record_release(self) -> None:
        """Record that torque was switched off on every servo that answers."""
        if self.release_due:
            self._log.add("torque switched off, as requested while the port was gone")
        self.release_due = False

    def reopen_now(self, now_s: float) -> bool:
        """Try to open the port now, even if no attempt is due; return whether it is open."""
        if not self._open():
            return False
        self._link.record_reopened(now_s)
        self.down = False
        return True

    def _open(self) -> bool:
        try:
            if not self._port.setBaudRate(self._baud):
                return False
            self._port.clearPort()
        except (PortError, BusLost):
            self._port.closePort()
            return False
        self._on_reconnect()
        return True
