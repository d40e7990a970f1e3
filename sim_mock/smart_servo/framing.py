"""Framing of instructions in a stream of bytes that arrives in pieces."""

from abc import ABC, abstractmethod
from typing import NamedTuple

PING, READ, WRITE, REG_WRITE, ACTION, FACTORY_RESET, REBOOT = 1, 2, 3, 4, 5, 6, 8
SYNC_READ, SYNC_WRITE = 0x82, 0x83
"""Codes of the instructions that all makes have."""


class Instruction(NamedTuple):
    """A packet found.

    code: -1 where the check at its end is wrong; params: as they were meant
    end: position of its last byte + 1, counted from the first byte of the newest piece
    """

    servo_id: int
    code: int
    params: bytes
    end: int


class Framing(ABC):
    """Finds instructions in bytes that arrive in pieces.

    Args:
        gap_s: a packet that stays unfinished so long is dropped.
    """

    def __init__(self, gap_s: float, now_s: float) -> None:
        self.gap_s = gap_s
        self._unfinished = b""
        self._arrived_s = now_s

    def forget(self) -> None:
        """Drop an unfinished packet."""
        self._unfinished = b""

    def feed(self, data: bytes, now_s: float) -> list[Instruction]:
        """Return the instructions that bytes which arrive now complete."""
        before = 0
        if self._unfinished and now_s - self._arrived_s < self.gap_s:
            before = len(self._unfinished)
            data = self._unfinished + data
        self._arrived_s = now_s
        found, self._unfinished = self._search(data, before)
        return found

    @abstractmethod
    def _search(self, data: bytes, before: int) -> tuple[list[Instruction], bytes]:
        """Return the instructions in these bytes, and what may be the begin of another.

        before: so many of the bytes came in earlier pieces
        """
