"""Restarting one servo: the only way but the power switch to clear a latched error."""

from collections.abc import Callable
from typing import NamedTuple

from drivers.dynamixel_registers import Registers
from drivers.dynamixel_scan import Found, ping, reboot
from drivers.dynamixel_table import name_errors
from drivers.errors import ServoMissing
from drivers.serial_port import BusPort

BACK_S = 3.0
"""A servo that is not back after so long will not come; they take about 0.4 s."""
PAUSE_S = 0.1


class Standing(NamedTuple):
    """How a servo stands.

    errors: latched hardware errors by name
    torque: None where it could not be read; position: in steps, None likewise
    """

    errors: tuple[str, ...]
    torque: bool | None
    position: int | None
    voltage_v: float | None

    def __str__(self) -> str:
        """Say it in a line."""
        latched = f"latched: {' and '.join(self.errors)}" if self.errors else "nothing latched"
        torque = {None: "torque unknown", False: "torque off", True: "torque on"}[self.torque]
        volts = "" if self.voltage_v is None else f", {self.voltage_v:.1f} V"
        return f"{latched}, {torque}, at step {self.position}{volts}"


class Rebooted(NamedTuple):
    """A servo before and after its restart, and how long it was away."""

    before: Standing
    after: Standing
    away_s: float


def present(port: BusPort, servo_id: int, baud: int) -> Found:
    """Find one servo.

    Raises:
        drivers.errors.ServoMissing: it does not answer.
    """
    found = ping(port, servo_id, baud, tries=3)
    if found is None:
        raise ServoMissing(
            f"{port.port_name}: servo {servo_id} does not answer at {baud} bit/s: "
            "gazerig scan tells who does"
        )
    return found


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


def restart(
    port: BusPort, servo_id: int, baud: int, sleep_until: Callable[[float], None]
) -> Rebooted:
    """Restart a servo and wait until it answers; its torque is off then.

    Raises:
        drivers.errors.ServoMissing: it does not answer, before or after.
        drivers.errors.BusLost: the port is gone.
    """
    present(port, servo_id, baud)
    before, began_s = standing(port, servo_id), port.now_s()
    reboot(port, servo_id)
    for _ in range(round(BACK_S / PAUSE_S)):
        sleep_until(port.now_s() + PAUSE_S)
        if ping(port, servo_id, baud, tries=1) is not None:
            away_s = port.now_s() - began_s
            return Rebooted(before, standing(port, servo_id), away_s)
    raise ServoMissing(
        f"{port.port_name}: servo {servo_id} does not come back after its restart: "
        "switch its power off and on"
    )
