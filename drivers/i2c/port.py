"""An I2C bus of the kernel as a byte port with the behaviour of a bridge chip.

The commands are those of gazerig.drivers.i2c.transfers. The kernel itself frees a bus whose data
line is held low, if its driver can.
"""

import errno
import fcntl
import time
from typing import Any

from smbus2 import SMBus, i2c_msg

from gazerig.drivers.errors import PortError
from gazerig.drivers.i2c.transfers import NO_ACKNOWLEDGE, OK, READ_STATUS, START, STOP
from gazerig.drivers.serial.host_port import HostPort
from gazerig.drivers.serial.list_ports import open_failure_text

I2C_RETRIES, I2C_TIMEOUT = 0x0701, 0x0702
"""Requests of the kernel's i2c-dev."""
READ_FLAG = 0x0001
TIMEOUT_10_MS = 2
"""Time-out of a transfer in units of 10 ms: 20 ms instead of one second."""

_GONE = (errno.ENODEV, errno.ENOENT, errno.EBADF, errno.ESHUTDOWN)


class I2cPort(HostPort):
    """A real I2C bus; implements gazerig.drivers.serial.port.BusPort.

    ``exclusive`` locks out other servo programs; programs for sensors are not affected.
    """

    _bus: Any = None
    _waiting = b""

    def setBaudRate(self, baudrate: int) -> bool:
        """Open the bus; its rate is set in the system, not here."""
        self.closePort()
        try:
            self._bus = SMBus(self.port_name)
            if self._bus.fd is not None:
                if self._exclusive:
                    fcntl.flock(self._bus.fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
                fcntl.ioctl(self._bus.fd, I2C_TIMEOUT, TIMEOUT_10_MS)
                fcntl.ioctl(self._bus.fd, I2C_RETRIES, 1)
        except OSError as error:
            self.closePort()
            raise PortError(open_failure_text(self.port_name, error.errno)) from error
        return True

    def closePort(self) -> None:
        """Close; safe to call twice."""
        if self._bus is not None:
            self._bus.close()
        self._bus, self._waiting = None, b""

    def write(self, data: bytes) -> None:
        """Execute transfers; bytes that they read are kept for ``read_until``."""
        self._on_traffic()
        if self._bus is None:
            raise self._lost("it is closed")
        at, status = 0, OK
        while at < len(data):
            if data.startswith(READ_STATUS, at):
                self._waiting += bytes((status,))
                at += len(READ_STATUS)
                continue
            at, messages = transfer_at(data, at)
            try:
                self._bus.i2c_rdwr(*messages)
            except OSError as error:
                if error.errno in _GONE:
                    raise self._lost(error) from error
                status = NO_ACKNOWLEDGE
            else:
                status = OK
                self._waiting += b"".join([bytes(one) for one in messages if one.flags & READ_FLAG])

    def read_until(self, length: int, deadline_s: float) -> bytes:
        """Return up to ``length`` available bytes; if there are none, wait until the deadline."""
        self._on_traffic()
        # Transfers have ended when ``write`` returns: no more bytes can arrive.
        if not self._waiting and (left_s := deadline_s - self.now_s()) > 0.0:
            time.sleep(left_s)
        taken, self._waiting = self._waiting[:length], self._waiting[length:]
        return taken

    def drain(self, quiet_s: float = 0.0) -> int:
        """Discard received bytes, without waiting; return their number."""
        dropped, self._waiting = len(self._waiting), b""
        return dropped


def transfer_at(data: bytes, at: int) -> tuple[int, list[Any]]:
    """Return the end of the transfer that begins at an index, and its messages.

    Raises:
        ValueError: the bytes are not a whole transfer.
    """
    messages = []
    while len(data) > at + 2 and data[at] == START:
        address, count = data[at + 1], data[at + 2]
        at += 3
        if address & 1:
            messages.append(i2c_msg.read(address >> 1, count))
        else:
            messages.append(i2c_msg.write(address >> 1, data[at : at + count]))
            at += count
    if not messages or at >= len(data) or data[at] != STOP:
        raise ValueError(f"no whole transfer: {data.hex(' ')}")
    return at + 1, messages
