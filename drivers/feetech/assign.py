"""Giving an STS servo its id and baud rate, with it alone on the bus.

Both are in the EEPROM, behind the lock (55): written with the lock closed they would hold
until the next power-off only. They act at once, so the lock is closed under the new id and
at the new rate. Source: Feetech memory table STS3215.
"""

from typing import NamedTuple

from drivers.errors import PortError, ServoFault, ServoMissing
from drivers.feetech.memory_table import BAUD_RATES, HIGHEST_ID
from drivers.feetech.registers import StsRegisters
from drivers.feetech.scan import Found, ping
from drivers.serial.port import BusPort


class Assigned(NamedTuple):
    """What has become of one servo: as it was found, as it is now, and what was written."""

    before: Found
    now: Found
    done: tuple[str, ...]


def assign(port: BusPort, found: Found, wanted_id: int, baud: int) -> Assigned:
    """Give the servo found an id and a baud rate, and see that it answers so.

    Its torque goes off. Whatever goes wrong, the message says where the servo now answers.

    Raises:
        ValueError: there is no such id or baud rate.
        drivers.errors.ServoMissing: it is not found again.
        drivers.errors.ServoFault: it does not take an order.
        drivers.errors.PortError: the adaptor cannot run at a rate.
        drivers.errors.BusLost: the port is gone.
    """
    if not 0 <= wanted_id <= HIGHEST_ID:
        raise ValueError(f"id {wanted_id} is not in 0..{HIGHEST_ID}")
    if baud not in BAUD_RATES:
        raise ValueError(f"{baud} bit/s is none of {', '.join(map(str, BAUD_RATES))}")
    _open(port, found.baud)
    registers = StsRegisters(port)
    done: list[str] = []
    _rest(port, registers, found, done)
    now = _change(port, registers, found, wanted_id, baud, done)
    seen = ping(port, wanted_id, baud, tries=3)
    if seen is None or seen.number != found.number:
        raise ServoMissing(
            f"{port.port_name}: the servo does not answer as id {wanted_id} at {baud} "
            "bit/s: gazerig scan tells where it is"
        )
    if not registers.settle(now.id, "lock", 1):
        raise _refused(port, now, "close its lock")
    return Assigned(found, seen, tuple(done))


def _rest(port: BusPort, registers: StsRegisters, found: Found, done: list[str]) -> None:
    """Make a servo answer every order, and take its torque."""
    registers.write_all((found.id,), "status_return_level", 1)
    if registers.read(found.id, "torque_enable"):
        if not registers.write(found.id, "torque_enable", 0):
            raise _refused(port, found, "let its torque go")
        done.append("torque 1 -> 0")


def _change(
    port: BusPort,
    registers: StsRegisters,
    found: Found,
    wanted_id: int,
    baud: int,
    done: list[str],
) -> Found:
    """Write id and baud rate where they differ; gives the servo as it should now answer."""
    now, rate = found, BAUD_RATES.index(baud)
    if now.id != wanted_id:
        _unlock(port, registers, now)
        # The confirmation comes from either id, so the new one is asked instead.
        registers.write(now.id, "id", wanted_id)
        if registers.identify(wanted_id) is None:
            raise _refused(port, now, f"take the id {wanted_id}")
        done.append(f"id {now.id} -> {wanted_id}")
        now = now._replace(id=wanted_id)
    if now.baud != baud or registers.read(now.id, "baud_rate") != rate:
        _unlock(port, registers, now)
        registers.write(now.id, "baud_rate", rate)
        done.append(f"baud rate {now.baud} -> {baud} bit/s")
        now = now._replace(baud=baud)
        _open(port, baud)
    return now


def _unlock(port: BusPort, registers: StsRegisters, now: Found) -> None:
    if not registers.write(now.id, "lock", 0):
        raise _refused(port, now, "open its lock")


def _open(port: BusPort, baud: int) -> None:
    if not port.setBaudRate(baud):
        raise PortError(f"{port.port_name} cannot run at {baud} bit/s: choose another rate")


def _refused(port: BusPort, now: Found, what: str) -> ServoFault:
    return ServoFault(
        f"{port.port_name}: the servo does not {what} (no answer); it answered last as id "
        f"{now.id} at {now.baud} bit/s: switch its power off and on and try again"
    )
