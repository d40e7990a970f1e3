"""Instructions of Dynamixel servos only, and group instructions of Protocol 2.0.

Source: ROBOTIS e-Manual, Protocol 2.0.
"""

import struct

from gazerig.drivers.dynamixel.control_table import EEPROM_END
from gazerig.sim_mock.dynamixel.memory import DATA_RANGE, INSTRUCTION_ERROR
from gazerig.sim_mock.dynamixel.servo import DynamixelServo
from gazerig.sim_mock.smart_servo.framing import ACTION, FACTORY_RESET, REG_WRITE, WRITE
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
