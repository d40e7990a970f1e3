"""Device side of Dynamixel Protocol 2.0: bytes in, bytes out, nothing opened.

Sources: ROBOTIS e-Manual, Protocol 2.0 and X series.
"""

import struct
from collections.abc import Sequence
from functools import partial

from fastcrc.crc16 import umts

from gazerig.sim_mock.dynamixel.packets import (
    CRC,
    HEAD,
    HEADER,
    STATUS,
    find_instructions,
    status,
)
from gazerig.sim_mock.dynamixel.servo import ACCESS, INSTRUCTION_ERROR, DynamixelServo
from gazerig.sim_mock.replies import BROADCAST, Instruction, Piece, merge
from gazerig.sim_mock.smart_servo.chain import (
    FAST_BULK_READ,
    FAST_SYNC_READ,
    ServoChain,
    build_chain,
)
from gazerig.sim_mock.smart_servo.faults import commands_of
from gazerig.sim_mock.smart_servo.servo import READ

BULK_READ, BULK_WRITE = 0x92, 0x93
MIN_WATCHDOG_MS = 20

_ROW = struct.Struct("<BHH")


class DynamixelChain(ServoChain[DynamixelServo]):
    """Dynamixel servos on one bus."""

    servo_type = DynamixelServo
    find_instructions, status = staticmethod(find_instructions), staticmethod(status)
    span = struct.Struct("<HH")
    misunderstood = INSTRUCTION_ERROR, b""
    commands = commands_of(252, "id 1, 57600 baud")

    def _execute(self, instruction: Instruction) -> list[Piece]:
        """Trip expired bus watchdogs, reset the others, then execute the instruction."""
        if self._now_ms - self._fed_ms >= MIN_WATCHDOG_MS:
            for servo in self.servos:
                servo.advance(self._now_ms, self._fed_ms)
        self._fed_ms = self._now_ms
        return super()._execute(instruction)

    def _execute_group(self, code: int, params: bytes) -> list[Piece]:
        """Execute an instruction to all servos."""
        if code == FAST_SYNC_READ:
            if len(params) <= self.span.size:
                return []
            address, size = self.span.unpack_from(params)
            return self._answer_fast([(one, address, size) for one in params[self.span.size :]])
        if code in (BULK_READ, FAST_BULK_READ) and len(params) % _ROW.size == 0:
            if code == FAST_BULK_READ:
                return self._answer_fast([*_ROW.iter_unpack(params)])
            starts = range(0, len(params), _ROW.size)
            return self._answer_reads([(params[at], params[at + 1 : at + 5]) for at in starts])
        if code == BULK_WRITE:
            at = 0
            while len(params) - at > _ROW.size:
                servo_id, address, length = _ROW.unpack_from(params, at)
                at += _ROW.size + length
                if at <= len(params):
                    self._write_part(servo_id, address, params[at - length : at])
            return []
        return super()._execute_group(code, params)

    def _answer_fast(self, reads: Sequence[tuple[int, int, int]]) -> list[Piece]:
        """Return one packet of all answers in their pieces; a missing block ends it.

        The CRC of a block counts for the next piece, as its sender continues from it.
        """
        length = 1 + sum([4 + read[2] for read in reads])
        before, crc, pack = HEAD.pack(HEADER, BROADCAST, length, STATUS), 0, CRC.pack
        pieces, faulty = list[Piece](), self._wire.has_any
        for servo_id, address, size in reads:
            data, after, following, delay_s = b"", b"", 0, 0.0
            for servo in self._by_id.get(servo_id, ()):
                block = self._block(servo, servo_id, address, size)
                if block:
                    own = before + block
                    following, delay_s = umts(own, crc), servo.delay_s
                    end = pack(following)
                    if data:  # of another servo with this id
                        own, end = merge(data, own), merge(after, end)
                        following = umts(own, crc)
                    data, after = own, end
            if not data or (faulty and self._is_muted(servo_id)):
                break
            crc = following
            pieces.append(Piece(servo_id, data, 0.0 if pieces else delay_s))
            before = after
        if pieces:
            pieces[-1] = pieces[-1]._replace(data=pieces[-1].data + before)
        return pieces

    def _block(self, servo: DynamixelServo, servo_id: int, address: int, size: int) -> bytes:
        """Return a servo's part of a fast read; it fills the part of a refused read with zeros."""
        if not servo.advance(self._now_ms, self._fed_ms):
            return b""
        if not servo.fast_reads or not servo.answers_instruction(READ):
            return b""
        data, error = servo.read(address, size), servo.error_flag
        if data is None:
            data, error = bytes(size), error | ACCESS
        return bytes((error, servo_id)) + data


build_dynamixel = partial(build_chain, DynamixelChain)
