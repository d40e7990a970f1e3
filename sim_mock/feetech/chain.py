"""Device side of a bus of Feetech servos: bytes in, bytes out, nothing opened.

Source: Feetech, communication protocol of the STS/SMS series.
"""

from functools import partial

from gazerig.drivers.feetech.memory_table import HIGHEST_ID, STEPS_PER_TURN
from gazerig.sim_mock.feetech.packets import HEADER, FeetechFraming, status
from gazerig.sim_mock.feetech.servo import MIDDLE, FeetechQuirks, FeetechServo
from gazerig.sim_mock.replies import Answer
from gazerig.sim_mock.smart_servo.chain import ServoChain, build_chain
from gazerig.sim_mock.smart_servo.faults import commands_of
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


class FeetechChain(ServoChain[FeetechServo, FeetechQuirks]):
    """Feetech servos on one bus."""

    servo_type, quirks_type, framing_type = FeetechServo, FeetechQuirks, FeetechFraming
    header, status, instructions = HEADER, staticmethod(status), INSTRUCTIONS
    commands = commands_of(
        HIGHEST_ID, FeetechQuirks, without=("shock",), reset="id 1, 1000000 bit/s"
    )

    def _apply_quirks(self, quirks: FeetechQuirks) -> None:
        for servo in self.servos:
            servo.apply_quirks(quirks)

    def _ping_all(self) -> list[Answer]:
        """Return the answers to a broadcast ping, by the quirks: in order, mixed, or none."""
        policy = self.quirks.broadcast_ping
        answers = [] if policy == "silence" else super()._ping_all()
        if policy == "answer" or not answers:
            return answers
        mixed, *others = answers
        for answer in others:
            mixed = answer._replace(twin=mixed)
        return [mixed]


build_feetech = partial(build_chain, FeetechChain)
