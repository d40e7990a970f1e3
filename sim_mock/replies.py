"""Answers of emulated servos, and the timed pieces of bytes that carry them."""

from typing import NamedTuple

BROADCAST = 0xFE


class Answer(NamedTuple):
    """The answer of one servo.

    delay_s: its return delay; late_s: additional delay
    twin: the simultaneous answer of another servo with the same id
    """

    servo_id: int
    error: int
    params: bytes
    delay_s: float = 0.0
    late_s: float = 0.0
    twin: "Answer | None" = None


class Piece(NamedTuple):
    """Bytes that one servo sends without a pause, after its delays.

    delay_s applies only on a line with wire time, late_s always.
    """

    servo_id: int
    data: bytes
    delay_s: float = 0.0
    late_s: float = 0.0


def merge(one: bytes, other: bytes) -> bytes:
    """Return the bytes of two servos that send simultaneously: a bit is 0 if either sends 0."""
    longer, shorter = (one, other) if len(one) >= len(other) else (other, one)
    return bytes(a & b for a, b in zip(longer, shorter, strict=False)) + longer[len(shorter) :]
