"""Single registers of single servos through the SDK: for all that is not done every tick."""

from collections.abc import Sequence
from typing import Any

from dynamixel_sdk import COMM_SUCCESS, PacketHandler

from drivers.dynamixel_packets import ALERT, ERROR_NUMBER, SyncWrite
from drivers.dynamixel_port import BusPort
from drivers.dynamixel_table import REGISTERS

TRIES = 3


class Registers:
    """Single registers by name; every exchange is tried three times."""

    def __init__(self, port: BusPort) -> None:
        self._port = port
        self._packets: Any = PacketHandler(2.0)
        self.alerts: set[int] = set()
        """Servos that have reported a latched hardware error."""

    def ping(self, servo_id: int) -> int | None:
        """Give the model number, None where nobody answers."""
        for _ in range(TRIES):
            number, result, error = self._packets.ping(self._port, servo_id)
            if self._good(servo_id, result, error):
                return int(number)
        return None

    def read(self, servo_id: int, name: str) -> int | None:
        """Give a register's value, None where no good answer came."""
        register = REGISTERS[name]
        read = getattr(self._packets, f"read{register.size}ByteTxRx")
        for _ in range(TRIES):
            try:
                value, result, error = read(self._port, servo_id, register.address)
            except IndexError:
                # SDK 4.1.0 looks for the data of a refused read, which has none.
                return None
            if self._good(servo_id, result, error):
                return _signed(value, register.size) if register.signed else int(value)
        return None

    def write(self, servo_id: int, name: str, value: int) -> bool:
        """Write a register; tells whether the servo confirmed it."""
        register = REGISTERS[name]
        write = getattr(self._packets, f"write{register.size}ByteTxRx")
        for _ in range(TRIES):
            result, error = write(self._port, servo_id, register.address, value)
            if self._good(servo_id, result, error):
                return True
        return False

    def write_all(self, ids: Sequence[int], name: str, value: int) -> None:
        """Write one value to a register of several servos at once, unconfirmed."""
        register = REGISTERS[name]
        write = SyncWrite(ids, register.address, register.size)
        self._port.write(write.packet([value] * len(ids)))

    def settle(self, servo_id: int, name: str, value: int) -> bool:
        """Write a register only where it differs; tells whether it now has the value."""
        return self.read(servo_id, name) == value or self.write(servo_id, name, value)

    def _good(self, servo_id: int, result: int, error: int) -> bool:
        if result != COMM_SUCCESS:
            # A late answer must not be taken for the next one.
            self._port.drain()
            return False
        if error & ALERT:
            self.alerts.add(servo_id)
        return error & ERROR_NUMBER == 0


def _signed(value: int, size: int) -> int:
    return int(value) - (1 << 8 * size) if value >> (8 * size - 1) else int(value)
