"""Serial port of a servo bus: it waits in the kernel instead of spinning.

It owns the host clock of the servo bus (monotonic seconds).
"""

import os
import select
import termios
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

from dynamixel_sdk import PortHandler
from serial import Serial, SerialException

from gazerig.drivers.errors import BusLost, PortError
from gazerig.drivers.serial.list_ports import is_i2c, open_failure_text, persistent_name

BITS_PER_BYTE = 10
SDK_MARGIN_S = 0.034
"""Time that the SDK allows for two periods of a USB adapter's 16 ms latency timer."""

QUIET_S = 0.003
"""Time without a byte after which a line is quiet: three periods of a 1 ms latency timer."""

BABBLE_S = 0.06
"""Longest time to drain a line that never falls silent."""

MORE_RATES = (38_400, 76_800, 128_000, 250_000)
"""Bit/s that servos and adaptors support but that are not in the SDK's list."""

WRITE_S = 0.05
"""Longest time to pass a packet to the adapter."""


class BusPort(Protocol):
    """Port interface of the driver; for setup it is also the SDK's PortHandler."""

    port_name: str

    def now_s(self) -> float:
        """Return the time, seconds."""

    def setBaudRate(self, baudrate: int) -> bool:
        """Open at a baud rate; return False if the rate is not supported."""

    def closePort(self) -> None:
        """Close; safe to call twice."""

    def write(self, data: bytes) -> None:
        """Send bytes.

        Raises:
            BusLost: the port is lost.
        """

    def read_until(self, length: int, deadline_s: float) -> bytes:
        """Return up to ``length`` bytes, those received before the deadline.

        Raises:
            BusLost: the port is lost.
        """

    def exchange(self, request: bytes, length: int, deadline_s: float) -> tuple[bytes, float]:
        """Clear the port, send a request and read until the deadline, all in one.

        Returns:
            The result of ``read_until``, and the time at which the request was written, seconds.

        Raises:
            BusLost: the port is lost.
        """

    def getBytesAvailable(self) -> int:
        """Return the number of received bytes.

        Raises:
            BusLost: the port is lost.
        """

    def clearPort(self) -> None:
        """Discard received bytes, without waiting.

        Raises:
            BusLost: the port is lost.
        """

    def drain(self) -> int:
        """Discard bytes until the line is quiet; return their number.

        Raises:
            BusLost: the port is lost.
        """


