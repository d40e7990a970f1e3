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
    GroupRead,
    ServoChain,
    build_chain,
    sync_rows,
)
from gazerig.sim_mock.smart_servo.faults import commands_of

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
            return self._answer_fast(sync_rows(self.span, params))
        if code in (BULK_READ, FAST_BULK_READ) and len(params) % _ROW.size == 0:
            rows = tuple(_ROW.iter_unpack(params))
            return self._answer_rows(rows) if code == BULK_READ else self._answer_fast(rows)
        if code == BULK_WRITE:
            at = 0
            while len(params) - at > _ROW.size:
                servo_id, address, length = _ROW.unpack_from(params, at)
                at += _ROW.size + length
                if at <= len(params):
                    self._write_part(servo_id, address, params[at - length : at])
            return []
        return super()._execute_group(code, params)

    def _answer_fast(self, rows: Sequence[GroupRead]) -> list[Piece]:
        """Return one packet of all answers; a missing block ends it."""
        head = HEAD.pack(HEADER, BROADCAST, 1 + sum([4 + row[2] for row in rows]), STATUS)
        if self._wire.has_any or self._twins:
            return self._answer_blocks(rows, head)
        servos, pack, crc, before, parts = self._by_id, CRC.pack, 0, head, list[bytes]()
        for servo_id, address, size in rows:
            servo = servos.get(servo_id)
            block = b"" if servo is None else self._block(servo, servo_id, address, size)
            if not block:
                break
            part = before + block
            crc = umts(part, crc)
            parts.append(part)
            before = pack(crc)
        if not parts:
            return []
        return [Piece(rows[0][0], b"".join(parts) + before, servos[rows[0][0]].delay_s)]

    def _answer_blocks(self, rows: Sequence[GroupRead], head: bytes) -> list[Piece]:
        """Return the same packet in pieces that a fault can change."""
        pieces, crc, pack = list[Piece](), umts(head), CRC.pack
        for servo_id, address, size in rows:
            servo = self._by_id.get(servo_id)
            block = b"" if servo is None else self._block(servo, servo_id, address, size)
            if servo is None or not block or self._is_muted(servo_id):
                break
            start, block = crc, block + pack(umts(block, crc))
            for twin in self._twins.get(servo_id, ()):
                other = self._block(twin, servo_id, address, size)
                block = merge(block, other + pack(umts(other, start)))
            crc = umts(block, start)
            delay_s = 0.0 if pieces else servo.delay_s
            pieces.append(Piece(servo_id, block if pieces else head + block, delay_s))
        return pieces

    def _block(self, servo: DynamixelServo, servo_id: int, address: int, size: int) -> bytes:
        """Return a servo's part of a fast read; it fills the part of a refused read with zeros."""
        if not servo.advance(self._now_ms, self._fed_ms):
            return b""
        if not servo.fast_reads or not servo.answers_groups:
            return b""
        data, error = servo.read(address, size), servo.error_flag
        if data is None:
            data, error = bytes(size), error | ACCESS
        return bytes((error, servo_id)) + data


build_dynamixel = partial(build_chain, DynamixelChain)
