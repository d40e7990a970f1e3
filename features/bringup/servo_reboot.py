"""Restart of one servo, which clears a latched error of a Dynamixel like a power cycle."""

from collections.abc import Callable
from typing import NamedTuple

from gazerig.drivers.errors import ServoFault, ServoMissing
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.discovery import FoundServo, ping, reboot
from gazerig.drivers.servo_bus.registers import Registers
from gazerig.features.bringup.servo_kinds import ServoKind

BACK_S = 3.0
"""Longest wait for a servo after its restart, which takes about 0.4 to 0.8 s."""
PAUSE_S = 0.1


class ServoSnapshot(NamedTuple):
    """Status of a servo.

    errors: errors by name; torque: None if it could not be read
    position: position in steps, None if it could not be read
    latching: whether errors stay until a restart; otherwise they end with their cause
    """

    errors: tuple[str, ...]
    torque: bool | None
    position: int | None
    voltage_v: float | None
    latching: bool = True

    def __str__(self) -> str:
        """Return the status as one line."""
        word, none = ("latched", "nothing latched") if self.latching else ("reports", "no errors")
        errors = f"{word}: {' and '.join(self.errors)}" if self.errors else none
        torque = {None: "torque unknown", False: "torque off", True: "torque on"}[self.torque]
        volts = "" if self.voltage_v is None else f", {self.voltage_v:.1f} V"
        return f"{errors}, {torque}, at step {self.position}{volts}"


class RebootResult(NamedTuple):
    """Servo before and after its restart, and the duration of its absence."""

    before: ServoSnapshot
    after: ServoSnapshot
    away_s: float


def find_servo(port: BusPort, kind: ServoKind, servo_id: int, baud: int) -> FoundServo:
    """Find one servo.

    Raises:
        ServoMissing: it does not answer.
    """
    found = ping(port, kind.family, servo_id, baud, 3)
    if found is None:
        raise ServoMissing(
            f"{port.port_name}: servo {servo_id} does not answer at {baud} bit/s: "
            "gazerig scan lists those that do"
        )
    return found


def read_snapshot(port: BusPort, kind: ServoKind, servo_id: int) -> ServoSnapshot:
    """Return the status of a servo.

    Raises:
        BusLost: the port has disappeared.
    """
    registers = Registers(port, kind.family)
    status = registers.read(servo_id, kind.family.error_register)
    torque = registers.read(servo_id, "torque_enable")
    volts = registers.read(servo_id, "present_input_voltage")
    return ServoSnapshot(
        kind.family.name_errors(status or 0),
        None if torque is None else bool(torque),
        registers.read(servo_id, "present_position"),
        None if volts is None else volts / 10.0,
        kind.family.faults_latch,
    )


def reboot_servo(
    port: BusPort, kind: ServoKind, servo_id: int, baud: int, sleep_until: Callable[[float], None]
) -> RebootResult:
    """Restart a servo and wait until it answers; its torque is off then.

    Raises:
        ServoMissing: it does not answer, before or after.
        ServoFault: it answers, but has not restarted.
        BusLost: the port has disappeared.
    """
    find_servo(port, kind, servo_id, baud)
    before, began_s = read_snapshot(port, kind, servo_id), port.now_s()
    reboot(port, kind.family, servo_id)
    for _ in range(round(BACK_S / PAUSE_S)):
        sleep_until(port.now_s() + PAUSE_S)
        if ping(port, kind.family, servo_id, baud, 1) is None:
            continue
        away_s = port.now_s() - began_s
        after = read_snapshot(port, kind, servo_id)
        if before.torque and after.torque:
            raise ServoFault(
                f"{port.port_name}: servo {servo_id} has not restarted, its torque is still on: "
                "its firmware may not know how; switch its power off and on"
            )
        return RebootResult(before, after, away_s)
    raise ServoMissing(
        f"{port.port_name}: servo {servo_id} does not come back after its restart: "
        "switch its power off and on"
    )
