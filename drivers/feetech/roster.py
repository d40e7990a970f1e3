"""Who is on a bus of STS servos, against who should be: one message with all that is wrong."""

from collections.abc import Mapping, Sequence

from drivers.errors import ServoMissing
from drivers.event_log import servo_label
from drivers.feetech.line import FeetechLine
from drivers.feetech.memory_table import MODELS
from drivers.feetech.registers import Identity, StsRegisters
from drivers.feetech.scan import Found
from drivers.types import ServoSetup


def find(line: FeetechLine, registers: StsRegisters, setups: Sequence[ServoSetup]) -> None:
    """Find every servo and check its model and firmware.

    Raises:
        drivers.errors.ServoMissing: some are absent, of another model or too old; all are
            named at once, with those that are there and not expected.
    """
    found = {setup.id: registers.identify(setup.id) for setup in setups}
    problems = [problem for setup in setups if (problem := _problem(setup, found[setup.id]))]
    if not problems:
        return
    where = line.port.port_name
    # Somebody else may be the one that is missing; only now is it worth asking every id.
    everybody = {i: Identity(*seen) for i, seen in line.ping_all().items()}
    strangers = {i: seen for i, seen in everybody.items() if i not in found}
    if not any(found.values()) and not strangers:
        raise ServoMissing(f"{where}: no servo answers: check servo power, cable and baud rate")
    raise ServoMissing(_message(where, problems, strangers, found))


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
    return Found(0, identity.model_number, identity.firmware, 0).model
