"""Packets of Feetech STS servos as they send them, and instructions in a stream of bytes.

An instruction is FF FF, id, length, instruction, parameters, checksum; a status has the error
byte in place of the instruction. The length is the number of parameters + 2, the checksum the
inverse of the sum of all bytes between header and checksum. There is no byte stuffing, so
parameters may contain a header. Signed numbers are sign and magnitude. Source: Feetech,
communication protocol of the STS/SMS series.
"""

from gazerig.sim_mock.replies import Instruction

HEADER = b"\xff\xff"
MOST_PARAMS = 253


def status(servo_id: int, error: int, params: bytes) -> bytes:
    """Build a status packet, of at most as many bytes as fit."""
    params = params[:MOST_PARAMS]
    body = bytes((servo_id, len(params) + 2, error)) + params
    return HEADER + body + bytes((~sum(body) & 0xFF,))


def signed(raw: int, bit: int) -> int:
    """Decode sign and magnitude; the sign is in ``bit``, the magnitude below it."""
    magnitude = raw & (1 << bit) - 1
    return -magnitude if raw >> bit & 1 else magnitude


def unsigned(value: int, bit: int) -> int:
    """Encode sign and magnitude; a magnitude that does not fit below ``bit`` is clipped."""
    largest = (1 << bit) - 1
    if value >= 0:
        return min(value, largest)
    return min(-value, largest) | 1 << bit


def find_instructions(data: bytes, before: int) -> tuple[list[Instruction], bytes]:
    """Return the instructions in these bytes, and the possible start of another.

    Packets with a wrong checksum are dropped silently.
    before: number of bytes that arrived in earlier pieces
    """
    found: list[Instruction] = []
    at = 0
    while True:
        at = data.find(HEADER, at)
        if at < 0:
            # The last byte may be the first byte of a header.
            return found, data[-1:] if data.endswith(HEADER[:1]) else b""
        head = data[at + 2 : at + 4]
        if head[:1] == b"\xff":
            at += 1
            continue
        end = at + 4 + head[1] if len(head) == 2 else len(data) + 1
        if len(head) == 2 and head[1] < 2:
            at += 2
        elif end > len(data):
            return found, data[at:]
        elif ~sum(data[at + 2 : end - 1]) & 0xFF != data[end - 1]:
            at += 2
        else:
            found.append(Instruction(head[0], data[at + 4], data[at + 5 : end - 1], end - before))
            at = end
