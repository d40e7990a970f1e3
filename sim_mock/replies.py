"""Instructions to emulated devices, and the timed pieces of bytes that carry their answers."""

from typing import NamedTuple

BROADCAST = 0xFE
NO_DEVICE = -1
"""Id of pieces that no servo sent: the host's echo, or a board's own answer."""


class Instruction(NamedTuple):
    """An instruction packet.

    params: without byte stuffing
    end: position of its last byte + 1, counted from the first byte of the newest piece
    """

    servo_id: int
    code: int
    params: bytes
    end: int


class Piece(NamedTuple):
    """Bytes that one servo sends without a pause, after its delays.

    end: position in the host's bytes after the instruction that they answer
    delay_s applies only on a line with wire time, late_s always.
    """

    servo_id: int
    data: bytes
    end: int = 0
    delay_s: float = 0.0
    late_s: float = 0.0


def merge(one: bytes, other: bytes) -> bytes:
    """Return the bytes of two servos that send simultaneously: a bit is 0 if either sends 0."""
    longer, shorter = (one, other) if len(one) >= len(other) else (other, one)
    return bytes(a & b for a, b in zip(longer, shorter, strict=False)) + longer[len(shorter) :]
