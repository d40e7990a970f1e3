"""Who is on the bus, against who should be: one message with everything that is wrong."""

from collections.abc import Mapping, Sequence

from drivers.dynamixel.control_table import MODELS
from drivers.errors import ServoMissing
from drivers.event_log import EventLog, servo_label
from drivers.servo_bus.line import Line
from drivers.servo_bus.registers import Identity, Registers
from drivers.types import ServoSetup

NAMES = {model.number: model.name for model in MODELS.values()}


def find(
    line: Line, registers: Registers, setups: Sequence[ServoSetup], log: EventLog
) -> dict[int, int]:
    """Find every servo and check its model and firmware; gives the firmware of each.

    Servos that no setup names are left alone and noted in the log.

    Raises:
        drivers.errors.ServoMissing: some are absent, of another model or too old; all are
            named at once, with those that are there and not expected.
    """
    heard = {i: Identity(*found) for i, found in line.ping_all().items()}
    found = {
        # Two with one id, or a noisy line, spoil an answer to everybody: asked alone as well.
        setup.id: heard.get(setup.id) or registers.identify(setup.id)
        for setup in setups
    }
    ids = {setup.id for setup in setups}
    strangers = {i: identity for i, identity in heard.items() if i not in ids}
    where = line.port.port_name
    if not any(found.values()) and not strangers:
        raise ServoMissing(f"{where}: no servo answers: check servo power, cable and baud rate")
    problems = [problem for setup in setups if (problem := _problem(setup, found[setup.id]))]
    if problems:
        raise ServoMissing(_message(where, problems, strangers, found))
    for servo_id, identity in sorted(strangers.items()):
        log.add(f"servo {servo_id} ({_model(identity)}) belongs to no joint: left alone")
    return {servo_id: identity.firmware for servo_id, identity in found.items() if identity}


def _problem(setup: ServoSetup, found: Identity | None) -> str:
    """Say what is wrong with one servo, "" where nothing is."""
    if found is None:
        return f"{servo_label(setup)} does not answer"
    if found.model_number != MODELS[setup.model].number:
        return f"{servo_label(setup)} is {_model(found)}, not {setup.model}"
    if found.firmware < setup.firmware_min:
        return (
            f"{servo_label(setup)} has firmware {found.firmware}, older than {setup.firmware_min}: "
            "update it with the maker's tool"
        )
    return ""


def _message(
    where: str,
    problems: Sequence[str],
    strangers: Mapping[int, Identity],
    found: Mapping[int, Identity | None],
) -> str:
    """Put everything into one line, with the cure."""
    there = "; ".join(problems)
    if strangers:
        named = ", ".join(f"{i} ({_model(identity)})" for i, identity in sorted(strangers.items()))
        there += f"; unexpected: servo {named}"
    if strangers and None in found.values():
        return f"{where}: {there}: check cables and ids; is one of them the one that is missing?"
    return f"{where}: {there}: check cables and ids"


def _model(identity: Identity) -> str:
    return NAMES.get(identity.model_number, f"model number {identity.model_number}")
