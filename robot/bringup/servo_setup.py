"""Finding the one servo that is connected, to give it its id and baud rate.

Only one servo may be connected: two with one id cannot be told apart, and an id given to
both would make it worse.
"""

from collections.abc import Iterable, Sequence

from drivers.errors import ServoMissing
from drivers.serial.port import BusPort
from drivers.servo_models import servo_label
from drivers.types import ServoSetup
from robot.bringup.servo_kind import Found, ServoKind, SetUp, Tell

SHARED, TRIES = 2, 6
"""So many of so many answers in pieces are no accident."""


def search_order(kind: ServoKind, baud: int) -> tuple[int, ...]:
    """List all baud rates, those that a servo is likely to have first."""
    return tuple(dict.fromkeys((kind.factory_baud, baud, *kind.rates)))


def find_alone(port: BusPort, kind: ServoKind, bauds: Sequence[int], tell: Tell) -> Found:
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
        if not port.setBaudRate(baud) or (found and not kind.anybody(port)):
            continue
        answers, noise = kind.everybody(port, baud)
        found += answers
        junk += noise
        shared = answers and kind.garbled(port, answers[0].id, TRIES) >= SHARED
        found += [answers[0]] if shared else []
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


def refuse_model(found: Found, kind: ServoKind, setup: ServoSetup, where: str) -> None:
    """See that the servo found is of the model the joint wants.

    Raises:
        drivers.errors.ServoMissing: it is another.
    """
    if found.number != kind.number(setup.model):
        raise ServoMissing(
            f"{where}: this is {found.model}, {servo_label(setup)} wants {setup.model}: "
            "connect the right one, or correct the model in the YAML"
        )


def assign(
    port: BusPort, kind: ServoKind, found: Found, setup: ServoSetup, baud: int, tell: Tell
) -> SetUp:
    """Give the servo found the id of a joint and the bus's baud rate, and see that it has them.

    Its torque goes off. Whatever goes wrong, the message says where the servo now answers.

    Raises:
        drivers.errors.ServoMissing: of another model, refuses, or is not found again.
        drivers.errors.PortError: the adaptor cannot run at a rate.
        drivers.errors.BusLost: the port is gone.
    """
    refuse_model(found, kind, setup, port.port_name)
    return kind.assign(port, found, setup, baud, tell)
