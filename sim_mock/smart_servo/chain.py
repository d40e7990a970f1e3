"""The device side of a bus of smart servos: bytes in, bytes out, nothing opened.

Where documents and devices are silent or differ, the choice is one of ``ChainQuirks``. A
client whose baud rate is not a servo's neither hears it nor is heard.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Generic, TypeVar

from gazerig.sim_mock.device import Reply
from gazerig.sim_mock.faults.active import NOBODY
from gazerig.sim_mock.replies import BROADCAST, Answer, Piece
from gazerig.sim_mock.smart_servo.addresses import Addresses, hears
from gazerig.sim_mock.smart_servo.faults import ServoFaults
from gazerig.sim_mock.smart_servo.framing import Framing, Instruction
from gazerig.sim_mock.smart_servo.physics import ServoSpec
from gazerig.sim_mock.smart_servo.quirks import ChainQuirks, decided
from gazerig.sim_mock.smart_servo.servo import SmartServo

TWIN_AWAY_STEPS = 257
"""A second servo with a taken id stands so far from the first, so that they differ."""

Wanted = tuple[int, int, int]
"""id, address, length of one servo's part of a group read."""

S = TypeVar("S", bound=SmartServo)
Q = TypeVar("Q", bound=ChainQuirks)


class ServoChain(ABC, Generic[S, Q]):
    """Servos on one bus.

    Args:
        servos: any order; servos with one id answer at the same time.
        now_s: the chain's clock.
        quirks: what servos do where documents and devices differ.
        heed_baud: only a client at a servo's baud rate is heard; else every client is.
        framing: packets of this make of servos.
        faults: faults of this make of servos.
    """

    unreadable = 0
    """Error number of a read that touches what is not there."""
    eeprom_end = 0
    """Writes below are not for those who listen under a secondary id."""

    def __init__(
        self,
        servos: Iterable[S],
        now_s: Callable[[], float],
        quirks: Q,
        framing: type[Framing],
        faults: Callable[[Any], ServoFaults],
        heed_baud: bool = False,
    ) -> None:
        self.servos = tuple(servos)
        self.now_s = now_s
        self.quirks = quirks
        self.heed_baud = heed_baud
        self.faults = faults(self)
        self._wire = self.faults.wire
        self._now_s = now_s()
        self._now_ms = self._fed_ms = whole_ms(self._now_s)
        self._framing = framing(quirks.packet_gap_s, self._now_s)
        self._client_baud: int | None = None
        self._groups: dict[int, Callable[[bytes], list[Piece]]] = {}
        for servo in self.servos:
            servo.on_address = self._readdressed
        self.refresh()

    # --- who is there

    def refresh(self) -> None:
        """Look again at ids, bauds and return delays; needed after changes from outside."""
        self._stale = False
        known = Addresses(self.servos, self._client_baud if self.heed_baud else None)
        self._known = known
        self._by_id, self._twins, self._delay_s = known.by_id, known.twins, known.delay_s

    def _readdressed(self) -> None:
        """Look again before the next instruction: until then the old settings hold."""
        self._stale = True

    def hears(self, client_baud: int) -> bool:
        """True if any servo understands a client at this baud rate."""
        return not self.heed_baud or any(hears(servo, client_baud) for servo in self.servos)

    def __getitem__(self, servo_id: int) -> S:
        """Return a servo by its id, as it was when last looked at."""
        for servo in self.servos:
            if servo.id == servo_id:
                return servo
        raise KeyError(f"no servo {servo_id}; there is {', '.join(map(str, self.ids()))}")

    def here(self, servo_id: int) -> S:
        """Return a servo by its id, brought up to now."""
        servo = self[servo_id]
        servo.advance(whole_ms(self.now_s()), self._fed_ms)
        return servo

    def ids(self) -> tuple[int, ...]:
        """Return the ids in the order of the servos."""
        return tuple(servo.id for servo in self.servos)

    def join(self, servo_id: int) -> None:
        """Put a second servo with a taken id on the bus, a little turned from the first."""
        first, now_ms = self.here(servo_id), whole_ms(self.now_s())
        start = (first.position_steps + TWIN_AWAY_STEPS) % 4096
        twin = self._twin_of(
            first, ServoSpec(servo_id, first.model.name, start, first.firmware), now_ms
        )
        twin.on_address = self._readdressed
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
        self.quirks = decided(self.quirks, case, value)
        self._framing.gap_s = self.quirks.packet_gap_s
        self._adopt(self.quirks)

    def positions_steps(self) -> tuple[float, ...]:
        """Return the true positions now, in the order of ``servos``."""
        now_ms = whole_ms(self.now_s())
        for servo in self.servos:
            servo.advance(now_ms, self._fed_ms)
        return tuple(servo.position_steps for servo in self.servos)

    # --- what a make of servos adds

    @abstractmethod
    def _twin_of(self, first: S, spec: ServoSpec, now_ms: int) -> S:
        """Return a second servo with the line settings of the first."""

    @abstractmethod
    def _carry_out(self, servo: S, code: int, params: bytes) -> tuple[int, bytes] | None:
        """Let an awake servo carry out an instruction; error number and data, None for nothing."""

    @abstractmethod
    def _answers(self, servo: S, code: int) -> bool:
        """True if a servo answers an instruction to it alone."""

    @abstractmethod
    def _pieces(self, answers: Sequence[Answer]) -> list[Piece]:
        """Send each answer as a status of its own."""

    def _adopt(self, quirks: Q) -> None:
        """Do from now on what these quirks say."""

    def _obeys_broadcast(self, servo: S, code: int, params: bytes) -> bool:
        """True if a servo carries out an instruction that goes to all."""
        return True

    def _for_shadows(self, code: int, params: bytes) -> bool:
        """True if who listens under a secondary id carries out an instruction."""
        return True

    # --- bytes

    def receive(self, data: bytes, client_baud: int | None = None) -> bytes:
        """Take bytes off the wire and return the bytes all servos answer with."""
        replies = self.exchange(data, client_baud)
        return b"".join([piece[1] for reply in replies for piece in reply[1]])

    def exchange(self, data: bytes, client_baud: int | None = None) -> list[Reply]:
        """Take bytes off the wire and return what is answered to each instruction in them."""
        now_s = self._now_s = self.now_s()
        self._now_ms = whole_ms(now_s)
        if client_baud != self._client_baud:
            self._client_baud = client_baud
            self._framing.forget()
            self._stale = True
        if self._stale:
            self.refresh()
        if not self._by_id:
            return self._garbage(data)
        found = self._framing.feed(data, now_s)
        replies = [Reply(i.end, pieces) for i in found if (pieces := self._execute(i))]
        return self.faults.around(replies, data) if self._wire.any else replies

    def _garbage(self, data: bytes) -> list[Reply]:
        """Answer a client that no servo understands: nothing, or the ruins of its own bytes."""
        if self.quirks.wrong_baud == "silence" or not data:
            return []
        return [Reply(len(data), [Piece(NOBODY, bytes(b & 0x6E | 0x80 for b in data[::2]))])]

    def _execute(self, instruction: Instruction) -> list[Piece]:
        """Let the addressed servos carry out one instruction; return what they send."""
        servo_id, code, params, _ = instruction
        if self._stale:
            self.refresh()
        if servo_id != BROADCAST:
            answer = self._answer_all(servo_id, code, params)
            return self._out([answer]) if answer is not None else []
        if code in self._groups:
            return self._groups[code](params)
        for servo in self._known.all():
            if self._obeys_broadcast(servo, code, params):
                self._answer(servo, code, params)
        return []

    def _out(self, answers: list[Answer]) -> list[Piece]:
        """Put answers on the line, as its faults leave them."""
        if not self._wire.any:
            return self._pieces(answers)
        spoilt = self._pieces(self._wire.spoil_answers(answers, False, self._now_s))
        return self._wire.spoil_pieces(spoilt, False, self._now_s)

    def _silent(self, servo_id: int) -> bool:
        """True if a fault keeps this servo from answering."""
        return self._wire.any and self._wire.take("lose", servo_id, self._now_s) is not None

    # --- one id

    def _answer_all(self, servo_id: int, code: int, params: bytes) -> Answer | None:
        """Let all servos that listen to an id carry out an instruction."""
        # Looked up first: the instruction may change who has this id.
        servo, twins = self._by_id.get(servo_id), self._twins.get(servo_id, ())
        shadows = self._known.shadows.get(servo_id, ())
        answer = None if servo is None else self._answer(servo, code, params)
        for twin in twins:
            answer = _both(answer, self._answer(twin, code, params))
        for shadow in shadows:
            if self._for_shadows(code, params):
                self._answer(shadow, code, params)
        return None if answer is None or self._silent(servo_id) else answer

    def _answer(self, servo: S, code: int, params: bytes) -> Answer | None:
        """Let one servo carry out an instruction; return its answer, None where it is silent."""
        if not servo.advance(self._now_ms, self._fed_ms):
            return None
        # Flags, id and delay as they were before: an answer leaves under the old settings.
        answers, flag, servo_id = self._answers(servo, code), servo.error_flag, servo.id
        said = self._carry_out(servo, code, params)
        if said is None or not answers:
            return None
        return Answer(servo_id, said[0] | flag, said[1], self._delay_s[servo_id])

    # --- groups

    def _part(self, servo_id: int, address: int, length: int) -> Answer | None:
        """Return a servo's part of a group read, None where it is silent."""
        servo = self._by_id.get(servo_id)
        answer = None if servo is None else self._seen(servo, address, length)
        for twin in self._twins.get(servo_id, ()) if self._twins else ():
            answer = _both(answer, self._seen(twin, address, length))
        return None if answer is None or self._silent(servo_id) else answer

    def _seen(self, servo: S, address: int, length: int) -> Answer | None:
        if not servo.advance(self._now_ms, self._fed_ms) or not servo.answers_reads:
            return None
        data, servo_id, flag = servo.read(address, length), servo.id, servo.error_flag
        if data is None:
            return Answer(servo_id, flag | self.unreadable, b"", self._delay_s[servo_id])
        return Answer(servo_id, flag, data, self._delay_s[servo_id])

    def _plain(self, rows: Iterable[Wanted]) -> list[Piece]:
        """Answer a group read with one status a servo, in the order asked."""
        answers, late_s, policy = list[Answer](), 0.0, self.quirks.after_missing
        for servo_id, address, length in rows:
            answer = self._part(servo_id, address, length)
            if answer is not None:
                answers.append(answer if late_s == 0.0 else answer._replace(late_s=late_s))
                late_s = 0.0
            elif policy == "silence":
                break
            elif policy == "timeout":
                late_s += self.quirks.slot_timeout_s
        return self._out(answers)

    def _write_all(self, writes: Iterable[tuple[int, int, bytes]]) -> list[Piece]:
        """Carry out a group write; no servo answers."""
        if self._wire.any and self._wire.take("lose_writes", None, self._now_s):
            return []
        known = self._known
        for servo_id, address, data in writes:
            servo = self._by_id.get(servo_id)
            if servo is not None and servo.advance(self._now_ms, self._fed_ms):
                servo.write(address, data)
            if known.twins or known.shadows:
                shadows = known.shadows.get(servo_id, ()) if address >= self.eeprom_end else ()
                for other in (*known.twins.get(servo_id, ()), *shadows):
                    if other.advance(self._now_ms, self._fed_ms):
                        other.write(address, data)
        return []


def _both(one: Answer | None, other: Answer | None) -> Answer | None:
    """Return what two servos with one id say at the same time."""
    if one is None or other is None:
        return other if one is None else one
    return one._replace(twin=_both(one.twin, other))


def whole_ms(now_s: float) -> int:
    """Return the whole milliseconds of a time; the margin keeps 0.005 s from being 4 ms."""
    return int(now_s * 1000.0 + 1e-3)
