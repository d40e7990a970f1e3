"""Search for the only connected servo, and assignment of its id and baud rate.

Only one servo may be connected: two servos with the same id appear as one, and both would receive
the new id.

Id and baud rate take effect immediately, after the status packet of their own write. If the memory
has a lock, they are written with it open; otherwise they would be lost at the next power-off. It is
closed under the new id and at the new rate. Sources: ROBOTIS e-Manual; Feetech memory table
    STS3215.
"""

from collections.abc import Sequence
from typing import NamedTuple

from gazerig.drivers.bus.servo_models import servo_label
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
from gazerig.drivers.servo_bus.registers import Registers
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.servo_kinds import ServoKind, Tell


class SetupResult(NamedTuple):
    """Result for one servo: its state before and now, and the written values."""

    before: FoundServo
    after: FoundServo
    changes: tuple[str, ...]


def search_order(kind: ServoKind, baud: int) -> tuple[int, ...]:
    """List all baud rates, the most likely ones first."""
    return tuple(dict.fromkeys((kind.family.factory_baud, baud, *kind.family.scan_rates)))


def find_alone(port: BusPort, kind: ServoKind, bauds: Sequence[int], tell: Tell) -> FoundServo:
    """Find the only connected servo, at any id and baud rate; all rates are searched.

    Raises:
        ServoMissing: no servo or more than one answers.
        PortError: the port cannot be opened.
        BusLost: it has disappeared.
    """
    found: list[FoundServo] = []
    junk = 0
    for baud in bauds:
        tell(f"asking at {baud} bit/s")
        if not port.setBaudRate(baud) or (found and not has_any_reply(port, kind.family)):
            continue
        answers, noise = scan_ids(port, kind.family, baud)
        found += answers
        junk += noise
        shared = answers and count_corrupt(port, kind.family, answers[0].id) >= SHARED
        found += [answers[0]] if shared else []
    where = port.port_name
    if len(found) > 1:
        named = [f"id {one.id} ({one.model}) at {one.baud} bit/s" for one in found]
        crowd = f"{len(named)} servos answer: {', '.join(named)}"
        if len(set(named)) < len(named):
            crowd = f"two servos answer as {named[0]}"
        raise ServoMissing(f"{where}: {crowd}: connect one servo alone")
    if not found and junk:
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
) -> SetupResult:
    """Assign the id of a joint and the bus's baud rate to the servo, and verify them.

    Its torque is switched off. The message of every failure has the present id and rate.

    Raises:
        ValueError: the id or baud rate does not exist.
        ServoMissing: the servo has another model, or does not answer afterwards.
        ServoFault: it refuses.
        PortError: the adaptor does not support a rate.
        BusLost: the port has disappeared.
    """
    refuse_model(found, kind, setup, port.port_name)
    if not 0 <= setup.id <= kind.family.highest_id:
        raise ValueError(f"id {setup.id} is not in 0..{kind.family.highest_id}")
    if baud not in kind.family.baud_rates:
        raise ValueError(f"{baud} bit/s is none of {', '.join(map(str, kind.family.baud_rates))}")
    return _Assignment(port, kind, found).carry_out(setup.id, baud, tell)


class _Assignment:
    """Assignment of id and baud rate to one servo alone on a line."""

    def __init__(self, port: BusPort, kind: ServoKind, found: FoundServo) -> None:
        self._port, self._kind, self._found = port, kind, found
        self._registers = Registers(port, kind.family)
        self._id, self._baud = found.id, found.baud
        self._done: list[str] = []

    def carry_out(self, servo_id: int, baud: int, tell: Tell) -> SetupResult:
        """Write the differences, and verify that the servo answers with them."""
        registers, kind = self._registers, self._kind
        self._open(self._found.baud)
        # It then replies to every instruction.
        registers.write_all((self._id,), "status_return_level", kind.family.answer_level)
        if registers.read(self._id, "torque_enable"):
            if not registers.write(self._id, "torque_enable", 0):
                raise self._refusal("let its torque go")
            self._done.append("torque 1 -> 0")
        if self._id != servo_id:
            tell(f"id {self._id} -> {servo_id}")
            self._unlock()
            written = registers.write(self._id, "id", servo_id)
            # The confirmation may arrive from either id, or be lost.
            if not written and ping(self._port, kind.family, servo_id, self._baud, 2) is None:
                raise self._refusal(f"take the id {servo_id}")
            self._done.append(f"id {self._id} -> {servo_id}")
            self._id = servo_id
        rate = kind.family.baud_rates.index(baud)
        if self._baud != baud or registers.read(self._id, "baud_rate") != rate:
            tell(f"baud rate {self._baud} -> {baud}")
            self._unlock()
            # Silence may only be a lost confirmation.
            if not registers.write(self._id, "baud_rate", rate) and registers.refusal:
                raise self._refusal(f"take {baud} bit/s")
            self._done.append(f"baud rate {self._baud} -> {baud} bit/s")
            self._baud = baud
            self._open(baud)
        seen = ping(self._port, kind.family, self._id, self._baud, 3)
        if seen is None or seen.number != self._found.number:
            raise ServoMissing(
                f"{self._port.port_name}: the servo does not answer as id {self._id} at "
                f"{self._baud} bit/s: gazerig scan finds it"
            )
        if kind.family.lock_register is not None and not registers.write_if_different(
            self._id, kind.family.lock_register, 1
        ):
            raise self._refusal("close its lock")
        return SetupResult(self._found, seen, tuple(self._done))

    def _unlock(self) -> None:
        lock = self._kind.family.lock_register
        if lock is not None and not self._registers.write(self._id, lock, 0):
            raise self._refusal("open its lock")

    def _open(self, baud: int) -> None:
        if not self._port.setBaudRate(baud):
            raise PortError(
                f"{self._port.port_name} cannot run at {baud} bit/s: choose another rate"
            )

    def _refusal(self, what: str) -> ServoFault:
        refusal = self._registers.refusal
        reason = f"error {refusal}" if refusal else "no answer"
        return ServoFault(
            f"{self._port.port_name}: the servo does not {what} ({reason}); it answered last as id "
            f"{self._id} at {self._baud} bit/s: switch its power off and on and try again"
        )
