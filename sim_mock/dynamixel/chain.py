"""Device side of Dynamixel Protocol 2.0: bytes in, bytes out, nothing opened.

Sources: ROBOTIS e-Manual, Protocol 2.0 and X series.
"""

from collections.abc import Sequence
from functools import partial

from gazerig.drivers.dynamixel.control_table import EEPROM_END
from gazerig.sim_mock.dynamixel.instructions import (
    BULK_READ,
    BULK_WRITE,
    CRC_ERROR,
    FAST_BULK_READ,
    FAST_SYNC_READ,
    INSTRUCTIONS,
    bulk_rows,
    bulk_writes,
    obeys_broadcast,
    touches_eeprom,
)
from gazerig.sim_mock.dynamixel.packets import (
    HEADER,
    DynamixelFraming,
    fast_pieces,
    fast_reply,
    status,
)
from gazerig.sim_mock.dynamixel.servo import DynamixelQuirks, DynamixelServo
from gazerig.sim_mock.replies import Answer, Piece
from gazerig.sim_mock.smart_servo.chain import GroupAction, ServoChain, build_chain
from gazerig.sim_mock.smart_servo.faults import commands_of
from gazerig.sim_mock.smart_servo.framing import Instruction
from gazerig.sim_mock.smart_servo.instructions import GroupRead

MIN_WATCHDOG_MS = 20


class DynamixelChain(ServoChain[DynamixelServo, DynamixelQuirks]):
    """Dynamixel servos on one bus."""

    servo_type, quirks_type, framing_type = DynamixelServo, DynamixelQuirks, DynamixelFraming
    header, status, instructions = HEADER, staticmethod(status), INSTRUCTIONS
    commands = commands_of(252, DynamixelQuirks, reset="id 1, 57600 baud; needs torque off")
    eeprom_end = EEPROM_END
    _framing: DynamixelFraming
    _obeys_broadcast, _touches_eeprom = staticmethod(obeys_broadcast), staticmethod(touches_eeprom)

    def _apply_quirks(self, quirks: DynamixelQuirks) -> None:
        strict = quirks.stuffing == "strict"
        if strict != self._framing.strict:
            self._framing.forget()
            self._framing.strict = strict

    def _execute(self, instruction: Instruction) -> list[Piece]:
        """Trip expired bus watchdogs, reset the others, then execute the instruction."""
        if instruction.code < 0:
            return self._reject(instruction.servo_id)
        if self._now_ms - self._fed_ms >= MIN_WATCHDOG_MS:
            for servo in self.servos:
                servo.advance(self._now_ms, self._fed_ms)
        self._fed_ms = self._now_ms
        return super()._execute(instruction)

    def _reject(self, servo_id: int) -> list[Piece]:
        """Answer an instruction with a wrong CRC, depending on the quirks."""
        servo = self._by_id.get(servo_id)
        if servo is None or not servo.advance(self._now_ms, self._fed_ms):
            return []
        if self.quirks.bad_crc == "silent" or servo.status_level < 2:
            return []
        error = CRC_ERROR | servo.error_flag
        return self._out([Answer(servo_id, error, b"", self._delay_s[servo_id])])

    # --- groups

    def _group_instructions(self) -> dict[int, GroupAction]:
        rows = self.instructions.sync_rows
        return super()._group_instructions() | {
            FAST_SYNC_READ: lambda params: self._fast(rows(params)),
            BULK_READ: lambda params: self._answer_plain(bulk_rows(params)),
            FAST_BULK_READ: lambda params: self._fast(bulk_rows(params)),
            BULK_WRITE: lambda params: self._write_all(bulk_writes(params)),
        }

    def _fast(self, rows: Sequence[GroupRead]) -> list[Piece]:
        """Return one packet of all answers; a servo that refuses fills its block with zeros."""
        length = 1 + sum([4 + row[2] for row in rows])
        if not self._wire.any and not self._twins:
            packet = fast_reply(self._by_id, rows, length, self._now_ms, self._fed_ms)
            return [Piece(rows[0][0], packet, self._delay_s[rows[0][0]])] if packet else []
        answers: list[Answer] = []
        for servo_id, address, size in rows:
            servo = self._by_id.get(servo_id)
            answer = self._part(servo_id, address, size) if servo and servo.fast_reads else None
            if answer is None:
                break
            answers.append(answer if answer[2] else answer._replace(params=bytes(size)))
        spoilt = fast_pieces(self._wire.spoil_answers(answers, True, self._now_s), length)
        return self._wire.spoil_pieces(spoilt, True, self._now_s)


build_dynamixel = partial(build_chain, DynamixelChain)
