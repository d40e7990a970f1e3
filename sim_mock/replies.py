"""What emulated servos say: one answer each, and the pieces of bytes that put it on the line."""

from typing import NamedTuple

BROADCAST = 0xFE


class Answer(NamedTuple):
    """What one servo has to say.

    delay_s: its return delay; late_s: what it waits beyond that
    twin: what another servo with the same id says at the same time
    """

    servo_id: int
    error: int
    params: bytes
    delay_s: float = 0.0
    late_s: float = 0.0
    twin: "Answer | None" = None


class Piece(NamedTuple):
    """Bytes that one servo puts on the line in one go, after waiting.

    delay_s counts on a line with wire time only, late_s always.
    """

    servo_id: int
    data: bytes
    delay_s: float = 0.0
    late_s: float = 0.0


def merge(one: bytes, other: bytes) -> bytes:
    """Mix what two servos send at once: the line is low where either pulls it low."""
    longer, shorter = (one, other) if len(one) >= len(other) else (other, one)
    return bytes(a & b for a, b in zip(longer, shorter, strict=False)) + longer[len(shorter) :]
