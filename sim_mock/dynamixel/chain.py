"""Device side of Dynamixel Protocol 2.0: bytes in, bytes out, nothing opened.

Sources: ROBOTIS e-Manual, Protocol 2.0 and X series.
"""

import struct
from collections.abc import Sequence
from functools import partial

from gazerig.drivers.dynamixel.control_table import EEPROM_END
from gazerig.sim_mock.dynamixel.memory import DATA_RANGE, INSTRUCTION_ERROR
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
from gazerig.sim_mock.smart_servo.framing import (
    ACTION,
    FACTORY_RESET,
    REG_WRITE,
    WRITE,
    Instruction,
)
from gazerig.sim_mock.smart_servo.instructions import GroupRead, GroupWrite, InstructionSet, Result

CLEAR, BACKUP = 0x10, 0x20
FAST_SYNC_READ, BULK_READ, BULK_WRITE, FAST_BULK_READ = 0x8A, 0x92, 0x93, 0x9A

CRC_ERROR = 3
CLEAR_TURNS = b"\x01\x44\x58\x4c\x22"
BACKUP_KEY = b"CTRL"
STORE, RESTORE = 1, 2
RESET_ALL = b"\xff"
NO_BROADCAST_RESET_SINCE = 42
"""First firmware that ignores a broadcast reset of everything."""

_ROW = struct.Struct("<BHH")


def touches_eeprom(code: int, params: bytes) -> bool:
    """Return whether an instruction may change id, baud rate, return delay or secondary id."""
    if code in (WRITE, REG_WRITE):
        return INSTRUCTIONS.address_of(params) < EEPROM_END
    return code in (ACTION, FACTORY_RESET, BACKUP)


def obeys_broadcast(servo: DynamixelServo, code: int, params: bytes) -> bool:
    """Return whether a servo executes a broadcast instruction."""
    reset = code == FACTORY_RESET and params == RESET_ALL
    return not reset or servo.firmware < NO_BROADCAST_RESET_SINCE


def bulk_rows(params: bytes) -> tuple[GroupRead, ...]:
    """Parse the parameters of a bulk read."""
    return tuple(_ROW.iter_unpack(params)) if len(params) % _ROW.size == 0 else ()


def bulk_writes(params: bytes) -> list[GroupWrite]:
    """Parse the parameters of a bulk write: id, address and data of each servo."""
    out, at = [], 0
    while len(params) - at > _ROW.size:
        servo_id, address, length = _ROW.unpack_from(params, at)
        at += _ROW.size + length
        if at <= len(params):
            out.append((servo_id, address, params[at - length : at]))
    return out


def _factory_reset(servo: DynamixelServo, params: bytes) -> Result:
    return servo.factory_reset(params[0] if params else -1), b""


def _backup(servo: DynamixelServo, params: bytes) -> Result:
    if params[1:] != BACKUP_KEY or params[0] not in (STORE, RESTORE):
        return DATA_RANGE, b""
    return (servo.backup() if params[0] == STORE else servo.restore()), b""


def _clear(servo: DynamixelServo, params: bytes) -> Result:
    return (servo.clear_turns() if params == CLEAR_TURNS else DATA_RANGE), b""


INSTRUCTIONS = InstructionSet[DynamixelServo](
    2,
    (INSTRUCTION_ERROR, b""),
    {FACTORY_RESET: _factory_reset, CLEAR: _clear, BACKUP: _backup},
)


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
        return self._apply_line_faults([Answer(servo_id, error, b"", self._delay_s[servo_id])])

    # --- groups

    def _group_instructions(self) -> dict[int, GroupAction]:
        rows = self.instructions.sync_rows
        return super()._group_instructions() | {
            FAST_SYNC_READ: lambda params: self._answer_fast_sync_read(rows(params)),
            BULK_READ: lambda params: self._answer_plain(bulk_rows(params)),
            FAST_BULK_READ: lambda params: self._answer_fast_sync_read(bulk_rows(params)),
            BULK_WRITE: lambda params: self._write_all(bulk_writes(params)),
        }

    def _answer_fast_sync_read(self, rows: Sequence[GroupRead]) -> list[Piece]:
        """Return one packet of all answers; a servo that refuses fills its block with zeros."""
        length = 1 + sum([4 + row[2] for row in rows])
        if not self._wire.has_any and not self._twins:
            packet = fast_reply(self._by_id, rows, length, self._now_ms, self._fed_ms)
            return [Piece(rows[0][0], packet, self._delay_s[rows[0][0]])] if packet else []
        answers: list[Answer] = []
        for servo_id, address, size in rows:
            servo = self._by_id.get(servo_id)
            answer = (
                self._group_part(servo_id, address, size) if servo and servo.fast_reads else None
            )
            if answer is None:
                break
            answers.append(answer if answer[2] else answer._replace(params=bytes(size)))
        spoilt = fast_pieces(self._wire.spoil_answers(answers, True, self._now_s), length)
        return self._wire.spoil_pieces(spoilt, True, self._now_s)


build_dynamixel = partial(build_chain, DynamixelChain)