class BlockingPort(PortHandler):  # type: ignore[misc]  # the SDK has no types
    """A real serial port.

    Args:
        port_name: Its path.
        exclusive: Whether to open it for this program alone; otherwise it is shared with the
            program that has it open.
        on_traffic: Called whenever bytes are sent or waited for; None if not needed.
        by_id: Folder of persistent names of adaptors, None for the system's.

    opened_as: the path that was opened last; an adaptor may reconnect under another name
    """

    def __init__(
        self,
        port_name: str,
        exclusive: bool = True,
        on_traffic: Callable[[], None] | None = None,
        by_id: Path | None = None,
    ) -> None:
        super().__init__(port_name)
        self.opened_as = port_name
        self._lasting: str | None = None
        self._by_id = by_id
        self._exclusive = exclusive
        self._on_traffic = on_traffic
        self.ser: Serial | None = None
        self._fd = -1
        self._poll: Callable[[int], object] = _raise_closed
        self._deadline_s = 0.0

    # --- methods for the control loop

    now_s = staticmethod(time.monotonic)
    """Host monotonic seconds."""

    def write(self, data: bytes) -> None:
        """Send bytes; wait at most 50 ms for space in the adapter's buffer.

        Raises:
            BusLost: the port is lost or accepts no bytes.
        """
        if self._on_traffic is not None:
            self._on_traffic()
        deadline_s = 0.0
        while True:
            try:
                sent = os.write(self._fd, data)
            except BlockingIOError:
                sent = 0
            except OSError as error:
                raise self._lost(error) from error
            if sent == len(data):
                return
            data = data[sent:]
            deadline_s = deadline_s or time.monotonic() + WRITE_S
            # Sleep until a byte can be sent.
            try:
                ready = select.select((), (self._fd,), (), max(0.0, deadline_s - time.monotonic()))
            except (OSError, ValueError) as error:
                raise self._lost(error) from error
            if not ready[1]:
                raise self._lost("it accepts no more bytes")

    def read_until(self, length: int, deadline_s: float) -> bytes:
        """Return up to ``length`` bytes, those received before the deadline.

        Raises:
            BusLost: the port is lost.
        """
        if self._on_traffic is not None:
            self._on_traffic()
        return self._read_rest(b"", length, deadline_s)

    def _read_rest(self, got: bytes, length: int, deadline_s: float) -> bytes:
        """Read until there are ``length`` bytes, or the deadline."""
        while len(got) < length and self._wait(deadline_s):
            more = self._read_available(length - len(got))
            got = got + more if got else more
        if not got and not os.path.exists(self.opened_as):
            raise self._lost("it was unplugged")
        return got

    def exchange(self, request: bytes, length: int, deadline_s: float) -> tuple[bytes, float]:
        """Clear the port, send a request and read until the deadline.

        It runs in every tick, so this one function contains the whole usual path.

        Returns:
            ``length`` bytes, or those that arrived; the time at which the request was written,
            seconds.

        Raises:
            BusLost: the port is lost or accepts no bytes.
        """
        if self._on_traffic is not None:
            self._on_traffic()
        fd, sent, got = self._fd, 0, b""
        try:
            # A poll takes a quarter of the time of a flush, which is rarely needed.
            if self._poll(0):
                termios.tcflush(fd, termios.TCIFLUSH)
            sent = os.write(fd, request)
        except BlockingIOError:
            pass  # no space
        except (OSError, ValueError, termios.error) as error:
            raise self._lost(error) from error
        if sent < len(request):
            self.write(request[sent:])
        sent_s = time.monotonic()
        try:
            left_ms = int(1e3 * (deadline_s - sent_s))
            if left_ms > 0 and self._poll(left_ms):
                got = os.read(fd, length)
                if not got:
                    raise self._lost("it hung up")
        except BlockingIOError:
            pass  # no bytes after all
        except (OSError, ValueError) as error:
            raise self._lost(error) from error
        if len(got) < length:
            got = self._read_rest(got, length, deadline_s)
        return got, sent_s

    def drain(self) -> int:
        """Discard bytes until none arrives for 3 ms; return their number.

        Raises:
            BusLost: the port is lost.
        """
        end_s = time.monotonic() + BABBLE_S
        dropped = 0
        while (now_s := time.monotonic()) < end_s and self._wait(now_s + QUIET_S):
            dropped += len(self._read_available(4096))
        return dropped

    def _wait(self, deadline_s: float) -> bool:
        """Sleep until a byte arrives; return False at the deadline."""
        try:
            left_s = deadline_s - time.monotonic()
            # poll() takes half as long as select(), but its unit is whole milliseconds.
            if left_s >= 0.001 and self._poll(int(1e3 * left_s)):
                return True
            left_s = max(0.0, deadline_s - time.monotonic())
            return bool(select.select((self._fd,), (), (), left_s)[0])
        except (OSError, ValueError) as error:
            raise self._lost(error) from error

    def _read_available(self, length: int) -> bytes:
        try:
            data = os.read(self._fd, length)
        except BlockingIOError:
            return b""
        except OSError as error:
            raise self._lost(error) from error
        if not data:
            raise self._lost("it hung up")
        return data

    def _lost(self, reason: object) -> BusLost:
        """Return the error and clear the SDK's busy flag, so that a reopened port works."""
        self.is_using = False
        return BusLost(f"{self.port_name} is gone ({reason}): check USB cable and servo power")

    # --- methods for the SDK

    def setBaudRate(self, baudrate: int) -> bool:
        """Open at a baud rate; return False if the rate is not supported.

        Raises:
            PortError: absent, busy or not permitted.
        """
        if baudrate not in MORE_RATES and self.getCFlagBaud(baudrate) <= 0:
            return False
        self.baudrate = baudrate
        return self.setupPort(baudrate)

    def setupPort(self, cflag_baud: int) -> bool:
        """Open at a baud rate.

        Raises:
            PortError: absent, busy or not permitted.
        """
        self.closePort()
        # A port that was open is found by its adaptor's serial number.
        lasting, name = self._lasting, str(self.port_name)
        if lasting is None:
            where = name
        elif os.path.exists(lasting):
            same = os.path.realpath(lasting) == os.path.realpath(self.port_name)
            where = name if same else lasting
        else:
            now = persistent_name(self.port_name, self._by_id)
            if now not in (None, lasting):
                raise PortError(
                    f"{self.port_name} is another adaptor now ({now}): plug in {lasting}"
                )
            where = name
        try:
            self.ser = Serial(where, cflag_baud, timeout=0, exclusive=self._exclusive or None)
        except (SerialException, OSError) as error:
            raise PortError(open_failure_text(self.port_name, error.errno)) from error
        except ValueError as error:  # pyserial: the adapter does not support this rate
            raise PortError(
                f"{self.port_name} cannot run at {cflag_baud} bit/s: choose 115200 or 1000000"
            ) from error
        self.opened_as = os.path.realpath(where) if where != self.port_name else where
        self._lasting = persistent_name(where, self._by_id) or self._lasting
        self._fd = self.ser.fileno()
        poll = select.poll()
        poll.register(self._fd, select.POLLIN)
        self._poll = poll.poll
        request_low_latency(self.ser)
        self.is_open = True
        self.is_using = False
        self.tx_time_per_byte = 1000.0 * BITS_PER_BYTE / cflag_baud
        return True

    def closePort(self) -> None:
        """Close; safe to call twice."""
        if self.ser is not None:
            self.ser.close()
        self.ser, self._fd, self._poll = None, -1, _raise_closed
        self.is_open = self.is_using = False

    def clearPort(self) -> None:
        """Discard received bytes."""
        try:
            termios.tcflush(self._fd, termios.TCIFLUSH)
        except (OSError, ValueError, termios.error) as error:
            raise self._lost(error) from error

    def getBytesAvailable(self) -> int:
        """Return the number of received bytes; 0 if the port is closed."""
        try:
            return self.ser.in_waiting if self.ser is not None else 0
        except OSError as error:
            raise self._lost(error) from error

    def readPort(self, length: int) -> bytes:
        """Return ``length`` bytes, or those that arrived before the packet's deadline."""
        return self.read_until(length, self._deadline_s)

    def writePort(self, packet: bytes | list[int]) -> int:
        """Send bytes; return their number."""
        self.write(bytes(packet))
        return len(packet)

    def setPacketTimeout(self, packet_length: int) -> None:
        """Set the packet's deadline from its length."""
        self.setPacketTimeoutMillis(self.tx_time_per_byte * packet_length + SDK_MARGIN_S * 1000.0)

    def setPacketTimeoutMillis(self, msec: float) -> None:
        """Set the packet's deadline."""
        self._deadline_s = time.monotonic() + msec / 1000.0

    def isPacketTimeout(self) -> bool:
        """Return whether the packet's deadline has passed."""
        return time.monotonic() >= self._deadline_s

    def getCurrentTime(self) -> float:
        """Return monotonic milliseconds."""
        return time.monotonic() * 1000.0


