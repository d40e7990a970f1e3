"""An emulated I2C bus with the interface of smbus2: the same methods, errors and messages."""

import errno
import os
from collections.abc import Sequence
from typing import Any

from gazerig.sim_mock.pca9685.body import BusStuck, NotAcknowledged, Pca9685Body

READ_FLAG = 0x0001
LONGEST_BLOCK = 32


class EmulatedSMBus:
    """An open bus; errors are those of the kernel's drivers.

    Args:
        body: boards and servos.

    gone: whether the adapter was unplugged
    """

    def __init__(self, body: Pca9685Body) -> None:
        self._body = body
        self.fd: int | None = None
        self.gone = False

    def i2c_rdwr(self, *messages: Any) -> None:
        """Execute smbus2's messages as one transfer."""
        for message in messages:
            if message.flags & READ_FLAG:
                data = self._read(message.addr, message.len)
                for at, byte in enumerate(data):
                    message.buf[at] = bytes((byte,))
            else:
                self._write(message.addr, bytes(message))

    def write_byte_data(self, address: int, register: int, value: int) -> None:
        """Write one register."""
        self._write(address, bytes((register, value)))

    def read_byte_data(self, address: int, register: int) -> int:
        """Read one register."""
        self._write(address, bytes((register,)))
        return self._read(address, 1)[0]

    def write_i2c_block_data(self, address: int, register: int, data: Sequence[int]) -> None:
        """Write up to 32 bytes, starting at a register.

        Raises:
            ValueError: there are more than 32.
        """
        if len(data) > LONGEST_BLOCK:
            raise ValueError(f"a block holds {LONGEST_BLOCK} bytes at most, not {len(data)}")
        self._write(address, bytes((register, *data)))

    def read_i2c_block_data(self, address: int, register: int, length: int) -> list[int]:
        """Read up to 32 bytes, starting at a register.

        Raises:
            ValueError: more than 32 are requested.
        """
        if length > LONGEST_BLOCK:
            raise ValueError(f"a block holds {LONGEST_BLOCK} bytes at most, not {length}")
        self._write(address, bytes((register,)))
        return list(self._read(address, length))

    def close(self) -> None:
        """Close."""

    def _write(self, address: int, data: bytes) -> None:
        self._see()
        try:
            self._body.write(address, data)
        except (NotAcknowledged, BusStuck) as failed:
            raise _error(failed) from None

    def _read(self, address: int, length: int) -> bytes:
        self._see()
        try:
            return self._body.read(address, length)
        except (NotAcknowledged, BusStuck) as failed:
            raise _error(failed) from None

    def _see(self) -> None:
        if self.gone:
            raise OSError(errno.ENODEV, os.strerror(errno.ENODEV))


def _error(failed: Exception) -> OSError:
    code = errno.ETIMEDOUT if isinstance(failed, BusStuck) else errno.EREMOTEIO
    return OSError(code, os.strerror(code))
