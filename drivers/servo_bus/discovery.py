"""Search for servos, and comparison of found and expected servos.

If the servos answer a broadcast ping one after another, a broadcast ping is sent. Otherwise all
would answer together and corrupt each other, so the identity of every id is read. An answer
contains its id, so an answer that an adapter delivers late is still counted.
"""

from collections.abc import Sequence
from typing import NamedTuple

from gazerig.drivers.errors import ServoMissing
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.serial.port import BITS_PER_BYTE, BusPort
from gazerig.drivers.servo_bus.family import Family, Identity
from gazerig.drivers.servo_bus.registers import REPLY_S, Registers, transact
from gazerig.drivers.servo_bus.transaction import Transactions
from gazerig.drivers.types import ServoConfig

FIND_QUIET_S = 0.04
"""Silence after which all servos of a rig have answered a broadcast ping."""

BABBLE_S = 2.0
"""Longest time to listen to a line that never falls silent."""

SHARED, ANSWERS = 2, 6
"""Two servos share an id if at least ``SHARED`` of ``ANSWERS`` answers are incomplete."""

_ROOM = 1 << 12
_MOST = 1 << 13
"""Largest number of bytes read; more than the answers of all ids."""


class FoundServo(NamedTuple):
    """A servo that answered.

    number: its model number; firmware: version number of its family
    baud: baud rate at which it answered; model: name of its model
    """

    id: int
    number: int
    firmware: int
    baud: int
    model: str


def scan_ids(
    port: BusPort, family: Family, baud: int, quiet_s: float | None = None
) -> tuple[tuple[FoundServo, ...], int]:
    """Search for servos at one baud rate; return them and the number of bytes outside any packet.

    Two servos with one id corrupt each other's answers; different intact answers are two servos.

    Raises:
        BusLost: the port is lost.
    """
    codec, quiet_s = family.codec, family.quiet_s if quiet_s is None else quiet_s
    port.drain()
    if family.broadcast_ping:
        request = codec.identity_request(codec.BROADCAST)
        port.write(request)
        size = len(request) + codec.STATUS_OVERHEAD + codec.IDENTITY_LENGTH
        raw = without_echo(read_until_quiet(port, quiet_s + size * BITS_PER_BYTE / baud), request)
    else:
        raw = b""
        for servo_id in range(family.highest_id + 1):
            request = codec.identity_request(servo_id)
            answer, _ = transact(port, family, request, codec.IDENTITY_LENGTH, quiet_s)
            raw += without_echo(answer, request)
        raw += port.read_until(_ROOM, port.now_s() + REPLY_S)
    whole = [status for status in codec.parse_statuses(raw) if status.intact]
    used = sum(codec.STATUS_OVERHEAD + len(status.params) for status in whole)
    identities = [(status.id, codec.parse_identity(status)) for status in whole]
    found = [_found_servo(family, i, identity, baud) for i, identity in identities if identity]
    # A broadcast ping is answered once; a servo read alone may answer again, late.
    each = found if family.broadcast_ping else dict.fromkeys(found)
    return tuple(each), max(0, len(raw) - used)


def _found_servo(family: Family, servo_id: int, identity: Identity, baud: int) -> FoundServo:
    return FoundServo(servo_id, *identity, baud, family.model_name(identity.model_number))


def has_any_reply(port: BusPort, family: Family) -> bool:
    """Return whether any servo answers a broadcast ping, even if the answers corrupt each other.

    True if ``scan_ids`` sends only a broadcast ping.
    """
    if family.broadcast_ping:
        return True
    question = family.codec.ping(family.codec.BROADCAST)
    port.drain()
    port.write(question)
    received = port.read_until(_ROOM, port.now_s() + REPLY_S)
    return bool(without_echo(received, question))


def without_echo(received: bytes, request: bytes) -> bytes:
    """Return received bytes without the request, which an adapter with an echo returns first."""
    return received.replace(request, b"", 1)


