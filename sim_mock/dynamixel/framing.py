"""How servos find instructions in a stream of bytes.

An instruction is framed by its length, so one whose parameters should have been stuffed
and were not is still understood; ``strict`` servos drop it instead.
"""

from typing import NamedTuple

from fastcrc.crc16 import umts

from sim_mock.replies import HEADER, LONGEST, RAW, SHORTEST, STUFFED


class Instruction(NamedTuple):
    """A packet found.

    code: -1 where the CRC is wrong; params: without stuffing
    end: place of its last byte + 1, counted from the first byte of the newest piece
    """

    servo_id: int
    code: int
    params: bytes
    end: int


class Framing:
    """Bytes in, instructions out.

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

    def feed(self, data: bytes, now_s: float, strict: bool = False) -> list[Instruction]:
        """Take bytes that arrive now and give the instructions they complete."""
        before = 0
        if self._unfinished:
            if now_s - self._arrived_s < self.gap_s:
                before = len(self._unfinished)
                data = self._unfinished + data
            self._unfinished = b""
        self._arrived_s = now_s
        found: list[Instruction] = []
        at = done = 0
        while done < len(data):
            at = data.find(HEADER, at)
            if at < 0:
                done = max(done, len(data) - len(HEADER) + 1)
                break
            end = at + 7 + int.from_bytes(data[at + 5 : at + 7], "little")
            if len(data) - at < SHORTEST or len(data) < end <= at + LONGEST:
                done = at
                break
            if at + SHORTEST <= end <= len(data):
                packet = data[at:end]
                if _intact(packet):
                    if not (strict and _unstuffed(packet)):
                        params = packet[8:-2].replace(STUFFED, RAW)
                        found.append(Instruction(packet[4], packet[7], params, end - before))
                    at = done = end
                    continue
                found.append(Instruction(packet[4], -1, b"", end - before))
            at += len(HEADER)
        self._unfinished = data[done:]
        return found


def _intact(packet: bytes) -> bool:
    return umts(packet[:-2]) == int.from_bytes(packet[-2:], "little")


def _unstuffed(packet: bytes) -> bool:
    """Tell whether a header stands among the parameters."""
    return RAW in packet[7:-2].replace(STUFFED, b"")
