"""Framing of instructions in a stream of bytes that arrives in pieces."""

from abc import ABC, abstractmethod
from typing import NamedTuple

PING, READ, WRITE, REG_WRITE, ACTION, FACTORY_RESET, REBOOT = 1, 2, 3, 4, 5, 6, 8
SYNC_READ, SYNC_WRITE = 0x82, 0x83
"""Codes of the instructions that are common to all makes."""


class Instruction(NamedTuple):
    """An instruction packet.

    code: -1 if its checksum is wrong; params: without byte stuffing
    end: position of its last byte + 1, counted from the first byte of the newest piece
    """

    servo_id: int
    code: int
    params: bytes
    end: int


_MAX_KNOWN = 64
_READS = frozenset((PING, READ, SYNC_READ, 0x8A))
"""Instructions that a control loop repeats byte for byte; 0x8A is Dynamixel's fast sync read."""


class Framing(ABC):
    """Finds instructions in bytes that arrive in pieces.

    Args:
        gap_s: time after which an unfinished packet is dropped, seconds.
    """

    def __init__(self, gap_s: float, now_s: float) -> None:
        self.gap_s = gap_s
        self._unfinished = b""
        self._arrived_s = now_s
        self._known: dict[bytes, list[Instruction]] = {}

    def forget(self) -> None:
        """Drop an unfinished packet, and the cached ones."""
        self._unfinished = b""
        self._known.clear()

    def feed(self, data: bytes, now_s: float) -> list[Instruction]:
        """Return the instructions that these bytes complete; they arrive now."""
        if not self._unfinished:
            self._arrived_s = now_s
            known = self._known.get(data)
            if known is not None:
                return known
            found, self._unfinished = self._search(data, 0)
            if len(found) == 1 and found[0].code in _READS and not self._unfinished:
                if len(self._known) >= _MAX_KNOWN:
                    self._known.clear()
                self._known[data] = found
            return found
        before = 0
        if now_s - self._arrived_s < self.gap_s:
            before = len(self._unfinished)
            data = self._unfinished + data
        self._arrived_s = now_s
        found, self._unfinished = self._search(data, before)
        return found

    @abstractmethod
    def _search(self, data: bytes, before: int) -> tuple[list[Instruction], bytes]:
        """Return the instructions in these bytes, and the possible start of another.

        before: number of bytes that arrived in earlier pieces
        """