def ping(
    port: BusPort, family: Family, servo_id: int, baud: int, tries: int = 2
) -> FoundServo | None:
    """Return model and firmware of one servo, None without an intact answer."""
    identity = Registers(port, family, tries).identify(servo_id)
    return None if identity is None else _found_servo(family, servo_id, identity, baud)


def count_corrupt(port: BusPort, family: Family, servo_id: int, tries: int = ANSWERS) -> int:
    """Return how many answers of one id were corrupt or disagreed about its position.

    Two servos with one id answer at the same time and corrupt bytes that differ. Their answers to
    pings are often equal, their positions hardly ever.
    """
    first, last = (family.registers[name] for name in family.duplicate_id_registers)
    length = last.address + last.size - first.address
    position = family.registers["present_position"]
    at = position.address - first.address
    bad, places = 0, list[int]()
    for _ in range(tries):
        port.drain()
        request = family.codec.read(servo_id, first.address, length)
        raw, status = transact(port, family, request, length, REPLY_S, servo_id)
        if status is None:
            bad += bool(without_echo(raw, request))
        elif len(status.params) == length:
            places.append(position.decode(status.params[at : at + position.size]))
    # A checksum of one byte over two mixed answers may match by chance, but not the position.
    wide = bool(places) and max(places) - min(places) > family.steps_per_turn // 8
    return max(bad, SHARED if wide else 0)


def read_until_quiet(port: BusPort, quiet_s: float) -> bytes:
    """Return all bytes that arrive until the line has been quiet for ``quiet_s``."""
    end_s = port.now_s() + BABBLE_S
    raw = b""
    while more := port.read_until(1, port.now_s() + quiet_s):
        raw += more
        if port.now_s() >= end_s or len(raw) > _MOST:
            break
    return raw


def find(
    line: Transactions, registers: Registers, setups: Sequence[ServoConfig], log: EventLog
) -> dict[int, int]:
    """Find every servo and check its model; return the firmware of each.

    Servos without a setup are not changed, and logged if a broadcast ping finds them.

    Raises:
        ServoMissing: some are absent or of another model; the message names all of them, and the
            unexpected servos.
    """
    family, began_s, where = line.family, line.port.now_s(), line.port.port_name

    def identities() -> dict[int, Identity]:
        servos, _ = scan_ids(line.port, family, line.baud, min(family.quiet_s, FIND_QUIET_S))
        return {one.id: Identity(one.number, one.firmware) for one in servos}

    def refuse(fault: str, remedy: str) -> ServoMissing:
        now_s = line.port.now_s()
        return ServoMissing(line.lateness.blame(f"{where}: {fault}", remedy, now_s, began_s))

    present = identities() if family.broadcast_ping else {}
    # Two servos with one id, or a noisy line, corrupt a broadcast answer: also read alone.
    own = {one.id: present.get(one.id) or registers.identify(one.id) for one in setups}
    problems = [text for one in setups if (text := _problem(family, one, own[one.id]))]
    if problems and not family.broadcast_ping:
        # An unexpected servo may be the missing one; only now is it worth reading every id.
        present = identities()
    strangers = {
        servo_id: family.model_name(identity.model_number)
        for servo_id, identity in sorted(present.items())
        if servo_id not in own
    }
    if not any(own.values()) and not strangers:
        raise refuse("no servo answers", "check servo power, cable and baud rate")
    if problems:
        remedy = "check cables and ids"
        if strangers:
            named = ", ".join(f"{servo_id} ({model})" for servo_id, model in strangers.items())
            problems.append(f"unexpected: servo {named}")
            if None in own.values():
                remedy += "; is one of them the missing one?"
        raise refuse("; ".join(problems), remedy)
    for servo_id, model in strangers.items():
        log.add(f"servo {servo_id} ({model}) belongs to no joint: not used")
    return {servo_id: identity.firmware for servo_id, identity in own.items() if identity}


def _problem(family: Family, setup: ServoConfig, found: Identity | None) -> str:
    """Return the problem of one servo, "" for none."""
    if found is None:
        return f"{setup.label()} does not answer"
    if found.model_number != family.models[setup.model].number:
        return f"{setup.label()} is {family.model_name(found.model_number)}, not {setup.model}"
    return ""
