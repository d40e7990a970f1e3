"""Reconnection of a port that was unplugged in use."""

from collections.abc import Callable

from gazerig.drivers.errors import BusLost, PortError
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.serial.port import BusPort

AGAIN_S = 0.2
"""Interval of attempts to open the port."""


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
        self.down = self.release_due = False
        self._lost_s = self._next_s = 0.0

    def record_loss(self, lost: BusLost, now_s: float) -> None:
        """Record that the port is lost."""
        self.down, self._lost_s, self._next_s = True, now_s, now_s + AGAIN_S
        self._port.closePort()
        self._log.add(f"port lost: {lost}")

    def try_reopen(self, now_s: float) -> bool:
        """Try to open the port if an attempt is due; return whether it is open.

        Raises:
            BusLost: it has been lost for longer than ``give_up_s``.
        """
        gone_s = now_s - self._lost_s
        if now_s >= self._next_s:
            self._next_s = now_s + AGAIN_S
            if self.reopen_now():
                where = getattr(self._port, "opened_as", self._port.port_name)
                renamed = f" as {where}" if where != self._port.port_name else ""
                self._log.add(f"port back after {gone_s:.1f} s{renamed}")
                return True
        if gone_s >= self._give_up_s:
            raise BusLost(
                f"{self._port.port_name} has been gone for {gone_s:.1f} s: check the USB cable"
            )
        return False

    def reopen_now(self) -> bool:
        """Try to open the port now, even if no attempt is due; return whether it is open."""
        try:
            if not self._port.setBaudRate(self._baud):
                return False
            self._port.clearPort()
        except (PortError, BusLost):
            self._port.closePort()
            return False
        self.down = False
        self._on_reconnect()
        return True

    def record_failed_release(self) -> None:
        """Record that torque could not be switched off; it is after the port reconnects."""
        self.release_due = True

    def record_release(self) -> None:
        """Record that torque was switched off on every servo that answers."""
        if self.release_due:
            self._log.add("torque switched off, as requested while the port was gone")
        self.release_due = False
