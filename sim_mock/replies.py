"""Answers of emulated servos, and the timed pieces of bytes they are sent as."""

from typing import NamedTuple

BROADCAST = 0xFE


class Answer(NamedTuple):
    """The answer of one servo.

    delay_s: its return delay; late_s: what it waits beyond that
    twin: the answer of another servo with the same id at the same time
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
    """Return the bytes of two servos that send at once: a bit is 0 where either sends 0."""
    longer, shorter = (one, other) if len(one) >= len(other) else (other, one)
    return bytes(a & b for a, b in zip(longer, shorter, strict=False)) + longer[len(shorter) :]
