"""Single Dynamixel servos in bring-up: how one stands, and one fix written."""

from drivers.dynamixel.control_table import name_errors
from drivers.serial.port import BusPort
from drivers.servo_bus.registers import Registers
from robot.bringup.doctor.findings import Fix
from robot.bringup.servo_kind import Standing


def standing(port: BusPort, servo_id: int) -> Standing:
    """Read how a servo stands."""
    registers = Registers(port)
    status = registers.read(servo_id, "hardware_error_status")
    torque = registers.read(servo_id, "torque_enable")
    volts = registers.read(servo_id, "present_input_voltage")
    return Standing(
        name_errors(status or 0),
        None if torque is None else bool(torque),
        registers.read(servo_id, "present_position"),
        None if volts is None else volts / 10.0,
    )


def mend(port: BusPort, fix: Fix) -> str:
    """Write a fix where the torque is off; gives "" or why it was not done.

    Raises:
        drivers.errors.BusLost: the port is gone.
    """
    registers = Registers(port)
    if fix.register == "status_return_level":
        # No servo that answers pings alone confirms this; and it moves nothing.
        registers.write_all((fix.servo_id,), fix.register, fix.value)
    torque = registers.read(fix.servo_id, "torque_enable")
    if torque:
        return "its torque is on"
    if torque is None or not registers.settle(fix.servo_id, fix.register, fix.value):
        return "the servo does not take it"
    if registers.read(fix.servo_id, fix.register) != fix.value:
        return "it reads back otherwise"
    return ""
