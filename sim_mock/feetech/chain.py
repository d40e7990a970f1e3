"""Device side of a bus of Feetech servos: bytes in, bytes out, nothing opened.

Source: Feetech, communication protocol of the STS/SMS series.
"""

import struct
from functools import lru_cache

from gazerig.drivers.feetech.memory_table import HIGHEST_ID
from gazerig.sim_mock.feetech.packets import find_instructions, status
from gazerig.sim_mock.feetech.servo import FeetechServo
from gazerig.sim_mock.smart_servo.chain import ServoChain
from gazerig.sim_mock.smart_servo.faults import commands_of


class FeetechChain(ServoChain):
    """Feetech servos on one bus."""

    servo_type = FeetechServo
    find_instructions = staticmethod(lru_cache(64)(find_instructions))
    status = staticmethod(status)
    span = struct.Struct("<BB")
    misunderstood = None
    commands = commands_of(HIGHEST_ID)


build_feetech = FeetechChain.build
