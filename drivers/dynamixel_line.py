"""Exchanges on the servo bus: bounded waiting, clean lines, counts, starvation noticed."""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from math import inf

from drivers.dynamixel_packets import (
    ERROR_NUMBER,
    STATUS_OVERHEAD,
    SyncWrite,
    bytes_missing,
    statuses,
    sync_read,
)
from drivers.dynamixel_port import BITS_PER_BYTE, BusPort
from drivers.dynamixel_table import REGISTERS


class Line:
    """A port with the patience of one bus; every method may raise drivers.errors.BusLost.

    tx_bytes, rx_bytes: counts since it was made
    errors: counts by kind
    starving_s: silence after which a servo's own watchdog trips; inf where none is armed
    starved: such a silence has happened
    """

    def __init__(self, port: BusPort, patience_s: float, baud: int) -> None:
        self.port = port
        self.tx_bytes = self.rx_bytes = 0
        self.errors: Counter[str] = Counter()
        self.starving_s = inf
        self.starved = False
        self._patience_s = patience_s
        self._byte_s = BITS_PER_BYTE / baud
        self._sent_s = port.now_s()

    def send(self, packet: bytes) -> float:
        """Send a packet; gives the time before it went out."""
        now_s = self.port.now_s()
        self.port.write(packet)
        # Up to after the write: the host may have been asleep just before the bytes left.
        if self.port.now_s() - self._sent_s >= self.starving_s:
            self.starved = True
        self._sent_s = now_s
        self.tx_bytes += len(packet)
        return now_s

    def exchange(self, request: bytes, length: int) -> tuple[bytes, float]:
        """Send a request and wait for ``length`` bytes; gives what came, and the deadline."""
        # What is here before the question cannot be its answer.
        self.port.clearPort()
        wire_s = (len(request) + length) * self._byte_s
        deadline_s = self.send(request) + self._patience_s + wire_s
        raw = self.port.read_until(length, deadline_s)
        self.rx_bytes += len(raw)
        return raw, deadline_s

    def complete(self, raw: bytes, missing: Callable[[bytes], int], deadline_s: float) -> bytes:
        """Wait on for an answer that has turned out to be longer than its shortest form."""
        while wanted := missing(raw):
            more = self.port.read_until(wanted, deadline_s)
            if not more:
                break
            self.rx_bytes += len(more)
            raw += more
        return raw

    def ask(self, ids: Sequence[int], name: str) -> dict[int, int]:
        """Read one register of several servos; who is not in the answer did not answer well.

        A silent servo silences those behind it, so the missing ones are asked once more alone.
        """
        values = self._ask(ids, name)
        if len(ids) > 1:
            for servo_id in ids:
                if servo_id not in values:
                    values.update(self._ask((servo_id,), name))
        return values

    def _ask(self, ids: Sequence[int], name: str) -> dict[int, int]:
        _, address, size, *_, signed = REGISTERS[name]
        raw, deadline_s = self.exchange(
            sync_read(ids, address, size), len(ids) * (size + STATUS_OVERHEAD)
        )
        raw = self.complete(raw, lambda r: bytes_missing(r, len(ids), size), deadline_s)
        values = {
            status.id: int.from_bytes(status.params, "little", signed=signed)
            for status in statuses(raw)
            if status.intact
            and status.id in ids
            and len(status.params) == size
            and not status.error & ERROR_NUMBER
        }
        if len(values) < len(ids):
            self.port.drain()
        return values

    def write_all(self, ids: Sequence[int], name: str, values: Iterable[int]) -> None:
        """Write one register of several servos; no servo confirms it."""
        register = REGISTERS[name]
        self.send(SyncWrite(ids, register.address, register.size).packet(tuple(values)))
