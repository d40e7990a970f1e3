"""Device side of a bus of Feetech servos: bytes in, bytes out, nothing opened.

Source: Feetech, communication protocol of the STS/SMS series.
"""

from functools import partial

from gazerig.drivers.feetech.memory_table import HIGHEST_ID
from gazerig.sim_mock.feetech.instructions import INSTRUCTIONS
from gazerig.sim_mock.feetech.packets import HEADER, FeetechFraming, status
from gazerig.sim_mock.feetech.quirks import FeetechQuirks
from gazerig.sim_mock.feetech.servo import FeetechServo
from gazerig.sim_mock.replies import Answer
from gazerig.sim_mock.smart_servo.chain import ServoChain, build_chain
from gazerig.sim_mock.smart_servo.faults import commands_of


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
