"""Packets of Feetech STS servos as they send them, and constants to find them on the line.

An instruction is FF FF, id, length, instruction, parameters, checksum; a status has the error
byte in place of the instruction. The length is the number of parameters + 2, the checksum the
inverse of the sum of all bytes between header and checksum. There is no byte stuffing, so
parameters may contain a header. Signed numbers are sign and magnitude. Source: Feetech,
communication protocol of the STS/SMS series.
"""

from gazerig.sim_mock.smart_servo.framing import Framing, Instruction

HEADER = b"\xff\xff"
BYTES = tuple(bytes((i,)) for i in range(256))
SHORTEST = 6


def checksum(body: bytes) -> int:
    """Return the checksum of all bytes between header and checksum."""
    return ~sum(body) & 0xFF


def status(servo_id: int, error: int, params: bytes) -> bytes:
    """Build a status packet."""
    body = bytes((servo_id, (len(params) + 2) & 0xFF, error)) + params
    return HEADER + body + BYTES[~sum(body) & 0xFF]


def signed(raw: int, bit: int) -> int:
    """Decode sign and magnitude; the sign is in ``bit``, the magnitude below it."""
    magnitude = raw & (1 << bit) - 1
    return -magnitude if raw >> bit & 1 else magnitude


def unsigned(value: int, bit: int) -> int:
    """Encode sign and magnitude; a magnitude that does not fit below ``bit`` is clipped."""
    largest = (1 << bit) - 1
    if value >= 0:
        return value if value <= largest else largest
    return (-value if -value <= largest else largest) | 1 << bit


class FeetechFraming(Framing):
    """Finds instructions; packets with a wrong checksum are dropped silently."""

    def _search(self, data: bytes, before: int) -> tuple[list[Instruction], bytes]:
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
            elif checksum(data[at + 2 : end - 1]) != data[end - 1]:
                at += 2
            else:
                params = data[at + 5 : end - 1]
                found.append(Instruction(head[0], data[at + 4], params, end - before))
                at = end
