"""The device side of Dynamixel Protocol 2.0: bytes in, bytes out, nothing opened.

Sources: ROBOTIS e-Manual, Protocol 2.0 and X series.
"""

from collections.abc import Callable, Iterable, Sequence

from gazerig.drivers.dynamixel.control_table import BAUD_RATES, EEPROM_END
from gazerig.sim_mock.dynamixel.fast_read import fast_reply
from gazerig.sim_mock.dynamixel.framing import DynamixelFraming
from gazerig.sim_mock.dynamixel.instructions import (
    BULK_READ,
    BULK_WRITE,
    CRC_ERROR,
    FAST_BULK_READ,
    FAST_SYNC_READ,
    PING,
    SYNC_READ,
    SYNC_WRITE,
    answered_from,
    bulk_rows,
    bulk_writes,
    carry_out,
    obeys_broadcast,
    sync_rows,
    sync_writes,
    touches_eeprom,
)
from gazerig.sim_mock.dynamixel.memory import ACCESS
from gazerig.sim_mock.dynamixel.packets import HEADER, fast_pieces, plain_pieces
from gazerig.sim_mock.dynamixel.quirks import DynamixelQuirks
from gazerig.sim_mock.dynamixel.servo import DynamixelServo
from gazerig.sim_mock.replies import Answer, Piece
from gazerig.sim_mock.smart_servo.chain import ServoChain, Wanted, whole_ms
from gazerig.sim_mock.smart_servo.faults import ServoFaults, commands_of
from gazerig.sim_mock.smart_servo.framing import Instruction
from gazerig.sim_mock.smart_servo.physics import ServoSpec
from gazerig.sim_mock.smart_servo.quirks import AfterMissing

COMMANDS = commands_of(252, DynamixelQuirks, reset="id 1, 57600 baud; needs torque off")
MIN_WATCHDOG_MS = 20
BAUD_AT = 8


