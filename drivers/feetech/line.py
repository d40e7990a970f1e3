"""Exchanges on a bus of STS servos: the same waiting and counting, other packets."""

from collections.abc import Iterable, Sequence

from drivers.feetech.memory_table import REGISTERS
from drivers.feetech.protocol import (
    STATUS_OVERHEAD,
    bytes_missing,
    statuses,
    sync_read,
    sync_write,
)
from drivers.feetech.scan import everybody
from drivers.serial.port import BITS_PER_BYTE
from drivers.servo_bus.transaction import BusLine


class FeetechLine(BusLine):
    """A port with the patience of one bus; every method may raise drivers.errors.BusLost.

    What is asked and written here goes through sync read and sync write even for a single
    servo: an echo of such a question cannot be taken for its answer.
    """

    def ask(self, ids: Sequence[int], name: str) -> dict[int, int]:
        """Read one register of several servos; who is not in the answer did not answer well."""
        register = REGISTERS[name]
        found = self.ask_bytes(ids, register.address, register.size)
        return {servo_id: register.decode(data) for servo_id, data in found.items()}

    def _ask(self, ids: Sequence[int], address: int, length: int) -> dict[int, bytes]:
        nominal = len(ids) * (length + STATUS_OVERHEAD)
        self.port.clearPort()
        self.send(sync_read(ids, address, length))
        deadline_s = self._ends_s(nominal)
        found: dict[int, bytes] = {}

        def missing(raw: bytes) -> int:
            # An error bit says how the servo is, not that the answer is wrong.
            found.update(
                (s.id, s.params)
                for s in statuses(raw)
                if s.intact and s.id in ids and len(s.params) == length
            )
            others = sum(1 for s in statuses(raw) if s.id not in ids or len(s.params) != length)
            return bytes_missing(raw, len(ids) + others, length) if len(found) < len(ids) else 0

        self.complete(b"", missing, deadline_s)
        if len(found) < len(ids):
            self.drain()
        return found

    def answers(self, raw: bytes) -> int:
        """Count the answers among received bytes that are right by their check bytes."""
        return sum(status.intact for status in statuses(raw))

    def ping_all(self) -> dict[int, tuple[int, int]]:
        """Ask every id that there is, one after the other; gives (model number, firmware) by id."""
        found, _ = everybody(self.port, round(BITS_PER_BYTE / self._byte_s))
        return {one.id: (one.number, one.firmware) for one in found}

    def write_all(self, ids: Sequence[int], name: str, values: Iterable[int]) -> None:
        """Write one register of several servos; no servo confirms it."""
        register = REGISTERS[name]
        rows = [register.encode(value) for value in values]
        self.send(sync_write(ids, register.address, register.size, rows))
