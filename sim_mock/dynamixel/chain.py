"""The device side of Dynamixel Protocol 2.0: bytes in, bytes out, nothing opened.

Where documents and devices are silent or differ, the choice is one of ``DynamixelQuirks``. A
client whose baud rate is not a servo's neither hears it nor is heard. Sources: ROBOTIS
e-Manual, Protocol 2.0 and X series.
"""

from collections.abc import Callable, Iterable, Sequence

from drivers.dynamixel.control_table import BAUD_RATES, EEPROM_END
from sim_mock.device import Reply
from sim_mock.dynamixel.fast_read import fast_reply
from sim_mock.dynamixel.framing import Framing, Instruction
from sim_mock.dynamixel.instructions import (
    BULK_READ,
    BULK_WRITE,
    CRC_ERROR,
    FAST_BULK_READ,
    FAST_SYNC_READ,
    PING,
    SYNC_READ,
    SYNC_WRITE,
    Wanted,
    answered_from,
    bulk_rows,
    bulk_writes,
    carry_out,
    obeys_broadcast,
    sync_rows,
    sync_writes,
    touches_eeprom,
)
from sim_mock.dynamixel.memory import ACCESS
from sim_mock.dynamixel.quirks import AfterMissing, DynamixelQuirks, chosen
from sim_mock.dynamixel.servo import DynamixelServo
from sim_mock.replies import BROADCAST, Answer, Piece, fast_pieces, plain_pieces, status
from sim_mock.smart_servo.addresses import Roster, hears
from sim_mock.smart_servo.fault_commands import COMMANDS
from sim_mock.smart_servo.faults import Faults
from sim_mock.smart_servo.physics import ServoSpec

__all__ = ["DynamixelQuirks", "Reply", "DynamixelChain", "build_dynamixel", "status", "whole_ms"]

MIN_WATCHDOG_MS = 20
BAUD_AT = 8
TWIN_AWAY_STEPS = 257
"""A second servo with a taken id stands so far from the first, so that they differ."""


