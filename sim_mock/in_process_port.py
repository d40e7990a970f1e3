"""A serial port without a wire, over an emulated device in this process.

Drivers use it as a gazerig.drivers.serial.port.BusPort, ROBOTIS' SDK as its PortHandler. Time is
the device's: a missing answer costs no time. With wire time or late answers by faults, bytes
arrive when the device's clock reaches their time; waiting advances that clock with
``sleep_until``. The baud rate is that of ``setBaudRate``.
"""

import errno
import os
from collections.abc import Callable

from dynamixel_sdk import PortHandler

from gazerig.drivers.errors import BusLost, PortError
from gazerig.sim_mock.device import Device
from gazerig.sim_mock.wire import ServoLine

BITS_PER_BYTE = 10


class InProcessPort(PortHandler):  # type: ignore[misc]  # the SDK has no types
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
        super().__init__(name)
        self.chain = chain
        self.faults = chain.faults
        self.line = ServoLine(chain, wire_time)
        self.now_s = chain.now_s
        self._tap = tap
        self._sleep_until = sleep_until
        self._waiting = b""
        self._lost = False
        self._give_up_s = 0.0

    # --- methods for a driver's control loop

    def write(self, data: bytes) -> None:
        """Send bytes; answers wait to be read.

        Raises:
            BusLost: unplugged.
        """
        self._fetch_arrived()
        if self._tap is not None:
            self._tap(data)
        self._waiting += self.line.send(data, self.baudrate)

    def read_until(self, length: int, deadline_s: float) -> bytes:
        """Return up to ``length`` bytes, fewer if no more arrive before the deadline.

        Raises:
            BusLost: unplugged.
        """
        self._fetch_arrived()
        while len(self._waiting) < length and self._sleep_until is not None:
            due_s = self.line.next_due_s()
            if due_s is None or due_s > deadline_s:
                self._wait(deadline_s)
                break
            self._wait(due_s)
        taken, self._waiting = self._waiting[:length], self._waiting[length:]
        return taken

    def exchange(self, request: bytes, length: int, deadline_s: float) -> tuple[bytes, float]:
        """Discard received bytes, send a request and read until the deadline.

        Returns:
            The received bytes, and the time at which the request had been sent.

        Raises:
            BusLost: unplugged.
        """
        self.drain()
        self.write(request)
        sent_s = self.now_s()
        return self.read_until(length, deadline_s), sent_s

    def drain(self) -> int:
        """Discard received bytes; return their number."""
        self._fetch_arrived()
        dropped = len(self._waiting)
        self._waiting = b""
        return dropped

    def _fetch_arrived(self) -> None:
        """Fetch the bytes that have arrived by now."""
        if self.faults.wire.has_any and self.faults.is_on("unplug"):
            self._lost = True
        if self._lost:
            self._waiting = b""
            self.line.forget()
            raise BusLost(f"{self.port_name} is gone: plug the adapter in")
        if self.line.is_busy:
            self._waiting += self.line.take_arrived()

    def _wait(self, until_s: float) -> None:
        """Advance the device's clock to a time, if it can be advanced."""
        if self._sleep_until is not None and until_s > self.now_s():
            self._sleep_until(until_s)
        self._fetch_arrived()

    # --- methods for the SDK

    def setBaudRate(self, baudrate: int) -> bool:
        """Open at a baud rate."""
        return self.setupPort(baudrate)

    def setupPort(self, cflag_baud: int) -> bool:
        """Open at a baud rate.

        Raises:
            PortError: unplugged.
        """
        if self.faults.is_on("unplug"):
            raise PortError(f"cannot open {self.port_name}: {os.strerror(errno.ENOENT)}")
        self.is_open = True
        self.is_using = False
        self.baudrate = cflag_baud
        self.tx_time_per_byte = 1000.0 * BITS_PER_BYTE / self.baudrate
        self._lost = False
        self._waiting = b""
        self.line.forget()
        return True

    def closePort(self) -> None:
        """Close; safe to call twice."""
        self.is_open = False

    def clearPort(self) -> None:
        """Discard received bytes."""
        self.drain()

    def getBytesAvailable(self) -> int:
        """Return the number of received bytes."""
        self._fetch_arrived()
        return len(self._waiting)

    def readPort(self, length: int) -> bytes:
        """Return up to ``length`` bytes."""
        return self.read_until(length, self.now_s())

    def writePort(self, packet: bytes | list[int]) -> int:
        """Send bytes; return their number."""
        data = bytes(packet)
        self.write(data)
        return len(data)

    def getCurrentTime(self) -> float:
        """Return the device's time in milliseconds."""
        return self.now_s() * 1000.0

    def setPacketTimeout(self, packet_length: int) -> None:
        """Set the SDK's time-out from the length of the packet."""
        self.setPacketTimeoutMillis(self.tx_time_per_byte * packet_length + 34.0)

    def setPacketTimeoutMillis(self, msec: float) -> None:
        """Set the SDK's time-out."""
        self._give_up_s = self.now_s() + msec / 1000.0

    def isPacketTimeout(self) -> bool:
        """Return whether further waiting is useless because no more answers will arrive.

        A simulated clock is advanced to the next bytes or to the end of the time-out.
        """
        if self._sleep_until is None or self._waiting:
            return not self.line.is_busy
        due_s = self.line.next_due_s()
        if due_s is None or due_s > self._give_up_s:
            self._wait(self._give_up_s)
            return True
        self._wait(due_s)
        return False
