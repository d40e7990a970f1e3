"""Single STS servos in bring-up: how one stands, one fix written, a restart."""

from drivers.feetech.memory_table import REGISTERS, name_errors
from drivers.feetech.protocol import REBOOT, instruction
from drivers.feetech.registers import StsRegisters
from drivers.serial.port import BusPort
from robot.bringup.doctor.findings import Fix
from robot.bringup.servo_kind import Standing

ANSWERS_ALL = 1


def standing(port: BusPort, servo_id: int) -> Standing:
    """Read how a servo stands."""
    registers = StsRegisters(port)
    status = registers.read(servo_id, "status")
    torque = registers.read(servo_id, "torque_enable")
    volts = registers.read(servo_id, "present_input_voltage")
    return Standing(
        name_errors(status or 0),
        None if torque is None else bool(torque),
        registers.read(servo_id, "present_position"),
        None if volts is None else volts / 10.0,
        latching=False,
    )


def mend(port: BusPort, fix: Fix) -> str:
    """Write a fix where the torque is off, so that it stays; gives "" or why it was not done.

    Raises:
        drivers.errors.BusLost: the port is gone.
    """
    registers = StsRegisters(port)
    torque = registers.read(fix.servo_id, "torque_enable")
    if torque:
        return "its torque is on"
    if torque is None:
        return "the servo does not answer"
    if registers.read(fix.servo_id, "status_return_level") != ANSWERS_ALL:
        # A servo that answers questions alone confirms nothing of what follows.
        registers.write_all((fix.servo_id,), "status_return_level", ANSWERS_ALL)
    kept = REGISTERS[fix.register].area == "eeprom"
    write = registers.keep if kept else registers.settle
    if not write(fix.servo_id, fix.register, fix.value):
        return "the servo does not take it"
    if registers.read(fix.servo_id, fix.register) != fix.value:
        return "it reads back otherwise"
    return ""


def reboot(port: BusPort, servo_id: int) -> None:
    """Tell a servo to restart; whether it has is seen by asking it afterwards."""
    port.drain()
    port.write(instruction(servo_id, REBOOT))
    # Some firmware confirms it.
    port.drain()
