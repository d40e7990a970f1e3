"""Packets of Protocol 2.0 in a stream of bytes: instructions found, answers built.

The length frames an instruction, so an instruction without its byte stuffing is still
understood; ``strict`` servos drop it instead.
"""

import struct
from collections.abc import Iterable, Mapping, Sequence

from fastcrc.crc16 import umts

from gazerig.sim_mock.dynamixel.memory import ACCESS
from gazerig.sim_mock.dynamixel.servo import ALERT, DynamixelServo
from gazerig.sim_mock.replies import BROADCAST, Answer, Piece, merge
from gazerig.sim_mock.smart_servo.framing import Framing, Instruction

HEADER = b"\xff\xff\xfd\x00"
RAW, STUFFED = b"\xff\xff\xfd", b"\xff\xff\xfd\xfd"
STATUS = 0x55
SHORTEST = 10
LONGEST = 1024
"""Longest packet; a larger length is noise."""

HEAD = struct.Struct("<4sBHB")
CRC = struct.Struct("<H")


def status(servo_id: int, error: int, params: bytes) -> bytes:
    """Build a status packet."""
    if RAW in params:
        params = params.replace(RAW, STUFFED)
    packet = HEAD.pack(HEADER, servo_id, len(params) + 4, STATUS) + bytes((error,)) + params
    return packet + CRC.pack(umts(packet))


def fast_pieces(answers: Sequence[Answer], length: int) -> list[Piece]:
    """Send answers as blocks of one packet whose length field is ``length``.

    The first servo sends the head. A missing block ends the packet.
    """
    head = HEAD.pack(HEADER, BROADCAST, length, STATUS)
    crc = umts(head)
    pieces: list[Piece] = []
    for answer in answers:
        block = _block(answer, crc)
        crc = umts(block, crc)
        pieces.append(Piece(answer[0], head + block, 0.0 if pieces else answer[3], answer[4]))
        head = b""
    return pieces


def _block(answer: Answer, crc: int) -> bytes:
    """Build a servo's part of a fast reply after bytes whose CRC is ``crc``."""
    body = bytes((answer[1], answer[0])) + answer[2]
    block = body + CRC.pack(umts(body, crc))
    return block if answer[5] is None else merge(block, _block(answer[5], crc))


class DynamixelFraming(Framing):
    """Finds instructions; ``strict``: drop packets whose byte stuffing is missing."""

    strict = False

    def _search(self, data: bytes, before: int) -> tuple[list[Instruction], bytes]:
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
                if umts(packet[:-2]) == int.from_bytes(packet[-2:], "little"):
                    if not (self.strict and RAW in packet[7:-2].replace(STUFFED, b"")):
                        params = packet[8:-2].replace(STUFFED, RAW)
                        found.append(Instruction(packet[4], packet[7], params, end - before))
                    at = done = end
                    continue
                found.append(Instruction(packet[4], -1, b"", end - before))
            at += len(HEADER)
        return found, data[done:]


def fast_reply(
    servos: Mapping[int, DynamixelServo],
    rows: Iterable[tuple[int, int, int]],
    length: int,
    now_ms: int,
    fed_ms: int,
) -> bytes:
    """Return the packet up to the first silent servo; empty if that is the first one."""
    parts = list[bytes]()
    before, crc, pack = HEAD.pack(HEADER, BROADCAST, length, STATUS), 0, CRC.pack
    for row in rows:
        servo_id = row[0]
        servo = servos.get(servo_id)
        if servo is None or not servo.advance(now_ms, fed_ms):
            break
        if not servo.fast_reads or servo.status_level < 1:
            break
        error = ALERT if servo.errors else 0
        window = servo.memory.windows.get(row)
        if window is None or (servo.stale_surroundings and window[3]):
            window = servo.window(row)
        if window is not None:
            layout, ahead, behind, _ = window
            amps, speed, at = servo.drive.sensed(now_ms)
            block = before + layout.pack(error, servo_id, ahead, amps, speed, at, behind)
        else:
            data = servo.read(row[1], row[2])
            if data is None:
                data, error = bytes(row[2]), error | ACCESS
            block = before + bytes((error, servo_id)) + data
        crc = umts(block, crc)
        parts.append(block)
        before = pack(crc)
    if not parts:
        return b""
    parts.append(before)
    return b"".join(parts)
