"""Instructions of Dynamixel Protocol 2.0 as one servo carries them out, and their parameters.

Source: ROBOTIS e-Manual, Protocol 2.0.
"""

import struct
from collections.abc import Callable

from gazerig.drivers.dynamixel.control_table import EEPROM_END
from gazerig.sim_mock.dynamixel.memory import ACCESS, DATA_RANGE, INSTRUCTION_ERROR
from gazerig.sim_mock.dynamixel.servo import DynamixelServo
from gazerig.sim_mock.smart_servo.chain import Wanted

PING, READ, WRITE, REG_WRITE, ACTION, FACTORY_RESET, REBOOT = 1, 2, 3, 4, 5, 6, 8
CLEAR, BACKUP = 0x10, 0x20
SYNC_READ, SYNC_WRITE, FAST_SYNC_READ = 0x82, 0x83, 0x8A
BULK_READ, BULK_WRITE, FAST_BULK_READ = 0x92, 0x93, 0x9A

CRC_ERROR = 3
CLEAR_TURNS = b"\x01\x44\x58\x4c\x22"
BACKUP_KEY = b"CTRL"
STORE, RESTORE = 1, 2
RESET_ALL = b"\xff"
NEVER = 3
"""Above every Status Return Level."""
NO_BROADCAST_RESET_SINCE = 42
"""First firmware that ignores a broadcast reset of everything."""

Said = tuple[int, bytes]
"""Error number and parameters of an answer."""

SPAN = struct.Struct("<HH")
ROW = struct.Struct("<BHH")


def carry_out(servo: DynamixelServo, code: int, params: bytes) -> Said:
    """Let a servo that is awake carry out an instruction."""
    action = _ACTIONS.get(code)
    return (INSTRUCTION_ERROR, b"") if action is None else action(servo, params)


def answered_from(servo: DynamixelServo, code: int) -> int:
    """Return the Status Return Level from which a servo answers an instruction."""
    if code == REBOOT and servo.quirks.mute_reboot:
        return NEVER
    return 0 if code == PING else 1 if code == READ else 2


def touches_eeprom(code: int, params: bytes) -> bool:
    """True if an instruction may change id, baud rate, return delay or secondary id."""
    if code in (WRITE, REG_WRITE):
        return int.from_bytes(params[:2], "little") < EEPROM_END
    return code in (ACTION, FACTORY_RESET, BACKUP)


def obeys_broadcast(servo: DynamixelServo, code: int, params: bytes) -> bool:
    """True if a servo carries out an instruction that goes to all."""
    reset = code == FACTORY_RESET and params == RESET_ALL
    return not reset or servo.firmware < NO_BROADCAST_RESET_SINCE


def sync_rows(params: bytes) -> tuple[Wanted, ...]:
    """Read the parameters of a sync read."""
    if len(params) <= SPAN.size:
        return ()
    address, length = SPAN.unpack_from(params)
    return tuple((servo_id, address, length) for servo_id in params[SPAN.size :])


def bulk_rows(params: bytes) -> tuple[Wanted, ...]:
    """Read the parameters of a bulk read."""
    return tuple(ROW.iter_unpack(params)) if len(params) % ROW.size == 0 else ()


def sync_writes(params: bytes) -> list[tuple[int, int, bytes]]:
    """Read the parameters of a sync write: id, address and data of each servo."""
    if len(params) < SPAN.size:
        return []
    address, length = SPAN.unpack_from(params)
    if (len(params) - SPAN.size) % (1 + length):
        return []
    pairs = struct.iter_unpack(f"<B{length}s", params[SPAN.size :])
    return [(servo_id, address, data) for servo_id, data in pairs]


def bulk_writes(params: bytes) -> list[tuple[int, int, bytes]]:
    """Read the parameters of a bulk write: id, address and data of each servo."""
    out, at = [], 0
    while len(params) - at > ROW.size:
        servo_id, address, length = ROW.unpack_from(params, at)
        at += ROW.size + length
        if at <= len(params):
            out.append((servo_id, address, params[at - length : at]))
    return out


def _ping(servo: DynamixelServo, params: bytes) -> Said:
    return 0, struct.pack("<HB", servo.model.number, servo.firmware)


def _read(servo: DynamixelServo, params: bytes) -> Said:
    if len(params) != SPAN.size:
        return INSTRUCTION_ERROR, b""
    data = servo.read(*SPAN.unpack(params))
    return (ACCESS, b"") if data is None else (0, data)


def _write(servo: DynamixelServo, params: bytes) -> Said:
    return servo.write(int.from_bytes(params[:2], "little"), params[2:]), b""


def _register(servo: DynamixelServo, params: bytes) -> Said:
    return servo.register(int.from_bytes(params[:2], "little"), params[2:]), b""


def _action(servo: DynamixelServo, params: bytes) -> Said:
    return servo.action(), b""


def _reboot(servo: DynamixelServo, params: bytes) -> Said:
    servo.restart()
    return 0, b""


def _factory_reset(servo: DynamixelServo, params: bytes) -> Said:
    return servo.factory_reset(params[0] if params else -1), b""


def _backup(servo: DynamixelServo, params: bytes) -> Said:
    if params[1:] != BACKUP_KEY or params[0] not in (STORE, RESTORE):
        return DATA_RANGE, b""
    return (servo.backup() if params[0] == STORE else servo.restore()), b""


def _clear(servo: DynamixelServo, params: bytes) -> Said:
    return (servo.clear_turns() if params == CLEAR_TURNS else DATA_RANGE), b""


_ACTIONS: dict[int, Callable[[DynamixelServo, bytes], Said]] = {
    PING: _ping,
    READ: _read,
    WRITE: _write,
    REG_WRITE: _register,
    ACTION: _action,
    FACTORY_RESET: _factory_reset,
    REBOOT: _reboot,
    CLEAR: _clear,
    BACKUP: _backup,
}
