"""Instructions of Feetech servos only.

An unknown instruction gets no answer [assumed: not documented].
Source: Feetech, communication protocol of the STS/SMS series.
"""

from gazerig.drivers.feetech.memory_table import STEPS_PER_TURN
from gazerig.sim_mock.feetech.servo import MIDDLE, FeetechServo
from gazerig.sim_mock.smart_servo.framing import FACTORY_RESET
from gazerig.sim_mock.smart_servo.instructions import InstructionSet, Result

RESET_TURNS, CALIBRATE = 10, 11


def _factory_reset(servo: FeetechServo, params: bytes) -> Result:
    servo.factory_reset()
    return 0, b""


def _reset_turns(servo: FeetechServo, params: bytes) -> Result:
    servo.drive.forget_turns()
    return 0, b""


def _calibrate(servo: FeetechServo, params: bytes) -> Result | None:
    if len(params) not in (0, 2):
        return None
    servo.drive.calibrate(int.from_bytes(params, "little") % STEPS_PER_TURN if params else MIDDLE)
    return 0, b""


INSTRUCTIONS = InstructionSet[FeetechServo](
    1, None, {FACTORY_RESET: _factory_reset, RESET_TURNS: _reset_turns, CALIBRATE: _calibrate}
)
