"""Device side of Dynamixel Protocol 2.0: bytes in, bytes out, nothing opened.

Sources: ROBOTIS e-Manual, Protocol 2.0 and X series.
"""

import struct
from collections.abc import Sequence
from functools import lru_cache
from operator import itemgetter

from fastcrc.crc16 import umts

from gazerig.sim_mock.dynamixel.packets import CRC, HEAD, HEADER, STATUS, find_instructions, status
from gazerig.sim_mock.dynamixel.servo import INSTRUCTION_ERROR, DynamixelServo
from gazerig.sim_mock.replies import BROADCAST, Piece, merge
from gazerig.sim_mock.smart_servo.chain import Read, ServoChain, sync_reads
from gazerig.sim_mock.smart_servo.faults import commands_of

BULK_READ, BULK_WRITE = 0x92, 0x93
FAST_SYNC_READ, FAST_BULK_READ = 0x8A, 0x9A
"""Group reads with one answer of all servos."""

_ROW = struct.Struct("<BHH")
_SIZE = itemgetter(2)
_MARKS = [bytes((0, servo_id)) for servo_id in range(256)]
"""Error and id of a fast answer without an error."""


class DynamixelChain(ServoChain):
    """Dynamixel servos on one bus."""

    servo_type = DynamixelServo
    find_instructions = staticmethod(lru_cache(64)(find_instructions))
    status = staticmethod(status)
    span = struct.Struct("<HH")
    misunderstood = INSTRUCTION_ERROR, b""
    commands = commands_of(252)

    def _execute_group(self, code: int, params: bytes) -> list[Piece]:
        """Execute an instruction to all servos."""
        if code == FAST_SYNC_READ:
            return self._answer_fast(sync_reads(self.span, params))
        if code in (BULK_READ, FAST_BULK_READ) and len(params) % _ROW.size == 0:
            reads = [*_ROW.iter_unpack(params)]
            return self._answer_reads(reads) if code == BULK_READ else self._answer_fast(reads)
        if code == BULK_WRITE:
            at = 0
            while len(params) - at > _ROW.size:
                servo_id, address, length = _ROW.unpack_from(params, at)
                at += _ROW.size + length
                if at <= len(params):
                    row = bytes((servo_id,)) + params[at - length : at]
                    self._write_each(self.span.pack(address, length) + row)
            return []
        return super()._execute_group(code, params)

    def _answer_fast(self, reads: Sequence[Read]) -> list[Piece]:
        """Return one packet of all answers, in pieces if faults may affect it.

        A missing or cut block ends it; a refused read has zeros. The CRC of a block counts for the
        next piece, as its sender continues from it.
        """
        length = 1 + 4 * len(reads) + sum(map(_SIZE, reads))
        before, crc, pack = HEAD.pack(HEADER, BROADCAST, length, STATUS), 0, CRC.pack
        parts: list[bytes] = []
        wait_s, now_ms, fed_ms = 0.0, self._now_ms, self._fed_ms
        find, faults = self._by_id.get, self.faults
        faulty = faults.has_any
        for servo_id, address, size in reads:
            data = after = b""
            following = 0
            for servo in find(servo_id, ()):
                if not servo.advance(now_ms, fed_ms) or not servo.answers_fast:
                    continue
                error, said = servo.read(address, size)
                mark = _MARKS[servo_id]
                if error or servo.errors:
                    mark, said = bytes((error | servo.error_flag, servo_id)), said or bytes(size)
                own = before + mark + said
                following = umts(own, crc)
                end = pack(following)
                if data:  # of another servo with this id
                    own, end = merge(data, own), merge(after, end)
                    following = umts(own, crc)
                data, after = own, end
                if not parts:
                    wait_s = servo.delay_s
            if not data or (faulty and faults.use_fault("lose", servo_id)):
                break
            crc, before = following, after
            parts.append(data)
            if faulty and faults.is_on("truncate", servo_id):
                break
        if not parts:
            return []
        parts[-1] += before
        if not faulty:
            parts = [b"".join(parts)]
        first = Piece(reads[0][0], parts[0], self._end, wait_s)
        rest = zip(reads[1:], parts[1:], strict=False)
        return [first, *[Piece(read[0], part, self._end) for read, part in rest]]


build_dynamixel = DynamixelChain.build
