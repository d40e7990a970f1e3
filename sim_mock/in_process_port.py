"""A serial port without a wire, over an emulated device in this process.

It is a gazerig.drivers.serial.port.BusPort. Time is the device's: a missing answer costs no time.
With wire time or late answers by faults, bytes arrive when the device's clock reaches their time;
waiting advances that clock with ``sleep_until``. The baud rate is that of ``setBaudRate``.
"""

import errno
import os
import threading
from collections.abc import Callable

from gazerig.drivers.errors import BusLost, PortError
from gazerig.sim_mock.device import Device
from gazerig.sim_mock.wire import ServoLine


class InProcessPort:
    """The host's end of an emulated device.

    Args:
        chain: a chain of servos, or a board; its clock is the port's clock.
        tap: receives every byte string that the host sends.
        sleep_until: advances that clock, for waiting; without it no call waits.
        wire_time: whether bytes take time on the line and return delays apply.
    """

    def __init__(
        self,
        chain: Device,
        tap: Callable[[bytes], None] | None = None,
        name: str = "emulated servos",
        sleep_until: Callable[[float], None] | None = None,
        wire_time: bool = False,
    ) -> None:
        self.port_name = name
        self.chain = chain
        self.faults = chain.faults
        self.line = ServoLine(chain, wire_time)
        self.now_s = chain.now_s
        self._tap = tap
        self._sleep_until = sleep_until
        self._waiting = b""
        self._lost = False
        self._in_use = threading.Lock()
        self.baudrate = 0

    def command(self, text: str) -> str:
        """Run a fault command; return a description of its effect. Thread-safe.

        Raises:
            ValueError: the command is invalid; the message names the wrong word and valid ones.
        """
        with self._in_use:
            return self.faults.command(text)

    def setBaudRate(self, baudrate: int) -> bool:
        """Open at a baud rate.

        Raises:
            PortError: unplugged.
        """
        if self.faults.is_on("unplug"):
            raise PortError(f"cannot open {self.port_name}: {os.strerror(errno.ENOENT)}")
        self.baudrate = baudrate
        self._lost = False
        self._waiting = b""
        self.line.forget()
        return True

    def closePort(self) -> None:
        """Do nothing: there is nothing to free."""

    def write(self, data: bytes) -> None:
        """Send bytes; answers wait to be read.

        Raises:
            BusLost: unplugged.
        """
        self._fetch_arrived()
        if self._tap is not None:
            self._tap(data)
        with self._in_use:
            self._waiting += self.line.send(data, self.baudrate)

    def read_until(self, length: int, deadline_s: float) -> bytes:
        """Return up to ``length`` bytes, fewer if no more arrive before the deadline.

        Raises:
            BusLost: unplugged.
        """
        self._fetch_arrived()
        while len(self._waiting) < length and self._sleep_until is not None:
            due_s = self.line.next_due_s()
            until_s = deadline_s if due_s is None else min(due_s, deadline_s)
            self._sleep_until(until_s)
            self._fetch_arrived()
            if until_s == deadline_s:
                break
        taken, self._waiting = self._waiting[:length], self._waiting[length:]
        return taken

    def drain(self, quiet_s: float = 0.0) -> int:
        """Discard received bytes; return their number."""
        self._fetch_arrived()
        dropped = len(self._waiting)
        self._waiting = b""
        return dropped

    def _fetch_arrived(self) -> None:
        """Fetch the bytes that have arrived by now."""
        with self._in_use:
            if self.faults.is_on("unplug"):
                self._lost = True
        if self._lost:
            raise BusLost(f"{self.port_name} is gone: plug the adapter in")
        if self.line.is_busy:
            self._waiting += self.line.take_arrived()
