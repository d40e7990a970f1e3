"""Homing of an STS servo: its present position becomes the middle, away from the encoder's zero.

The servo computes the offset (31) itself on request (Torque Enable := 128) and keeps it in its
EEPROM. Earlier calibrations in steps are invalid afterwards. Source: Feetech memory table STS3215,
register 40.
"""

from gazerig.drivers.errors import ServoFault, ServoMissing
from gazerig.drivers.feetech.memory_table import SET_MIDDLE, STEPS_PER_TURN
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.family import Family
from gazerig.drivers.servo_bus.registers import Registers

MIDDLE = STEPS_PER_TURN // 2
NEAR_STEPS = 8
"""Motion of the joint by a hand's tremor meanwhile."""


def set_middle(port: BusPort, family: Family, servo_id: int) -> int:
    """Set the present position of a servo without torque to 2048; return its offset in steps.

    Raises:
        ServoMissing: it does not answer.
        ServoFault: its torque is on, or it rejects the instruction.
        BusLost: the port is lost.
    """
    registers = Registers(port, family)
    where = f"{port.port_name}: servo {servo_id}"
    torque = registers.read(servo_id, "torque_enable")
    if torque is None:
        raise ServoMissing(f"{where} does not answer: check its cable and servo power")
    if torque:
        raise ServoFault(f"{where} has its torque on: switch it off before its middle is set")
    if not registers.write(servo_id, "lock", 0):
        raise ServoMissing(f"{where} does not answer: check its cable and servo power")
    registers.write(servo_id, "torque_enable", SET_MIDDLE)
    # Some firmware leaves torque on.
    off = registers.write(servo_id, "torque_enable", 0)
    locked = registers.write(servo_id, "lock", 1)
    place, offset = registers.read(servo_id, "present_position"), None
    if place is not None and abs(place - MIDDLE) <= NEAR_STEPS:
        offset = registers.read(servo_id, "position_offset")
    if offset is None or not off or not locked:
        raise ServoFault(
            f"{where} does not accept its present position as its middle (it reads {place}): switch its power "
            "off and on and try again"
        )
    return offset
