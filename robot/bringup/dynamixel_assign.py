"""Giving a Dynamixel servo its id and baud rate, with it alone on the bus.

Source: ROBOTIS e-Manual (ID and Baud Rate act after the status of their own write).
"""

from drivers.dynamixel.control_table import BAUD_RATES
from drivers.errors import PortError, ServoFault, ServoMissing
from drivers.serial.port import BusPort
from drivers.servo_bus.discovery import Found, ping
from drivers.servo_bus.registers import Registers
from drivers.types import ServoSetup
from robot.bringup.servo_kind import SetUp, Tell


def assign(port: BusPort, found: Found, setup: ServoSetup, baud: int, tell: Tell) -> SetUp:
    """Give the servo found the id of a joint and the bus's baud rate, and see that it has them.

    Its torque goes off. Whatever goes wrong, the message says where the servo now answers.

    Raises:
        drivers.errors.ServoMissing: it is not found again.
        drivers.errors.ServoFault: it refuses.
        drivers.errors.PortError: the adaptor cannot run at a rate.
        drivers.errors.BusLost: the port is gone.
    """
    _open(port, found.baud)
    registers = Registers(port)
    done: list[str] = []
    registers.write_all((found.id,), "status_return_level", 2)
    if registers.read(found.id, "torque_enable") and registers.write(found.id, "torque_enable", 0):
        done.append("torque 1 -> 0")
    now = found
    if now.id != setup.id:
        tell(f"id {now.id} -> {setup.id}")
        if not registers.write(now.id, "id", setup.id) and not ping(port, setup.id, now.baud):
            raise _refused(port, registers, now, f"the id {setup.id}")
        done.append(f"id {now.id} -> {setup.id}")
        now = now._replace(id=setup.id)
    if now.baud != baud or registers.read(now.id, "baud_rate") != BAUD_RATES.index(baud):
        tell(f"baud rate {now.baud} -> {baud}")
        written = registers.write(now.id, "baud_rate", BAUD_RATES.index(baud))
        if not written and registers.refusal:  # a mere silence may be a lost confirmation
            raise _refused(port, registers, now, f"{baud} bit/s")
        done.append(f"baud rate {now.baud} -> {baud} bit/s")
        now = now._replace(baud=baud)
        _open(port, baud)
    return SetUp(found, _verified(port, now), tuple(done))


def _open(port: BusPort, baud: int) -> None:
    if not port.setBaudRate(baud):
        raise PortError(f"{port.port_name} cannot run at {baud} bit/s: choose another rate")


def _refused(port: BusPort, registers: Registers, now: Found, what: str) -> ServoFault:
    reason = f"error {registers.refusal}" if registers.refusal else "no answer"
    return ServoFault(
        f"{port.port_name}: the servo does not take {what} ({reason}); it answered last as id "
        f"{now.id} at {now.baud} bit/s: switch its power off and on and try again"
    )


def _verified(port: BusPort, wanted: Found) -> Found:
    """Ask the servo under its new name."""
    seen = ping(port, wanted.id, wanted.baud, tries=3)
    if seen is None or seen.number != wanted.number:
        raise ServoMissing(
            f"{port.port_name}: the servo does not answer as id {wanted.id} at {wanted.baud} "
            "bit/s: gazerig scan tells where it is"
        )
    return seen
