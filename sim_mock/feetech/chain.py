"""The device side of a bus of Feetech servos: bytes in, bytes out, nothing opened.

Source: Feetech, communication protocol of the STS/SMS series.
"""

from collections.abc import Callable, Iterable, Sequence

from gazerig.drivers.feetech.memory_table import HIGHEST_ID
from gazerig.sim_mock.feetech.instructions import (
    PING,
    SYNC_READ,
    SYNC_WRITE,
    answers,
    carry_out,
    sync_rows,
    sync_writes,
)
from gazerig.sim_mock.feetech.packets import HEADER, FeetechFraming, pieces
from gazerig.sim_mock.feetech.quirks import FeetechQuirks
from gazerig.sim_mock.feetech.servo import FeetechServo
from gazerig.sim_mock.replies import Answer, Piece
from gazerig.sim_mock.smart_servo.chain import ServoChain, whole_ms
from gazerig.sim_mock.smart_servo.faults import ServoFaults, commands_of
from gazerig.sim_mock.smart_servo.physics import ServoSpec

COMMANDS = commands_of(HIGHEST_ID, FeetechQuirks, without=("shock",), reset="id 1, 1000000 bit/s")


class FeetechChain(ServoChain[FeetechServo, FeetechQuirks]):
    """Feetech servos on one bus; ``seed``: of the random numbers that faults draw."""

    def __init__(
        self,
        servos: Sequence[FeetechServo],
        now_s: Callable[[], float],
        heed_baud: bool = False,
        seed: int = 0,
    ) -> None:
        super().__init__(
            servos,
            now_s,
            servos[0].quirks if servos else FeetechQuirks(),
            FeetechFraming,
            lambda chain: ServoFaults(chain, COMMANDS, seed, HEADER),
            heed_baud,
        )
        self._groups = {
            PING: lambda params: self._ping_all(),
            SYNC_READ: lambda params: self._plain(sync_rows(params)),
            SYNC_WRITE: lambda params: self._write_all(sync_writes(params)),
        }

    def _adopt(self, quirks: FeetechQuirks) -> None:
        for servo in self.servos:
            servo.adopt(quirks)

    def _twin_of(self, first: FeetechServo, spec: ServoSpec, now_ms: int) -> FeetechServo:
        twin = FeetechServo(spec, now_ms, self.quirks)
        for name in ("baud_rate", "return_delay"):
            twin.memory.keep(name, first.memory.get(name))
        return twin

    def _carry_out(self, servo: FeetechServo, code: int, params: bytes) -> tuple[int, bytes] | None:
        data = carry_out(servo, code, params)
        return None if data is None else (0, data)

    def _answers(self, servo: FeetechServo, code: int) -> bool:
        return answers(servo, code)

    def _pieces(self, answers: Sequence[Answer]) -> list[Piece]:
        return pieces(answers)

    def _part(self, servo_id: int, address: int, length: int) -> Answer | None:
        servo = self._by_id.get(servo_id)
        if servo is not None and not servo.table.sync_read:
            return None
        return super()._part(servo_id, address, length)

    def _ping_all(self) -> list[Piece]:
        """Answer a ping to all as the quirks say."""
        policy = self.quirks.broadcast_ping
        if policy == "silence":
            return []
        found = [self._answer_all(servo_id, PING, b"") for servo_id in sorted(self._by_id)]
        said = [answer for answer in found if answer is not None]
        if policy == "mix" and said:
            mixed = said[0]
            for answer in said[1:]:
                mixed = answer._replace(twin=mixed)
            said = [mixed]
        return self._out(said)


def build_feetech(
    specs: Iterable[ServoSpec | tuple[int, str, float]],
    now_s: Callable[[], float],
    baud: int | None = None,
    seed: int = 0,
) -> FeetechChain:
    """Build servos and their bus; a plain tuple is (id, model, start position in steps).

    With a baud rate the servos are set to it, all else as from the factory, and only
    clients at their rate are heard; without one every client is.

    Raises:
        ValueError: there is no such model, id or baud rate.
    """
    now_ms, quirks = whole_ms(now_s()), FeetechQuirks()
    servos = [FeetechServo(ServoSpec(*spec), now_ms, quirks) for spec in specs]
    if baud is not None:
        for servo in servos:
            rates = servo.table.baud_rates
            if baud not in rates:
                raise ValueError(
                    f"baud {baud}: {servo.model.name} knows {', '.join(map(str, rates))}"
                )
            servo.memory.keep("baud_rate", rates.index(baud))
    return FeetechChain(servos, now_s, baud is not None, seed)
