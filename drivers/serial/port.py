"""Serial port of a servo bus: it waits in the kernel instead of spinning.

It owns the host clock of the servo bus (monotonic seconds).
"""

import os
import select
import time
from collections.abc import Callable
from contextlib import suppress
from typing import NamedTuple, Protocol

from serial import Serial, SerialException

from gazerig.drivers.errors import PortError
from gazerig.drivers.serial.host_port import HostPort
from gazerig.drivers.serial.list_ports import BY_ID, is_i2c, open_failure_text, persistent_name

BITS_PER_BYTE = 10

QUIET_S = 0.003
"""Time without a byte after which a line is quiet: three periods of a 1 ms latency timer."""

BABBLE_S = 0.06
"""Longest time to drain a line that never falls silent."""

WRITE_S = 0.05
"""Longest time to pass a packet to the adapter."""


class BusTiming(NamedTuple):
    """Times of a bus, seconds.

    reply_timeout_s: longest time-out of an answer, added to the transmission time of its bytes
    give_up_s: a run ends when the port, or all servos, have been lost for this long
    stagger_s: delay between the first pulses of one hobby servo and of the next; all at once could
        overload a weak power supply
    """

    reply_timeout_s: float = 0.02
    give_up_s: float = 60.0
    stagger_s: float = 0.1


TIMING = BusTiming()


class BusPort(Protocol):
    """Port interface of the drivers; what sends or reads raises BusLost if the port is lost."""

    port_name: str

    def now_s(self) -> float:
        """Return the time, seconds."""

    def setBaudRate(self, baudrate: int) -> bool:
        """Open at a baud rate; return False if the rate is not supported.

        Raises:
            PortError: absent, busy or not permitted.
        """

    def closePort(self) -> None:
        """Close; safe to call twice."""

    def write(self, data: bytes) -> None:
        """Send bytes."""

    def read_until(self, length: int, deadline_s: float) -> bytes:
        """Return up to ``length`` bytes, those received before the deadline."""

    def drain(self, quiet_s: float = QUIET_S) -> int:
        """Discard bytes until none arrives for ``quiet_s``; return their number."""


class BlockingPort(HostPort):
    """A real serial port; implements ``BusPort``.

    by_id: folder of persistent names of adaptors
    opened_as: the path that was opened last; an adaptor may reconnect under another name
    """

    by_id = BY_ID
    opened_as = ""
    _lasting: str | None = None
    _serial: Serial | None = None
    _fd, _poll = -1, select.poll()

    def write(self, data: bytes) -> None:
        """Send bytes; wait at most 50 ms for space in the adapter's buffer."""
        self._on_traffic()
        deadline_s = 0.0
        while data:
            try:
                data = data[os.write(self._fd, data) :]
            except BlockingIOError:
                # The buffer is full: wait for space.
                deadline_s = deadline_s or time.monotonic() + WRITE_S
                left_s = max(0.0, deadline_s - time.monotonic())
                if not select.select((), (self._fd,), (), left_s)[1]:
                    raise self._lost("it accepts no more bytes") from None
            except OSError as error:
                raise self._lost(error) from error

    def read_until(self, length: int, deadline_s: float) -> bytes:
        """Return up to ``length`` bytes, those received before the deadline.

        The last wait is rounded up to the milliseconds of poll(), which also finds the bytes that
        arrived while this process did not run.
        """
        self._on_traffic()
        got = b""
        while len(got) < length:
            left_s = deadline_s - time.monotonic()
            if self._fd >= 0 and not self._poll.poll(int(1e3 * left_s) + 1 if left_s > 0.0 else 0):
                break
            try:
                more = os.read(self._fd, length - len(got))
            except BlockingIOError:
                continue  # no bytes after all
            except OSError as error:
                raise self._lost(error) from error
            if not more:
                raise self._lost("it hung up")
            got = got + more if got else more
        if not got and not os.path.exists(self.opened_as):
            raise self._lost("it was unplugged")
        return got

    def drain(self, quiet_s: float = QUIET_S) -> int:
        """Discard bytes until none arrives for ``quiet_s``; return their number."""
        end_s, dropped = time.monotonic() + BABBLE_S, 0
        while (now_s := time.monotonic()) < end_s:
            more = self.read_until(1, now_s + quiet_s)
            if not more:
                break
            dropped += len(more) + len(self.read_until(4096, now_s))
        return dropped

    def setBaudRate(self, baudrate: int) -> bool:
        """Open at a baud rate; return False if the rate is not supported."""
        self.closePort()
        # Another adaptor may have the path of one that was unplugged.
        where = self._lasting or self.port_name
        try:
            self._serial = Serial(where, baudrate, timeout=0, exclusive=self._exclusive or None)
        except (SerialException, OSError) as error:
            raise PortError(open_failure_text(where, error.errno)) from error
        except ValueError:  # pyserial: the adapter does not support this rate
            return False
        self.opened_as = os.path.realpath(where) if where != self.port_name else where
        self._lasting = persistent_name(where, self.by_id) or self._lasting
        self._fd, self._poll = self._serial.fileno(), select.poll()
        self._poll.register(self._fd, select.POLLIN)
        # An adaptor's driver with a latency timer sets it to 1 ms instead of 16 ms; others refuse.
        with suppress(ValueError, OSError):
            self._serial.set_low_latency_mode(True)
        return True

    def closePort(self) -> None:
        """Close; safe to call twice."""
        if self._serial is not None:
            self._serial.close()
        self._serial, self._fd = None, -1


def open_port(port: BusPort, baud: int) -> None:
    """Open a port.

    Raises:
        PortError: it cannot be opened, or not at this baud rate.
    """
    if not port.setBaudRate(baud):
        raise PortError(f"{port.port_name} cannot run at {baud} bit/s: choose 115200 or 1000000")


def wait_until(port: BusPort, until_s: float) -> None:
    """Wait and discard bytes that arrive meanwhile."""
    # Wait in pieces: each read is a heartbeat for the guardian that monitors this port.
    while (now_s := port.now_s()) < until_s:
        got = port.read_until(1, min(until_s, now_s + 0.1))
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
