"""Search for servos, and comparison of found and expected servos.

The identity of every id is read, as servos of some families answer a broadcast ping all together.
An answer contains its id, so an answer that an adapter delivers late is still counted.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from gazerig.drivers.errors import ServoMissing
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.family import BROADCAST, PING, Family, Identity
from gazerig.drivers.servo_bus.transaction import REPLY_S, ROOM, Transactions, sort_answers
from gazerig.drivers.types import ServoConfig

SCAN_S = 0.004
"""Time-out for each id of a search; a servo answers within half a millisecond."""

SHARED, ANSWERS = 2, 6
"""Two servos share an id if at least ``SHARED`` of ``ANSWERS`` answers are incomplete."""


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


def scan_ids(port: BusPort, family: Family, baud: int) -> tuple[tuple[FoundServo, ...], int]:
    """Search for servos at one baud rate; return them and the number of bytes outside any packet.

    Two servos with one id corrupt each other's answers; different intact answers are two servos.

    Raises:
        BusLost: the port is lost.
    """
    line, codec, raw = Transactions(port, family, baud), family.codec, b""
    length = codec.STATUS_OVERHEAD + codec.IDENTITY_LENGTH
    port.drain()
    for servo_id in range(family.highest_id + 1):
        raw += line.listen(codec.identity_request(servo_id), length, SCAN_S)
    raw += port.read_until(ROOM, port.now_s() + REPLY_S)
    whole = [status for status in codec.parse_statuses(raw) if status.intact]
    used = sum(codec.STATUS_OVERHEAD + len(status.params) for status in whole)
    identities = [(status.id, codec.parse_identity(status)) for status in whole]
    found = [_found_servo(family, i, identity, baud) for i, identity in identities if identity]
    return tuple(dict.fromkeys(found)), max(0, len(raw) - used)  # one may answer again, late


def _found_servo(family: Family, servo_id: int, identity: Identity, baud: int) -> FoundServo:
    return FoundServo(servo_id, *identity, baud, family.model_name(identity.model_number))


def has_any_reply(port: BusPort, family: Family) -> bool:
    """Return whether any servo answers a broadcast ping, even if the answers corrupt each other."""
    request = family.codec.instruction(BROADCAST, PING)
    port.drain()
    port.write(request)
    return bool(port.read_until(ROOM, port.now_s() + REPLY_S).replace(request, b"", 1))


def ping(port: BusPort, family: Family, servo_id: int, baud: int) -> FoundServo | None:
    """Return model and firmware of one servo, None without an intact answer."""
    identity = Transactions(port, family, baud).identify(servo_id)
    return None if identity is None else _found_servo(family, servo_id, identity, baud)


def count_corrupt(port: BusPort, family: Family, servo_id: int, tries: int = ANSWERS) -> int:
    """Return how many answers of one id were corrupt or disagreed about its position.

    Two servos with one id answer at the same time and corrupt bytes that differ. Their answers to
    pings are often equal, their positions hardly ever.
    """
    line, codec, window = Transactions(port, family), family.codec, family.window
    request, bad, places = family.read(servo_id, window.address, window.length), 0, list[int]()
    for _ in range(tries):
        port.drain()
        raw = line.listen(request, window.length + codec.STATUS_OVERHEAD, REPLY_S)
        statuses = codec.parse_statuses(raw)
        good, _ = sort_answers(statuses, (servo_id,), window.length, codec.REFUSAL)
        if not good:
            bad += bool(raw)
        elif good[servo_id].params:
            values = family.decode(window.address, good[servo_id].params)
            places.append(values["present_position"])
    # A checksum of one byte over two mixed answers may match by chance, but not the position.
    wide = bool(places) and max(places) - min(places) > family.steps_per_turn // 8
    return max(bad, SHARED if wide else 0)


def find(line: Transactions, setups: Sequence[ServoConfig]) -> dict[int, int]:
    """Find every servo and check its model; return the firmware of each.

    Raises:
        ServoMissing: some are absent or of another model; the message names all of them.
    """
    family, began_s, firmware = line.family, line.port.now_s(), dict[int, int]()
    problems = []
    for one in setups:
        identity = line.identify(one.id)
        if identity is None:
            problems.append(f"{one.label()} does not answer")
            continue
        firmware[one.id] = identity.firmware
        if identity.model_number != family.models[one.model].number:
            name = family.model_name(identity.model_number)
            problems.append(f"{one.label()} is {name}, not {one.model}")
    if problems:
        fault, remedy = "; ".join(problems), "check cables and ids, or ask gazerig doctor RIG"
        if not firmware:
            fault, remedy = "no servo answers", "check servo power, cable and baud rate"
        text = f"{line.port.port_name}: {fault}"
        raise ServoMissing(line.lateness.blame(text, remedy, line.port.now_s(), began_s))
    return firmware


def name_firmware(
    line: Transactions, setups: Sequence[ServoConfig], firmware: Mapping[int, int]
) -> list[str]:
    """Return a line for servos with an old firmware, or an older one than their like."""
    family, texts = line.family, []
    for model in dict.fromkeys(one.model for one in setups):
        own = {one.id: firmware[one.id] for one in setups if one.model == model}
        needed, newest = family.fast_read_since.get(model, 0), max(own.values())
        for version in sorted(set(own.values())):
            if version < needed:
                wanted = (
                    f"not {family.format_firmware(needed)} or later: without fast sync reads all "
                    "servos of this bus are read by plain ones, which are slower"
                )
            elif version < newest:
                wanted = f"but others of this model have {family.format_firmware(newest)}"
            else:
                continue
            named = ", ".join(
                line.label(i) for i, own_version in own.items() if own_version == version
            )
            text = f"{named}: {model} with firmware {family.format_firmware(version)}"
            texts.append(f"{text}, {wanted}: update it with {family.updater}")
    return texts
