"""Framing of Protocol 2.0 instructions in a stream of bytes.

The length frames an instruction, so an instruction without its byte stuffing is still
understood; ``strict`` servos drop it instead.
"""

from fastcrc.crc16 import umts

from gazerig.sim_mock.dynamixel.packets import HEADER, LONGEST, RAW, SHORTEST, STUFFED
from gazerig.sim_mock.smart_servo.framing import Framing, Instruction


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
