"""The device side of a bus of Feetech STS servos: bytes in, bytes out, nothing opened.

Where documents and devices are silent or differ, the choice is one of ``FeetechQuirks``. A client
whose baud rate is not a servo's neither hears it nor is heard. Source: Feetech,
communication protocol of the STS/SMS series.
"""

from collections.abc import Callable, Iterable

from drivers.feetech.memory_table import BAUD_RATES
from sim_mock.device import Reply
from sim_mock.feetech.fault_commands import COMMANDS
from sim_mock.feetech.faults import StsFaults
from sim_mock.feetech.instructions import (
    PING,
    SYNC_READ,
    SYNC_WRITE,
    answers,
    carry_out,
    sync_read,
    sync_writes,
)
from sim_mock.feetech.packets import BROADCAST, Framing, Instruction, pieces
from sim_mock.feetech.quirks import FeetechQuirks, chosen
from sim_mock.feetech.servo import FeetechServo
from sim_mock.replies import Answer, Piece
from sim_mock.smart_servo.physics import ServoSpec

TWIN_AWAY_STEPS = 257
"""A second servo with a taken id stands so far from the first, so that they differ."""


class FeetechChain:
    """Servos on one bus.

    Args:
        servos: any order; servos with one id answer at the same time.
        now_s: the chain's clock.
        heed_baud: only a client at a servo's baud rate is heard; else every client is.
        seed: of the dice that faults throw.
    """

    def __init__(
        self,
        servos: Iterable[FeetechServo],
        now_s: Callable[[], float],
        heed_baud: bool = False,
        seed: int = 0,
    ) -> None:
        self.servos = tuple(servos)
        self.now_s = now_s
        self.quirks = self.servos[0].quirks if self.servos else FeetechQuirks()
        self.heed_baud = heed_baud
        self.faults = StsFaults(self, COMMANDS, seed)
        self._wire = self.faults.wire
        self._now_s = now_s()
        self._now_ms = _whole_ms(self._now_s)
        self._framing = Framing(self.quirks.packet_gap_s, self._now_s)
        self._client_baud: int | None = None
        self.refresh()

    # --- who is there

    def refresh(self) -> None:
        """Look again at ids and bauds."""
        self._told = [servo.address for servo in self.servos]
        by_id: dict[int, list[FeetechServo]] = {}
        for servo in self.servos:
            if not self.heed_baud or self._client_baud in (None, servo.baud):
                by_id.setdefault(servo.id, []).append(servo)
        self._by_id = {servo_id: tuple(by_id[servo_id]) for servo_id in sorted(by_id)}

    def hears(self, client_baud: int | None) -> bool:
        """Tell whether any servo understands a client at this baud rate (None: any)."""
        heeds = self.heed_baud and client_baud is not None
        return not heeds or any(servo.baud == client_baud for servo in self.servos)

    def __getitem__(self, servo_id: int) -> FeetechServo:
        """Give a servo by its id, as it was when last looked at."""
        for servo in self.servos:
            if servo.id == servo_id:
                return servo
        raise KeyError(f"no servo {servo_id}; there is {', '.join(map(str, self.ids()))}")

    def here(self, servo_id: int) -> FeetechServo:
        """Give a servo by its id, brought up to now."""
        servo = self[servo_id]
        servo.advance(_whole_ms(self.now_s()))
        return servo

    def ids(self) -> tuple[int, ...]:
        """List the ids in the order of the servos."""
        return tuple(servo.id for servo in self.servos)

    def join(self, servo_id: int) -> None:
        """Put a second servo with a taken id on the bus, a little turned from the first."""
        first = self.here(servo_id)
        start = (first.position_steps + TWIN_AWAY_STEPS) % first.model.steps_per_turn
        spec = ServoSpec(servo_id, first.model.name, start, first.firmware)
        twin = FeetechServo(spec, _whole_ms(self.now_s()), self.quirks)
        for name in ("baud_rate", "return_delay"):
            twin.memory.keep(name, first.memory.get(name))
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
        for servo in self.servos:
            servo.adopt(self.quirks)

    def positions_steps(self) -> tuple[float, ...]:
        """Give the true positions now, in the order of ``servos``."""
        now_ms = _whole_ms(self.now_s())
        for servo in self.servos:
            servo.advance(now_ms)
        return tuple(servo.position_steps for servo in self.servos)

    # --- bytes

    def receive(self, data: bytes, client_baud: int | None = None) -> bytes:
        """Take bytes off the wire and give the bytes all servos answer with."""
        replies = self.exchange(data, client_baud)
        return b"".join([piece.data for reply in replies for piece in reply.pieces])

    def exchange(self, data: bytes, client_baud: int | None = None) -> list[Reply]:
        """Take bytes off the wire and give what is answered to each instruction in them."""
        now_s = self._now_s = self.now_s()
        self._now_ms = _whole_ms(now_s)
        if client_baud != self._client_baud:
            self._client_baud = client_baud
            self._framing.forget()
            self.refresh()
        if not self.hears(client_baud):
            return self._garbage(data)
        replies = []
        for instruction in self._framing.feed(data, now_s):
            said = self._execute(instruction)
            if said:
                replies.append(Reply(instruction.end, said))
        return self._amid_others(replies, data) if self._wire.any else replies

    def _amid_others(self, replies: list[Reply], data: bytes) -> list[Reply]:
        """Let the host hear itself and a babbling node, where the line has such faults."""
        if self._wire.on("echo", self._now_s):
            replies.insert(0, Reply(len(data), [Piece(-1, data)]))
        babble = self._wire.babble(self._now_s)
        if babble:
            replies.insert(0, Reply(0, [Piece(-1, babble)]))
        return replies

    def _garbage(self, data: bytes) -> list[Reply]:
        """Answer a client that no servo understands: nothing, or the ruins of its own bytes."""
        if self.quirks.wrong_baud == "silence" or not data:
            return []
        return [Reply(len(data), [Piece(-1, bytes(b & 0x6E | 0x80 for b in data[::2]))])]

    def _execute(self, instruction: Instruction) -> list[Piece]:
        """Let the addressed servos carry out one instruction; gives what they send."""
        servo_id, code, params, _ = instruction
        if self._told != [servo.address for servo in self.servos]:
            # A write, or a restart that lost what was not kept.
            self.refresh()
        if servo_id != BROADCAST:
            answer = self._answer_all(servo_id, code, params)
            return self._out([answer]) if answer is not None else []
        if code == SYNC_READ:
            return self._sync_read(params)
        if code == SYNC_WRITE:
            self._sync_write(params)
        elif code == PING:
            return self._ping_all()
        else:
            self._broadcast(code, params)
        return []

    def _broadcast(self, code: int, params: bytes) -> None:
        """Let everybody obey; nobody answers."""
        for servo in [one for same in self._by_id.values() for one in same]:
            if servo.advance(self._now_ms):
                carry_out(servo, code, params)

    def _answer_all(self, servo_id: int, code: int, params: bytes) -> Answer | None:
        """Let all servos with an id carry out an instruction; gives what is said."""
        answer: Answer | None = None
        for servo in self._by_id.get(servo_id, ()):
            said = self._answer(servo, servo_id, code, params)
            if said is not None:
                answer = said if answer is None else said._replace(twin=answer)
        return None if answer is None or self._silent(servo_id) else answer

    def _answer(
        self, servo: FeetechServo, servo_id: int, code: int, params: bytes
    ) -> Answer | None:
        """Let one servo carry out an instruction; gives what it says, None where it is silent."""
        if not servo.advance(self._now_ms):
            return None
        # Error, delay and level as they were before: an answer leaves under the old settings.
        error, delay_s, answered = servo.error, servo.return_delay_s, answers(servo, code)
        data = carry_out(servo, code, params)
        return None if data is None or not answered else Answer(servo_id, error, data, delay_s)

    def _silent(self, servo_id: int) -> bool:
        """Tell whether a fault keeps this servo from answering."""
        return self._wire.any and self._wire.take("lose", servo_id, self._now_s) is not None

    # --- groups

    def _ping_all(self) -> list[Piece]:
        """Answer a ping to all as the quirks say."""
        policy = self.quirks.broadcast_ping
        if policy == "silence":
            return []
        found = [self._answer_all(servo_id, PING, b"") for servo_id in self._by_id]
        said = [answer for answer in found if answer is not None]
        if policy == "mix" and said:
            mixed = said[0]
            for answer in said[1:]:
                mixed = answer._replace(twin=mixed)
            said = [mixed]
        return self._out(said)

    def _sync_read(self, params: bytes) -> list[Piece]:
        """Answer with one status a servo, in the order asked."""
        address, length, ids = sync_read(params)
        said: list[Answer] = []
        late_s, policy = 0.0, self.quirks.after_missing
        for servo_id in ids:
            answer = self._part(servo_id, address, length)
            if answer is not None:
                said.append(answer if late_s == 0.0 else answer._replace(late_s=late_s))
                late_s = 0.0
            elif policy == "silence":
                break
            elif policy == "timeout":
                late_s += self.quirks.slot_timeout_s
        return self._out(said)

    def _part(self, servo_id: int, address: int, length: int) -> Answer | None:
        """Give a servo's part of a sync read, None where it is silent."""
        answer: Answer | None = None
        for servo in self._by_id.get(servo_id, ()):
            if servo.advance(self._now_ms):
                data = servo.read(address, length)
                answer = Answer(servo_id, servo.error, data, servo.return_delay_s, twin=answer)
        return None if answer is None or self._silent(servo_id) else answer

    def _sync_write(self, params: bytes) -> None:
        """Carry out a group write; nobody answers."""
        if self._wire.any and self._wire.take("lose_writes", None, self._now_s):
            return
        for servo_id, data in sync_writes(params):
            for servo in self._by_id.get(servo_id, ()):
                if servo.advance(self._now_ms):
                    servo.write(params[0], data)

    def _out(self, said: list[Answer]) -> list[Piece]:
        if not self._wire.any:
            return pieces(said)
        spoilt = pieces(self._wire.spoil_answers(said, False, self._now_s))
        return self._wire.spoil_pieces(spoilt, False, self._now_s)


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
    now_ms, quirks = _whole_ms(now_s()), FeetechQuirks()
    servos = [FeetechServo(ServoSpec(*spec), now_ms, quirks) for spec in specs]
    if baud is not None:
        if baud not in BAUD_RATES:
            raise ValueError(f"baud {baud}: STS servos know {', '.join(map(str, BAUD_RATES))}")
        for servo in servos:
            servo.memory.keep("baud_rate", BAUD_RATES.index(baud))
    return FeetechChain(servos, now_s, baud is not None, seed)


def _whole_ms(now_s: float) -> int:
    """Give the whole milliseconds of a time; the margin keeps 0.005 s from being 4 ms."""
    return int(now_s * 1000.0 + 1e-3)
