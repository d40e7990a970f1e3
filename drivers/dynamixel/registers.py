"""Single registers of single servos through the SDK: for all that is not done every tick."""

from collections.abc import Sequence

from dynamixel_sdk import COMM_SUCCESS

from gazerig.drivers.dynamixel.control_table import REGISTERS
from gazerig.drivers.dynamixel.protocol import ALERT, ERROR_NUMBER, SyncWrite
from gazerig.drivers.dynamixel.sdk_handler import SdkPackets
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.family import Identity as Identity

TRIES = 3

LATE_S = 0.15
"""No answer is later than so long after waiting for it has ended."""

ROOM = 4096


class Registers:
    """Single registers by name; every exchange is tried three times.

    alerts: servos that have reported a latched hardware error
    refusal: error number of the newest refused exchange, 0 where the newest one was not refused
    """

    def __init__(self, port: BusPort, tries: int = TRIES) -> None:
        self._port = port
        self._tries = tries
        self._packets = SdkPackets()
        self._late_until_s: dict[int, float] = {}
        self.alerts: set[int] = set()
        self.refusal = 0

    def ping(self, servo_id: int) -> int | None:
        """Return the model number, None where nobody answers."""
        found = self.identify(servo_id)
        return None if found is None else found.model_number

    def identify(self, servo_id: int) -> Identity | None:
        """Return model number and firmware, None where nobody answers."""
        for _ in range(self._tries):
            number, firmware, result, error = self._packets.identify(self._port, servo_id)
            if self._good(servo_id, result, error):
                return Identity(number, firmware)
        return None

    def read(self, servo_id: int, name: str) -> int | None:
        """Return a register's value, None where no good answer came."""
        register = REGISTERS[name]
        data = self.read_bytes(servo_id, register.address, register.size)
        return None if data is None else int.from_bytes(data, "little", signed=register.signed)

    def read_bytes(self, servo_id: int, address: int, length: int) -> bytes | None:
        """Return bytes of the control table, None where no good answer came."""
        for _ in range(self._tries):
            self._let_late_ones_pass(servo_id)
            data, result, error = self._packets.readTxRx(self._port, servo_id, address, length)
            if self._good(servo_id, result, error):
                return bytes(data)
            if self.refusal:
                return None
        return None

    def write(self, servo_id: int, name: str, value: int) -> bool:
        """Write a register; tells whether the servo confirmed it."""
        register = REGISTERS[name]
        data = (value & (1 << 8 * register.size) - 1).to_bytes(register.size, "little")
        return self.write_bytes(servo_id, register.address, data)

    def write_bytes(self, servo_id: int, address: int, data: bytes) -> bool:
        """Write bytes of the control table; tells whether the servo confirmed it."""
        for _ in range(self._tries):
            self._let_late_ones_pass(servo_id)
            result, error = self._packets.writeTxRx(
                self._port, servo_id, address, len(data), list(data)
            )
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

    def _let_late_ones_pass(self, servo_id: int) -> None:
        """Wait until no answer to an earlier question can come any more.

        An answer does not say which register it is of.
        """
        until_s = self._late_until_s.pop(servo_id, None)
        if until_s is not None:
            while self._port.read_until(ROOM, until_s):
                pass

    def _good(self, servo_id: int, result: int, error: int) -> bool:
        self.refusal = 0
        if result != COMM_SUCCESS:
            self._late_until_s[servo_id] = self._port.now_s() + LATE_S
            self._port.drain()
            return False
        if error & ALERT:
            self.alerts.add(servo_id)
        self.refusal = error & ERROR_NUMBER
        return self.refusal == 0
