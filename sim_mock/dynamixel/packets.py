"""Packets of Dynamixel Protocol 2.0 as servos send them, and constants to find them on the line.

Source: ROBOTIS e-Manual, Protocol 2.0. Fast replies are one packet of blocks that several
servos send one after another; each block ends with the CRC over all bytes before it.
"""

import struct
from collections.abc import Sequence

from fastcrc.crc16 import umts

from gazerig.sim_mock.replies import BROADCAST, Answer, Piece, merge

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
