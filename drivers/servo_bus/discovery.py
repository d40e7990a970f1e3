"""Who is on the bus, against who should be: one message with everything that is wrong."""

from collections.abc import Mapping, Sequence

from gazerig.drivers.errors import ServoMissing
from gazerig.drivers.event_log import EventLog, servo_label
from gazerig.drivers.servo_bus.family import Family, Identity, SingleRegisters
from gazerig.drivers.servo_bus.transaction import Line
from gazerig.drivers.types import ServoSetup


def find(
    line: Line, registers: SingleRegisters, setups: Sequence[ServoSetup], log: EventLog
) -> dict[int, int]:
    """Find every servo and check its model and firmware; return the firmware of each.

    Servos that no setup names are left alone, and noted in the log where one question to all
    tells of them.

    Raises:
        ServoMissing: some are absent, of another model or too old; all are
            named at once, with those that are there and not expected.
    """
    family = line.family
    heard = line.ping_all() if family.broadcast_ping else {}
    found = {
        # Two with one id, or a noisy line, spoil an answer to everybody: asked alone as well.
        setup.id: heard.get(setup.id) or registers.identify(setup.id)
        for setup in setups
    }
    problems = [text for setup in setups if (text := _problem(family, setup, found[setup.id]))]
    if problems and not family.broadcast_ping:
        # Another one may be the one that is missing; only now is it worth asking every id.
        heard = line.ping_all()
    strangers = {i: identity for i, identity in heard.items() if i not in found}
    where = line.port.port_name
    if not any(found.values()) and not strangers:
        raise ServoMissing(f"{where}: no servo answers: check servo power, cable and baud rate")
    if problems:
        raise ServoMissing(_message(family, where, problems, strangers, found))
    for servo_id, identity in sorted(strangers.items()):
        model = family.model_name(identity.model_number)
        log.add(f"servo {servo_id} ({model}) belongs to no joint: left alone")
    return {servo_id: identity.firmware for servo_id, identity in found.items() if identity}


def _problem(family: Family, setup: ServoSetup, found: Identity | None) -> str:
    """Return what is wrong with one servo, "" where nothing is."""
    who = servo_label(setup)
    if found is None:
        return f"{who} does not answer"
    if found.model_number != family.models[setup.model].number:
        return f"{who} is {family.model_name(found.model_number)}, not {setup.model}"
    if found.firmware < setup.firmware_min:
        return (
            f"{who} has firmware {found.firmware}, older than {setup.firmware_min}: "
            "update it with the maker's tool"
        )
    return ""


def _message(
    family: Family,
    where: str,
    problems: Sequence[str],
    strangers: Mapping[int, Identity],
    found: Mapping[int, Identity | None],
) -> str:
    """Return everything in one line, with the cure."""
    there = "; ".join(problems)
    if strangers:
        named = ", ".join(
            f"{i} ({family.model_name(one.model_number)})" for i, one in sorted(strangers.items())
        )
        there += f"; unexpected: servo {named}"
    if strangers and None in found.values():
        return f"{where}: {there}: check cables and ids; is one of them the one that is missing?"
    return f"{where}: {there}: check cables and ids"