def _raise_closed(timeout_ms: int) -> object:
    raise ValueError("it is closed")


def request_low_latency(port: Any) -> None:
    """Request a latency of 1 ms instead of 16 ms from a USB adapter; others ignore it."""
    try:
        port.set_low_latency_mode(True)
    except (ValueError, OSError):
        # Only some drivers have the setting (a terminal returns ENOTTY). Without it the bus works,
        # but more slowly.
        return


WAIT_PIECE_S = 0.1


def wait_until(port: BusPort, until_s: float) -> None:
    """Wait and discard bytes that arrive meanwhile."""
    # Wait in pieces: each read is a heartbeat for the guardian that monitors this port.
    while (now_s := port.now_s()) < until_s:
        got = port.read_until(1, min(until_s, now_s + WAIT_PIECE_S))
        if not got and port.now_s() <= now_s:
            return  # an emulated port in simulated time, in which a wait takes no time


def port_at_path(
    path: str, exclusive: bool = True, on_traffic: Callable[[], None] | None = None
) -> BusPort:
    """Return the port at a path: an I2C bus of the kernel, or a serial port."""
    if is_i2c(path):
        from gazerig.drivers.i2c.port import I2cPort  # only Linux has such buses

        return I2cPort(path, exclusive, on_traffic)
    return BlockingPort(path, exclusive, on_traffic)
