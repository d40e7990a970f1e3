"""Packets of the Feetech STS servos as they send them, and as they look for them on the line.

An instruction is FF FF, id, length, instruction, parameters, checksum; a status has the error
byte in the place of the instruction. The length counts parameters + 2, the checksum is the
inverse of the sum of all between header and itself. Nothing is stuffed, so a header may stand
among parameters. Numbers with a sign are sign and magnitude. Source: Feetech, communication
protocol of the STS/SMS series.
"""

from collections.abc import Sequence
from typing import NamedTuple

from sim_mock.replies import Answer, Piece, merge

HEADER = b"\xff\xff"
BROADCAST = 0xFE
SHORTEST = 6


class Instruction(NamedTuple):
    """A packet found.

    end: place of its last byte + 1, counted from the first byte of the newest piece
    """

    servo_id: int
    code: int
    params: bytes
    end: int


def checksum(body: bytes) -> int:
    """Give the checksum of all between header and checksum."""
    return ~sum(body) & 0xFF


def status(servo_id: int, error: int, params: bytes) -> bytes:
    """Build a status packet."""
    body = bytes((servo_id, (len(params) + 2) & 0xFF, error)) + params
    return HEADER + body + bytes((checksum(body),))


def pieces(answers: Sequence[Answer]) -> list[Piece]:
    """Send each answer as a status of its own."""
    return [Piece(a.servo_id, _mixed(a), a.delay_s, a.late_s) for a in answers]


def _mixed(answer: Answer) -> bytes:
    """Build the status of servos that answer under one id at the same time."""
    own = status(answer.servo_id, answer.error, answer.params)
    return own if answer.twin is None else merge(own, _mixed(answer.twin))


def signed(raw: int, bit: int) -> int:
    """Read sign and magnitude; the sign stands in ``bit``, the magnitude below it."""
    magnitude = raw & (1 << bit) - 1
    return -magnitude if raw >> bit & 1 else magnitude


def unsigned(value: int, bit: int) -> int:
    """Write sign and magnitude; what does not fit below ``bit`` becomes the largest that does."""
    magnitude = min(abs(value), (1 << bit) - 1)
    return magnitude | 1 << bit if value < 0 else magnitude


class Framing:
    """Bytes in, instructions out; what has a wrong checksum is passed over in silence.

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
        """Take bytes that arrive now and give the instructions they complete."""
        before = 0
        if self._unfinished and now_s - self._arrived_s < self.gap_s:
            before = len(self._unfinished)
            data = self._unfinished + data
        self._unfinished = b""
        self._arrived_s = now_s
        found: list[Instruction] = []
        at = 0
        while True:
            at = data.find(HEADER, at)
            if at < 0:
                # The first byte of a header may be the last one that came.
                self._unfinished = data[-1:] if data.endswith(HEADER[:1]) else b""
                return found
            head = data[at + 2 : at + 4]
            if head[:1] == b"\xff":
                at += 1
                continue
            end = at + 4 + head[1] if len(head) == 2 else len(data) + 1
            if len(head) == 2 and head[1] < 2:
                at += 2
            elif end > len(data):
                self._unfinished = data[at:]
                return found
            elif checksum(data[at + 2 : end - 1]) != data[end - 1]:
                at += 2
            else:
                params = data[at + 5 : end - 1]
                found.append(Instruction(head[0], data[at + 4], params, end - before))
                at = end
