"""Single registers of single STS servos: for all that is not done every tick."""

from collections.abc import Sequence

from gazerig.drivers.feetech.memory_table import REGISTERS, Register
from gazerig.drivers.feetech.protocol import (
    PING,
    STATUS_OVERHEAD,
    bytes_missing,
    instruction,
    read,
    statuses,
    sync_write,
    write,
)
from gazerig.drivers.feetech.scan import FACTORY_BAUD, IDENTITY_LENGTH, REPLY_S
from gazerig.drivers.serial.port import BITS_PER_BYTE, BusPort
from gazerig.drivers.servo_bus.family import Identity as Identity
from gazerig.drivers.servo_bus.family import Status

TRIES = 3

LATE_S = 0.15
"""No answer is later than so long after waiting for it has ended."""

ROOM = 4096
LONGEST = 1024
"""A line that babbles is not listened to for longer than so many bytes."""


class StsRegisters:
    """Single registers by name; every exchange is tried three times.

    error: error bits of the newest answer; data and orders are good all the same
    refusal: always 0: an STS refuses by silence
    """

    refusal = 0

    def __init__(self, port: BusPort, tries: int = TRIES) -> None:
        self._port = port
        self._tries = tries
        self._late_until_s: dict[int, float] = {}
        self.error = 0

    def ping(self, servo_id: int) -> bool:
        """Return whether a servo is there.

        With an adapter that echoes only ``identify`` can tell.
        """
        return self._exchange(servo_id, instruction(servo_id, PING), 0) is not None

    def identify(self, servo_id: int) -> Identity | None:
        """Return model number and firmware, None where nobody answers."""
        data = self.read_bytes(servo_id, 0, IDENTITY_LENGTH)
        return None if data is None else Identity(data[3] | data[4] << 8, 100 * data[0] + data[1])

    def read(self, servo_id: int, name: str) -> int | None:
        """Return a register's value, None where no good answer came."""
        register = REGISTERS[name]
        data = self.read_bytes(servo_id, register.address, register.size)
        return None if data is None else register.decode(data)

    def read_bytes(self, servo_id: int, address: int, length: int) -> bytes | None:
        """Return bytes of the control table, None where no good answer came."""
        # The echo of a question has two params: an answer of two is asked for as three.
        asked = 3 if length == 2 else length
        status = self._exchange(servo_id, read(servo_id, address, asked), asked)
        return None if status is None else status.params[:length]

    def write(self, servo_id: int, name: str, value: int) -> bool:
        """Write a register; tells whether the servo confirmed it."""
        register = REGISTERS[name]
        return self.write_bytes(servo_id, register.address, register.encode(value))

    def write_bytes(self, servo_id: int, address: int, data: bytes) -> bool:
        """Write bytes of the control table; tells whether the servo confirmed it."""
        return self._exchange(servo_id, write(servo_id, address, data), 0) is not None

    def keep(self, servo_id: int, name: str, value: int) -> bool:
        """Write a register of the EEPROM so that it outlives the power; tells whether it has it.

        The lock (55) is opened for it and closed again.
        """
        if not self.write(servo_id, "lock", 0):
            return False
        written = self.write(servo_id, name, value)
        return self.write(servo_id, "lock", 1) and written and self.read(servo_id, name) == value

    def write_all(self, ids: Sequence[int], name: str, value: int) -> None:
        """Write one value to a register of several servos at once, unconfirmed."""
        register: Register = REGISTERS[name]
        data = register.encode(value)
        self._port.write(sync_write(ids, register.address, register.size, [data] * len(ids)))

    def settle(self, servo_id: int, name: str, value: int) -> bool:
        """Write a register only where it differs; tells whether it now has the value."""
        return self.read(servo_id, name) == value or self.write(servo_id, name, value)

    def _exchange(self, servo_id: int, request: bytes, length: int) -> Status | None:
        """Send a request until a whole status of that length comes from that servo."""
        for _ in range(self._tries):
            self._let_late_ones_pass(servo_id)
            status = self._once(servo_id, request, length)
            if status is not None:
                self.error = status.error
                return status
            self._late_until_s[servo_id] = self._port.now_s() + LATE_S
            self._port.drain()
        return None

    def _once(self, servo_id: int, request: bytes, length: int) -> Status | None:
        port = self._port
        port.clearPort()
        port.write(request)
        byte_s = BITS_PER_BYTE / float(getattr(port, "baudrate", FACTORY_BAUD))
        wire_s = (len(request) + length + STATUS_OVERHEAD) * byte_s
        deadline_s, raw, seen = port.now_s() + wire_s + REPLY_S, b"", 0
        while len(raw) < LONGEST:
            more = port.read_until(bytes_missing(raw, seen + 1, length) or 1, deadline_s)
            raw += more
            found = statuses(raw)
            seen = len(found)
            for status in found:
                if status.intact and status.id == servo_id and len(status.params) == length:
                    return status
            if not more:
                break
        return None

    def _let_late_ones_pass(self, servo_id: int) -> None:
        """Wait until no answer to an earlier question can come any more.

        An answer does not say which register it is of.
        """
        until_s = self._late_until_s.pop(servo_id, None)
        if until_s is not None:
            while self._port.read_until(ROOM, until_s):
                pass
