"""Giving a servo its id and baud rate, with it alone on the bus.

Only one servo may be connected: two with one id cannot be told apart, and an id given to
both would make it worse. Source: ROBOTIS e-Manual (ID and Baud Rate act after the status
of their own write).
"""

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

from drivers.dynamixel_registers import Registers
from drivers.dynamixel_scan import (
    COMMON_FIRST,
    FACTORY_BAUD,
    SHARED,
    Found,
    everybody,
    garbled,
    ping,
)
from drivers.dynamixel_table import BAUD_RATES, MODELS
from drivers.errors import PortError, ServoFault, ServoMissing
from drivers.serial_port import BusPort
from drivers.types import ServoSetup
from robot.bringup.doctor_patient import name_servo

Tell = Callable[[str], None]


class SetUp(NamedTuple):
    """What has become of one servo: as it was found, as it is now, and what was written."""

    before: Found
    now: Found
    done: tuple[str, ...]


def search_order(baud: int) -> tuple[int, ...]:
    """List all baud rates, those that a servo is likely to have first."""
    return tuple(dict.fromkeys((FACTORY_BAUD, baud, *COMMON_FIRST)))


def find_alone(port: BusPort, bauds: Sequence[int], tell: Tell) -> Found:
    """Find the one servo that is connected, whatever its id and baud rate; all rates are asked.

    Raises:
        drivers.errors.ServoMissing: none answers, or more than one.
        drivers.errors.PortError: the port cannot be opened.
        drivers.errors.BusLost: it has gone away.
    """
    found: list[Found] = []
    junk = 0
    for baud in bauds:
        tell(f"asking at {baud} bit/s")
        if port.setBaudRate(baud):
            answers, noise = everybody(port, baud)
            found += answers
            junk += noise
            found += [answers[0]] if answers and garbled(port, answers[0].id) >= SHARED else []
    where = port.port_name
    if len(found) > 1:
        raise ServoMissing(f"{where}: {_crowd(found)}: connect one servo alone")
    if not found and junk:
        raise ServoMissing(
            f"{where}: answers in pieces only: connect one servo alone, and check its plug"
        )
    if not found:
        raise ServoMissing(
            f"{where}: no servo answers at any baud rate: is its supply on, its plug in?"
        )
    return found[0]


def _crowd(found: Iterable[Found]) -> str:
    named = [f"id {one.id} ({one.model}) at {one.baud} bit/s" for one in found]
    if len(set(named)) < len(named):
        return f"two servos answer as {named[0]}"
    return f"{len(named)} servos answer: {', '.join(named)}"


def refuse_model(found: Found, setup: ServoSetup, where: str) -> None:
    """See that the servo found is of the model the joint wants.

    Raises:
        drivers.errors.ServoMissing: it is another.
    """
    if found.number != MODELS[setup.model].number:
        raise ServoMissing(
            f"{where}: this is {found.model}, {name_servo(setup)} wants {setup.model}: "
            "connect the right one, or correct the model in the YAML"
        )


def assign(port: BusPort, found: Found, setup: ServoSetup, baud: int, tell: Tell) -> SetUp:
    """Give the servo found the id of a joint and the bus's baud rate, and see that it has them.

    Its torque goes off. Whatever goes wrong, the message says where the servo now answers.

    Raises:
        drivers.errors.ServoMissing: of another model, refuses, or is not found again.
        drivers.errors.PortError: the adaptor cannot run at a rate.
        drivers.errors.BusLost: the port is gone.
    """
    refuse_model(found, setup, port.port_name)
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