class DynamixelChain(ServoChain[DynamixelServo, DynamixelQuirks]):
    """Dynamixel servos on one bus; ``seed``: of the random numbers that faults draw."""

    _framing: DynamixelFraming
    unreadable = ACCESS
    eeprom_end = EEPROM_END

    def __init__(
        self,
        servos: Iterable[DynamixelServo],
        now_s: Callable[[], float],
        quirks: DynamixelQuirks | None = None,
        heed_baud: bool = False,
        seed: int = 0,
    ) -> None:
        quirks = quirks or DynamixelQuirks()
        super().__init__(
            servos,
            now_s,
            quirks,
            DynamixelFraming,
            lambda chain: ServoFaults(chain, COMMANDS, seed, HEADER),
            heed_baud,
        )
        self._adopt(quirks)
        self._groups = {
            PING: lambda params: self._out(self._ping_all()),
            SYNC_READ: lambda params: self._plain(sync_rows(params)),
            FAST_SYNC_READ: lambda params: self._fast(sync_rows(params)),
            BULK_READ: lambda params: self._plain(bulk_rows(params)),
            FAST_BULK_READ: lambda params: self._fast(bulk_rows(params)),
            SYNC_WRITE: lambda params: self._write_all(sync_writes(params)),
            BULK_WRITE: lambda params: self._write_all(bulk_writes(params)),
        }

    def _adopt(self, quirks: DynamixelQuirks) -> None:
        self._framing.strict = quirks.stuffing == "strict"

    def _twin_of(self, first: DynamixelServo, spec: ServoSpec, now_ms: int) -> DynamixelServo:
        twin, settings = DynamixelServo(spec, now_ms), first.read(BAUD_AT, 2)
        assert settings is not None
        twin.write(BAUD_AT, settings)
        return twin

    def _carry_out(self, servo: DynamixelServo, code: int, params: bytes) -> tuple[int, bytes]:
        return carry_out(servo, code, params)

    def _answers(self, servo: DynamixelServo, code: int) -> bool:
        return servo.status_level >= answered_from(servo, code)

    def _obeys_broadcast(self, servo: DynamixelServo, code: int, params: bytes) -> bool:
        return obeys_broadcast(servo, code, params)

    def _for_shadows(self, code: int, params: bytes) -> bool:
        return not touches_eeprom(code, params)

    def _pieces(self, answers: Sequence[Answer]) -> list[Piece]:
        return plain_pieces(answers)

    def _execute(self, instruction: Instruction) -> list[Piece]:
        """Feed every bus watchdog, after those that have starved have tripped; then obey."""
        if instruction.code < 0:
            return self._reject(instruction.servo_id)
        if self._now_ms - self._fed_ms >= MIN_WATCHDOG_MS:
            for servo in self.servos:
                servo.advance(self._now_ms, self._fed_ms)
        self._fed_ms = self._now_ms
        return super()._execute(instruction)

    def _reject(self, servo_id: int) -> list[Piece]:
        """Meet an instruction with a wrong CRC."""
        servo = self._by_id.get(servo_id)
        if servo is None or not servo.advance(self._now_ms, self._fed_ms):
            return []
        if self.quirks.bad_crc == "silent" or servo.status_level < 2:
            return []
        error = CRC_ERROR | servo.error_flag
        return self._out([Answer(servo_id, error, b"", self._delay_s[servo_id])])

    # --- groups

    def _ping_all(self) -> list[Answer]:
        answers = (self._answer_all(i, PING, b"") for i in sorted(self._by_id))
        return [answer for answer in answers if answer is not None]

    def _fast(self, rows: Sequence[Wanted]) -> list[Piece]:
        """Answer as one packet; a servo that refuses fills its block with zeros."""
        length = 1 + sum([4 + row[2] for row in rows])
        if not self._wire.any and not self._twins:
            packet = fast_reply(self._by_id, rows, length, self._now_ms, self._fed_ms)
            return [Piece(rows[0][0], packet, self._delay_s[rows[0][0]])] if packet else []
        return self._fast_with_faults(rows, length)

    def _fast_with_faults(self, rows: Sequence[Wanted], length: int) -> list[Piece]:
        """Do the same block by block, where some are missing, spoilt or sent by two servos."""
        answers: list[Answer] = []
        for servo_id, address, size in rows:
            servo = self._by_id.get(servo_id)
            answer = self._part(servo_id, address, size) if servo and servo.fast_reads else None
            if answer is None:
                break
            answers.append(answer if answer[2] else answer._replace(params=bytes(size)))
        spoilt = fast_pieces(self._wire.spoil_answers(answers, True, self._now_s), length)
        return self._wire.spoil_pieces(spoilt, True, self._now_s)


def build_dynamixel(
    specs: Iterable[ServoSpec | tuple[int, str, float]],
    now_s: Callable[[], float],
    after_missing: AfterMissing = "silence",
    packet_gap_s: float = 0.0015,
    baud: int | None = None,
    quirks: DynamixelQuirks | None = None,
    seed: int = 0,
) -> DynamixelChain:
    """Build servos and their bus; a plain tuple is (id, model, start position in steps).

    With a baud rate the servos are set to it, return delay and all else as from the
    factory, and only clients at their rate are heard; without one every client is.
    ``quirks`` instead of ``after_missing`` and ``packet_gap_s`` chooses all cases at once.

    Raises:
        ValueError: not all of these servos know this baud rate.
    """
    now_ms = whole_ms(now_s())
    servos = [DynamixelServo(ServoSpec(*spec), now_ms) for spec in specs]
    if baud is not None:
        if baud not in BAUD_RATES:
            raise ValueError(f"baud {baud}: servos know {', '.join(map(str, BAUD_RATES))}")
        for servo in servos:
            if servo.write(BAUD_AT, bytes((BAUD_RATES.index(baud),))):
                raise ValueError(f"baud {baud}: {servo.model.name} does not know it")
    quirks = quirks or DynamixelQuirks(after_missing=after_missing, packet_gap_s=packet_gap_s)
    return DynamixelChain(servos, now_s, quirks, baud is not None, seed)