class DynamixelChain:
    """Servos on one bus.

    Args:
        servos: any order; servos with one id answer at the same time.
        now_s: the chain's clock.
        quirks: what servos do where documents and devices differ.
        heed_baud: only a client at a servo's baud rate is heard; else every client is.
        seed: of the dice that faults throw.
    """

    def __init__(
        self,
        servos: Iterable[DynamixelServo],
        now_s: Callable[[], float],
        quirks: DynamixelQuirks | None = None,
        heed_baud: bool = False,
        seed: int = 0,
    ) -> None:
        self.servos = tuple(servos)
        self.now_s = now_s
        self.quirks = quirks or DynamixelQuirks()
        self.heed_baud = heed_baud
        self.faults = Faults(self, COMMANDS, seed)
        self._wire = self.faults.wire
        self._framing = Framing(self.quirks.packet_gap_s, now_s())
        self._now_s = now_s()
        self._now_ms = self._fed_ms = whole_ms(self._now_s)
        self._client_baud: int | None = None
        self.refresh()
        self._group: dict[int, Callable[[bytes], list[Piece]]] = {
            PING: lambda params: self._plain_out(self._ping_all()),
            SYNC_READ: lambda params: self._plain(sync_rows(params)),
            FAST_SYNC_READ: lambda params: self._fast(sync_rows(params)),
            BULK_READ: lambda params: self._plain(bulk_rows(params)),
            FAST_BULK_READ: lambda params: self._fast(bulk_rows(params)),
            SYNC_WRITE: lambda params: self._write_all(sync_writes(params)),
            BULK_WRITE: lambda params: self._write_all(bulk_writes(params)),
        }

    # --- who is there

    def refresh(self) -> None:
        """Look again at ids, bauds and return delays; needed after changes from outside."""
        roster = Roster(self.servos, self._client_baud if self.heed_baud else None)
        self._roster = roster
        self._by_id, self._twins, self._delay_s = roster.by_id, roster.twins, roster.delay_s

    def hears(self, client_baud: int) -> bool:
        """Tell whether any servo understands a client at this baud rate."""
        return not self.heed_baud or any(hears(servo, client_baud) for servo in self.servos)

    def __getitem__(self, servo_id: int) -> DynamixelServo:
        """Give a servo by its id, as it was when last looked at."""
        for servo in self.servos:
            if servo.id == servo_id:
                return servo
        raise KeyError(f"no servo {servo_id}; there is {', '.join(map(str, self.ids()))}")

    def here(self, servo_id: int) -> DynamixelServo:
        """Give a servo by its id, brought up to now."""
        servo = self[servo_id]
        servo.advance(whole_ms(self.now_s()), self._fed_ms)
        return servo

    def ids(self) -> tuple[int, ...]:
        """List the ids in the order of the servos."""
        return tuple(servo.id for servo in self.servos)

    def join(self, servo_id: int) -> None:
        """Put a second servo with a taken id on the bus, a little turned from the first."""
        first, now_ms = self.here(servo_id), whole_ms(self.now_s())
        start = (first.position_steps + TWIN_AWAY_STEPS) % 4096
        twin = DynamixelServo(ServoSpec(servo_id, first.model.name, start, first.firmware), now_ms)
        settings = first.read(BAUD_AT, 2)
        assert settings is not None
        twin.write(BAUD_AT, settings)
        self.servos = (*self.servos, twin)
        self.refresh()

    def choose(self, case: str, value: str) -> None:
        """Choose one of the quirks by its name, or whether baud rates are heeded.

        Raises:
            ValueError: there is no such case or value.
        """
        if case == "baud":
            if value not in ("heed", "any"):
                raise ValueError(f"baud {value!r}: it can be heed, any")
            self.heed_baud = value == "heed"
            self.refresh()
            return
        self.quirks = chosen(self.quirks, case, value)
        self._framing.gap_s = self.quirks.packet_gap_s

    def positions_steps(self) -> tuple[float, ...]:
        """Give the true positions now, in the order of ``servos``."""
        now_ms = whole_ms(self.now_s())
        for servo in self.servos:
            servo.advance(now_ms, self._fed_ms)
        return tuple(servo.position_steps for servo in self.servos)

    # --- bytes

    def receive(self, data: bytes, client_baud: int | None = None) -> bytes:
        """Take bytes off the wire and give the bytes all servos answer with."""
        replies = self.exchange(data, client_baud)
        return b"".join([piece[1] for reply in replies for piece in reply[1]])

    def exchange(self, data: bytes, client_baud: int | None = None) -> list[Reply]:
        """Take bytes off the wire and give what is answered to each instruction in them."""
        now_s = self._now_s = self.now_s()
        self._now_ms = whole_ms(now_s)
        if client_baud != self._client_baud:
            self._client_baud = client_baud
            self._framing.forget()
            self.refresh()
        if not self._by_id:
            return self._garbage(data)
        found = self._framing.feed(data, now_s, self.quirks.stuffing == "strict")
        replies = [Reply(i.end, pieces) for i in found if (pieces := self._execute(i))]
        return self.faults.around(replies, data) if self._wire.any else replies

    def _garbage(self, data: bytes) -> list[Reply]:
        """Answer a client that no servo understands: nothing, or the ruins of its own bytes."""
        if self.quirks.wrong_baud == "silence" or not data:
            return []
        return [Reply(len(data), [Piece(-1, bytes(b & 0x6E | 0x80 for b in data[::2]))])]

    def _execute(self, instruction: Instruction) -> list[Piece]:
        """Let the addressed servos carry out one instruction; gives what they send."""
        servo_id, code, params, _ = instruction
        if code < 0:
            return self._reject(servo_id)
        self._feed()
        if servo_id != BROADCAST:
            answer = self._answer_all(servo_id, code, params)
            return self._plain_out([answer]) if answer is not None else []
        if code in self._group:
            return self._group[code](params)
        for servo in self._roster.everyone():
            if obeys_broadcast(servo, code, params):
                self._answer(servo, code, params)
        return []

    def _reject(self, servo_id: int) -> list[Piece]:
        """Meet an instruction with a wrong CRC."""
        servo = self._awake(servo_id)
        if servo is None or self.quirks.bad_crc == "silent" or servo.status_level < 2:
            return []
        error = CRC_ERROR | servo.error_flag
        return self._plain_out([Answer(servo_id, error, b"", self._delay_s[servo_id])])

    def _feed(self) -> None:
        """Feed every bus watchdog, after those that have starved have tripped."""
        if self._now_ms - self._fed_ms >= MIN_WATCHDOG_MS:
            for servo in self.servos:
                servo.advance(self._now_ms, self._fed_ms)
        self._fed_ms = self._now_ms

    def _awake(self, servo_id: int) -> DynamixelServo | None:
        """Give the servo with this id brought up to now, None where there is none or it is deaf."""
        servo = self._by_id.get(servo_id)
        if servo is not None and servo.advance(self._now_ms, self._fed_ms):
            return servo
        return None

    def _silent(self, servo_id: int) -> bool:
        """Tell whether a fault keeps this servo from answering."""
        return self._wire.any and self._wire.take("lose", servo_id, self._now_s) is not None

    # --- one id

    def _answer_all(self, servo_id: int, code: int, params: bytes) -> Answer | None:
        """Let all servos that listen to an id carry out an instruction."""
        # Looked up first: the instruction may change who has this id.
        servo, twins = self._by_id.get(servo_id), self._twins.get(servo_id, ())
        shadows = self._roster.shadows.get(servo_id, ())
        answer = None if servo is None else self._answer(servo, code, params)
        for twin in twins:
            other = self._answer(twin, code, params)
            answer = other if answer is None else answer._replace(twin=other)
        for shadow in shadows:
            if not touches_eeprom(code, params):
                self._answer(shadow, code, params)
        return None if answer is None or self._silent(servo_id) else answer

    def _answer(self, servo: DynamixelServo, code: int, params: bytes) -> Answer | None:
        """Let one servo carry out an instruction; gives what it says, None where it is silent."""
        if not servo.advance(self._now_ms, self._fed_ms):
            return None
        # Flags, level, id and delay as they were before: an answer leaves under the old settings.
        level, flag, servo_id = servo.status_level, servo.error_flag, servo.id
        delay_s = self._delay_s[servo_id]
        error, data = carry_out(servo, code, params)
        if touches_eeprom(code, params):
            self.refresh()
        if level < answered_from(servo, code):
            return None
        return Answer(servo_id, error | flag, data, delay_s)

    # --- groups

    def _ping_all(self) -> list[Answer]:
        answers = (self._answer_all(i, PING, b"") for i in sorted(self._by_id))
        return [answer for answer in answers if answer is not None]

    def _part(self, servo_id: int, address: int, length: int) -> Answer | None:
        """Give a servo's part of a group read, None where it is silent."""
        servo = self._awake(servo_id)
        if servo is None or servo.status_level < 1 or self._silent(servo_id):
            return None
        answer = self._seen(servo, address, length)
        for twin in self._twins.get(servo_id, ()) if self._twins else ():
            if twin.advance(self._now_ms, self._fed_ms):
                answer = answer._replace(twin=self._seen(twin, address, length))
        return answer

    def _seen(self, servo: DynamixelServo, address: int, length: int) -> Answer:
        data, servo_id, flag = servo.read(address, length), servo.id, servo.error_flag
        if data is None:
            return Answer(servo_id, flag | ACCESS, b"", self._delay_s[servo_id])
        return Answer(servo_id, flag, data, self._delay_s[servo_id])

    def _plain(self, rows: Sequence[Wanted]) -> list[Piece]:
        """Answer with one status a servo, in the order asked."""
        answers, late_s, policy = [], 0.0, self.quirks.after_missing
        for servo_id, address, length in rows:
            answer = self._part(servo_id, address, length)
            if answer is not None:
                answers.append(answer if late_s == 0.0 else answer._replace(late_s=late_s))
                late_s = 0.0
            elif policy == "silence":
                break
            elif policy == "timeout":
                late_s += self.quirks.slot_timeout_s
        return self._plain_out(answers)

    def _plain_out(self, answers: list[Answer]) -> list[Piece]:
        if not self._wire.any:
            return plain_pieces(answers)
        spoilt = plain_pieces(self._wire.spoil_answers(answers, False, self._now_s))
        return self._wire.spoil_pieces(spoilt, False, self._now_s)

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

    def _write_all(self, writes: Sequence[tuple[int, int, bytes]]) -> list[Piece]:
        """Carry out a group write; nobody answers."""
        if self._wire.any and self._wire.take("lose_writes", None, self._now_s):
            return []
        changed = False
        for servo_id, address, data in writes:
            self._write_at(servo_id, address, data)
            changed = changed or address < EEPROM_END
        if changed:
            self.refresh()
        return []

    def _write_at(self, servo_id: int, address: int, data: bytes) -> None:
        """Write one servo's part of a group write, in everyone who listens to the id."""
        servo = self._awake(servo_id)
        if servo is not None:
            servo.write(address, data)
        roster = self._roster
        if not roster.twins and not roster.shadows:
            return
        shadows = roster.shadows.get(servo_id, ()) if address >= EEPROM_END else ()
        for other in (*roster.twins.get(servo_id, ()), *shadows):
            if other.advance(self._now_ms, self._fed_ms):
                other.write(address, data)


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


def whole_ms(now_s: float) -> int:
    """Give the whole milliseconds of a time; the margin keeps 0.005 s from being 4 ms."""
    return int(now_s * 1000.0 + 1e-3)
