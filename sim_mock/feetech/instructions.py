"""Instructions of the STS servos as one servo carries them out, and parameters of group ones.

What is not understood is met with silence [assumed: no document tells].
Source: Feetech, communication protocol of the STS/SMS series.
"""

from collections.abc import Callable

from gazerig.drivers.feetech.memory_table import STEPS_PER_TURN
from gazerig.sim_mock.feetech.servo import MIDDLE, FeetechServo

PING, READ, WRITE, REG_WRITE, ACTION = 1, 2, 3, 4, 5
RESTORE, REBOOT, RESET_TURNS, CALIBRATE = 6, 8, 10, 11
SYNC_READ, SYNC_WRITE = 0x82, 0x83


def carry_out(servo: FeetechServo, code: int, params: bytes) -> bytes | None:
    """Let a servo that is awake carry out an instruction; return what it says, None for nothing."""
    action = _ACTIONS.get(code)
    return None if action is None else action(servo, params)


def answers(servo: FeetechServo, code: int) -> bool:
    """True if a servo answers an instruction to it alone."""
    if code == REBOOT and servo.quirks.reboot == "mute":
        return False
    return code in (PING, READ) or servo.answers_all


def sync_rows(params: bytes) -> list[tuple[int, int, int]]:
    """Read the parameters of a sync read: id, address and length of each servo's part."""
    return [(servo_id, params[0], params[1]) for servo_id in params[2:]]


def sync_writes(params: bytes) -> list[tuple[int, int, bytes]]:
    """Read the parameters of a sync write: id, address and data of each servo."""
    if len(params) < 2 or (len(params) - 2) % (size := params[1] + 1):
        return []
    places = range(2, len(params), size)
    return [(params[at], params[0], params[at + 1 : at + size]) for at in places]


def _ping(servo: FeetechServo, params: bytes) -> bytes:
    return b""


def _read(servo: FeetechServo, params: bytes) -> bytes | None:
    return servo.read(*params) if len(params) == 2 else None


def _write(servo: FeetechServo, params: bytes) -> bytes | None:
    if not params:
        return None
    servo.write(params[0], params[1:])
    return b""


def _register(servo: FeetechServo, params: bytes) -> bytes | None:
    if not params:
        return None
    servo.register(params[0], params[1:])
    return b""


def _action(servo: FeetechServo, params: bytes) -> bytes:
    servo.action()
    return b""


def _restore(servo: FeetechServo, params: bytes) -> bytes:
    servo.factory_reset()
    return b""


def _reboot(servo: FeetechServo, params: bytes) -> bytes:
    servo.restart()
    return b""


def _reset_turns(servo: FeetechServo, params: bytes) -> bytes:
    servo.drive.forget_turns()
    return b""


def _calibrate(servo: FeetechServo, params: bytes) -> bytes | None:
    if len(params) not in (0, 2):
        return None
    servo.drive.calibrate(int.from_bytes(params, "little") % STEPS_PER_TURN if params else MIDDLE)
    return b""


_ACTIONS: dict[int, Callable[[FeetechServo, bytes], bytes | None]] = {
    PING: _ping,
    READ: _read,
    WRITE: _write,
    REG_WRITE: _register,
    ACTION: _action,
    RESTORE: _restore,
    REBOOT: _reboot,
    RESET_TURNS: _reset_turns,
    CALIBRATE: _calibrate,
}
