"""Search for a new servo, alone or in a chain, and assignment of its id and baud rate.

A servo is connected alone, or it is the factory-new spare of the only servo that a chain misses:
two servos with the same id appear as one, and both would receive the new id.

Id and baud rate take effect immediately, after the status packet of their own write. The id comes
first: in a chain the servo is alone at the factory's baud rate, but perhaps not with its id at the
chain's. If the memory has a lock, they are written with it open; otherwise they would be lost at
the next power-off. It is closed under the new id and at the new rate. Sources: ROBOTIS e-Manual;
Feetech memory table STS3215.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from gazerig.drivers.bus.servo_models import FAMILY_OF, servo_label
from gazerig.drivers.errors import PortError, ServoFault, ServoMissing
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.discovery import (
    SHARED,
    FoundServo,
    count_corrupt,
    has_any_reply,
    ping,
    scan_ids,
)
from gazerig.drivers.servo_bus.transaction import Transactions
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.servo_kinds import ServoKind, Tell

FACTORY_ID = 1
"""Id of a new servo."""


class Answers(NamedTuple):
    """Answers at one baud rate.

    junk: bytes that are not part of an answer; shared_ids: ids that two servos seem to have
    """

    found: tuple[FoundServo, ...] = ()
    junk: int = 0
    shared_ids: tuple[int, ...] = ()

    @property
    def is_spoilt(self) -> bool:
        """Return whether two servos may have answered at the same time."""
        return bool(self.junk or self.shared_ids)


def search_rate(
    port: BusPort, kind: ServoKind, baud: int, thorough: bool = False
) -> Answers | None:
    """Find all connected servos at a baud rate, None if the adaptor does not support it.

    thorough: read every id even if no servo answers a broadcast ping

    Raises:
        PortError: the port cannot be opened.
        BusLost: it has disappeared.
    """
    family = kind.family
    if not port.setBaudRate(baud):
        return None
    if not thorough and not has_any_reply(port, family):
        return Answers()
    found, junk = scan_ids(port, family, baud)
    tables = {one.id: FAMILY_OF.get(one.model, family) for one in found}
    twice = {i for i in tables if [one.id for one in found].count(i) > 1}
    shared = (i for i, table in tables.items() if count_corrupt(port, table, i) >= SHARED)
    return Answers(found, junk, tuple(sorted({*twice, *shared})))


def search_rates(
    port: BusPort, kind: ServoKind, bauds: Sequence[int], tell: Tell, thorough: bool = False
) -> dict[int, Answers]:
    """Find all connected servos at some baud rates; return the answers by rate.

    thorough: see ``search_rate``; only until a servo has answered
    """
    found: dict[int, Answers] = {}
    for baud in bauds:
        tell(f"asking at {baud} bit/s")
        wanted = thorough and not any(one.found for one in found.values())
        found[baud] = search_rate(port, kind, baud, wanted) or Answers()
    return found


def search_all(port: BusPort, kind: ServoKind, baud: int, tell: Tell) -> dict[int, Answers]:
    """Find all connected servos at any baud rate, the factory's and that of a bus first."""
    order = dict.fromkeys((kind.family.factory_baud, baud, *kind.family.baud_rates))
    return search_rates(port, kind, list(order), tell, thorough=True)


def find_spare(
    port: BusPort,
    kind: ServoKind,
    chain: Sequence[ServoConfig],
    baud: int,
    answers: Mapping[int, Answers],
) -> tuple[FoundServo, ServoConfig] | None:
    """Return the factory-new servo in the place of the only missing one, and that one's setup.

    None if not exactly one servo of the chain is missing, if not exactly one other answers, if
    that is not new or has another model, or if any answers are spoilt. After an interrupted
    assignment it has its new id at the factory's rate.

    Args:
        port: open port; at the chain's rate afterwards if a servo was found.
        kind: kind of the servos.
        chain: setups of all servos of the chain.
        baud: baud rate of the chain.
        answers: answers at all baud rates.
    """
    others = {(servo.id, servo.baud): servo for one in answers.values() for servo in one.found}
    missing = [setup for setup in chain if others.pop((setup.id, baud), None) is None]
    if (len(missing), len(others)) != (1, 1) or any(one.is_spoilt for one in answers.values()):
        return None
    (setup,), (spare,) = missing, others.values()
    is_new = spare.baud == kind.family.factory_baud and spare.id in (FACTORY_ID, setup.id)
    if not is_new or spare.number != kind.family.models[setup.model].number:
        return None
    # The answer of the missing one may only have been lost.
    open_at(port, baud)
    return None if ping(port, kind.family, setup.id, baud) else (spare, setup)


