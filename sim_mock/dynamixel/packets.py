"""Packets of Protocol 2.0 in a stream of bytes: instructions found, answers built.

An instruction whose byte stuffing is missing is dropped.
"""

import struct

from fastcrc.crc16 import umts

from gazerig.sim_mock.replies import Instruction

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
    params = params.replace(RAW, STUFFED)
    packet = HEAD.pack(HEADER, servo_id, len(params) + 4, STATUS) + bytes((error,)) + params
    return packet + CRC.pack(umts(packet))


def find_instructions(data: bytes, before: int) -> tuple[list[Instruction], bytes]:
    """Return the instructions in these bytes, and the possible start of another.

    before: number of bytes that arrived in earlier pieces
    """
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
        packet = data[at:end]
        if at + SHORTEST <= end <= len(data) and umts(packet[:-2]) == CRC.unpack(packet[-2:])[0]:
            params = packet[8:-2]
            if RAW not in params.replace(STUFFED, b""):
                params = params.replace(STUFFED, RAW)
                found.append(Instruction(packet[4], packet[7], params, end - before))
            at = done = end
        else:
            at += len(HEADER)
    return found, data[done:]
