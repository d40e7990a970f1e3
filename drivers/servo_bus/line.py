"""Exchanges with Dynamixel servos that stand beside the cyclic one."""

from collections.abc import Iterable, Sequence

from drivers.dynamixel.control_table import REGISTERS
from drivers.dynamixel.protocol import (
    BROADCAST,
    ERROR_NUMBER,
    PING,
    STATUS_OVERHEAD,
    SyncWrite,
    bytes_missing,
    instruction,
    statuses,
    sync_read,
)
from drivers.servo_bus.transaction import BusLine

PING_QUIET_S = 0.04
"""All who will answer a ping to everybody have done so when nothing came for so long."""

PING_MOST_S = 0.8
"""The SDK waits so long for them; nobody answers later."""

_ROOM = 4096


class Line(BusLine):
    """A port with the patience of one bus; every method may raise drivers.errors.BusLost."""

    def ask(self, ids: Sequence[int], name: str) -> dict[int, int]:
        """Read one register of several servos; who is not in the answer did not answer well."""
        register = REGISTERS[name]
        return {
            servo_id: int.from_bytes(data, "little", signed=register.signed)
            for servo_id, data in self.ask_bytes(ids, register.address, register.size).items()
        }

    def _ask(self, ids: Sequence[int], address: int, length: int) -> dict[int, bytes]:
        port, nominal = self.port, len(ids) * (length + STATUS_OVERHEAD)
        port.clearPort()
        self.send(sync_read(ids, address, length))
        deadline_s = self._ends_s(nominal)
        raw = self.complete(b"", lambda r: bytes_missing(r, len(ids), length), deadline_s)
        values = {
            status.id: status.params
            for status in statuses(raw)
            if status.intact
            and status.id in ids
            and len(status.params) == length
            and not status.error & ERROR_NUMBER
        }
        if len(values) < len(ids):
            self.drain()
        return values

    def answers(self, raw: bytes) -> int:
        """Count the answers among received bytes that are right by their check bytes."""
        return sum(status.intact for status in statuses(raw))

    def ping_all(self) -> dict[int, tuple[int, int]]:
        """Ask everybody who is there; gives (model number, firmware) by id."""
        port = self.port
        port.clearPort()
        self.send(instruction(BROADCAST, PING))
        end_s = port.now_s() + PING_MOST_S
        raw = b""
        while port.now_s() < end_s:
            more = port.read_until(_ROOM, port.now_s() + PING_QUIET_S)
            raw += more
            if not more or len(raw) >= 4 * _ROOM:
                break
        self.rx_bytes += len(raw)
        return {
            status.id: (status.params[0] | status.params[1] << 8, status.params[2])
            for status in statuses(raw)
            if status.intact and len(status.params) == 3
        }

    def write_all(self, ids: Sequence[int], name: str, values: Iterable[int]) -> None:
        """Write one register of several servos; no servo confirms it."""
        register = REGISTERS[name]
        self.send(SyncWrite(ids, register.address, register.size).packet(tuple(values)))