def find_alone(answers: Mapping[int, Answers], where: str) -> FoundServo:
    """Return the only servo that answered on the port ``where``.

    Raises:
        ServoMissing: no servo or more than one answered.
    """
    found = [servo for one in answers.values() for servo in one.found]
    named = [f"id {one.id} ({one.model}) at {one.baud} bit/s" for one in found]
    named += [f"two as id {i}" for one in answers.values() for i in one.shared_ids]
    if len(named) > 1:
        raise ServoMissing(f"{where}: several servos answer: {', '.join(named)}: connect one alone")
    if not found and any(one.is_spoilt for one in answers.values()):
        raise ServoMissing(
            f"{where}: answers in pieces only: connect one servo alone, and check its plug"
        )
    if not found:
        raise ServoMissing(
            f"{where}: no servo answers at any baud rate: is its supply on, its plug in?"
        )
    return found[0]


def refuse_model(found: FoundServo, kind: ServoKind, setup: ServoConfig, where: str) -> None:
    """Refuse a servo of another model than the joint's.

    Raises:
        ServoMissing: the model is another one.
    """
    if found.number != kind.family.models[setup.model].number:
        raise ServoMissing(
            f"{where}: this is {found.model}, {servo_label(setup)} wants {setup.model}: "
            "connect the right one, or correct the model in the YAML"
        )


def assign_servo(
    port: BusPort, kind: ServoKind, found: FoundServo, setup: ServoConfig, baud: int, tell: Tell
) -> tuple[FoundServo, list[str]]:
    """Assign the id of a joint and the bus's baud rate to the servo, and verify them.

    Returns the servo as it answers then, and the written values.

    Its torque is switched off. The message of every failure has the present id and rate.

    Raises:
        ServoMissing: the servo has another model, or does not answer afterwards.
        ServoFault: it refuses.
        PortError: the adaptor does not support a rate.
        BusLost: the port has disappeared.
    """
    refuse_model(found, kind, setup, port.port_name)
    line, family, done = Transactions(port, kind.family), kind.family, list[str]()
    now_id, now_baud = found.id, found.baud

    def require(confirmed: bool, what: str) -> None:
        if not confirmed:
            reason = f"error {line.refusal}" if line.refusal else "no answer"
            raise ServoFault(
                f"{port.port_name}: the servo does not {what} ({reason}); it answered last as id "
                f"{now_id} at {now_baud} bit/s: switch its power off and on and try again"
            )

    def lock(value: int, what: str) -> None:
        if family.lock_register is not None:
            require(line.write(now_id, family.lock_register, value), what)

    open_at(port, now_baud)
    # It then replies to every instruction.
    line.write_all((now_id,), "status_return_level", [family.answer_level])
    if line.read(now_id, "torque_enable"):
        require(line.write(now_id, "torque_enable", 0), "let its torque go")
        done.append("torque 1 -> 0")
    if now_id != setup.id:
        tell(f"id {now_id} -> {setup.id}")
        lock(0, "open its lock")
        # The confirmation may arrive from either id, or be lost.
        confirmed = line.write(now_id, "id", setup.id)
        confirmed = confirmed or ping(port, family, setup.id, now_baud) is not None
        require(confirmed, f"take the id {setup.id}")
        done.append(f"id {now_id} -> {setup.id}")
        now_id = setup.id
    rate = family.baud_rates.index(baud)
    if now_baud != baud or line.read(now_id, "baud_rate") != rate:
        tell(f"baud rate {now_baud} -> {baud}")
        lock(0, "open its lock")
        # Silence may only be a lost confirmation.
        require(line.write(now_id, "baud_rate", rate) or not line.refusal, f"take {baud} bit/s")
        done.append(f"baud rate {now_baud} -> {baud} bit/s")
        now_baud = baud
        open_at(port, baud)
    seen = ping(port, family, now_id, now_baud)
    if seen is None or seen.number != found.number:
        raise ServoMissing(
            f"{port.port_name}: the servo does not answer as id {now_id} at {now_baud} bit/s: "
            "gazerig scan finds it"
        )
    lock(1, "close its lock")
    return seen, done


def open_at(port: BusPort, baud: int) -> None:
    """Open a port at a baud rate.

    Raises:
        PortError: it cannot be opened, or does not support the rate.
    """
    if not port.setBaudRate(baud):
        raise PortError(f"{port.port_name} cannot run at {baud} bit/s: choose another rate")
