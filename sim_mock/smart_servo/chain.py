"""Device side of a bus of smart servos: bytes in, bytes out, nothing opened.

Behaviour that is undocumented or differs between documents and devices is a choice in
``ChainQuirks``. A client at a baud rate other than a servo's gets no answer from it.
"""

from collections.abc import Callable, Iterable
from typing import Any, Generic, TypeVar

from gazerig.sim_mock.device import DeviceReply
from gazerig.sim_mock.faults.active import NO_DEVICE
from gazerig.sim_mock.faults.grammar import CommandTable
from gazerig.sim_mock.replies import BROADCAST, Answer, Piece, merge
from gazerig.sim_mock.smart_servo.addresses import AddressTable, at_baud
from gazerig.sim_mock.smart_servo.faults import ServoFaults
from gazerig.sim_mock.smart_servo.framing import PING, SYNC_READ, SYNC_WRITE, Framing, Instruction
from gazerig.sim_mock.smart_servo.head_weight import HeadWeight
from gazerig.sim_mock.smart_servo.instructions import GroupRead, GroupWrite, InstructionSet
from gazerig.sim_mock.smart_servo.integration import whole_ms
from gazerig.sim_mock.smart_servo.motor import ShaftMaker, create_shaft
from gazerig.sim_mock.smart_servo.physics import ServoSpec
from gazerig.sim_mock.smart_servo.quirks import PAUSE_MS, ChainQuirks, change_quirk
from gazerig.sim_mock.smart_servo.servo import EmulatedServo

WEIGH_MS = 10
"""Time for which the torques of the head's weight are constant."""
TWIN_AWAY_STEPS = 257
"""Distance of a second servo with a taken id from the first, so that they differ."""

GroupAction = Callable[[bytes], list[Piece]]

S = TypeVar("S", bound=EmulatedServo)
Q = TypeVar("Q", bound=ChainQuirks)


class ServoChain(Generic[S, Q]):
    """Servos on one bus.

    A make of servos defines in class attributes its servo type, its quirks, the framing and the
    packets, its instructions and its fault commands.

    Args:
        servos: any order; servos with one id answer at the same time.
        now_s: the chain's clock.
        quirks: behaviour where documents and devices differ; None: the first value of each case.
        check_baud: whether only clients at a servo's baud rate get answers, instead of all.
        seed: seed of the random numbers of faults.
        weight: weight of the head on the servos; None: each has its own load.
    """

    servo_type: type[S]
    quirks_type: type[Q]
    framing_type: type[Framing]
    header: bytes
    status: Callable[[int, int, bytes], bytes]
    """Builds a status packet from id, error and parameters."""
    instructions: InstructionSet[S]
    commands: CommandTable
    eeprom_end = 0
    """Servos ignore writes below it that address their secondary id."""

    def __init__(
        self,
        servos: Iterable[S],
        now_s: Callable[[], float],
        quirks: Q | None = None,
        check_baud: bool = False,
        seed: int = 0,
        weight: HeadWeight | None = None,
    ) -> None:
        self.servos = tuple(servos)
        self._weight = weight
        self.now_s = now_s
        self.quirks = quirks or self.quirks_type()
        self.check_baud = check_baud
        self.faults = ServoFaults(self, self.commands, seed, self.header)
        self._wire = self.faults.wire
        self._now_s = now_s()
        self._now_ms = self._fed_ms = whole_ms(self._now_s)
        self._framing = self.framing_type(self.quirks.packet_gap_s, self._now_s)
        self._client_baud: int | None = None
        self._groups = self._group_instructions()
        for servo in self.servos:
            servo.on_address = self._mark_stale
        self._apply_quirks(self.quirks)
        self.refresh()
        self._weighed_ms = self._now_ms
        if weight is not None:
            self._apply_weight(weight)

    # --- time

    def _advance(self, servos: Iterable[S], now_ms: int) -> None:
        """Advance servos; the head's weight is applied every 10 ms to all."""
        weight = self._weight
        if weight is not None:
            if now_ms - self._weighed_ms > PAUSE_MS:
                # Of a long pause only the end matters; servos skip its middle, too.
                self._weighed_ms = now_ms - WEIGH_MS
            while self._weighed_ms + WEIGH_MS <= now_ms:
                self._weighed_ms += WEIGH_MS
                for servo in self.servos:
                    servo.advance(self._weighed_ms, self._fed_ms)
                self._apply_weight(weight)
        for servo in servos:
            servo.advance(now_ms, self._fed_ms)

    def _apply_weight(self, weight: HeadWeight) -> None:
        servos = self.servos[: len(weight.shafts)]
        for servo, load in zip(
            servos, weight.loads_nm([one.shaft.x for one in servos]), strict=True
        ):
            servo.shaft.set_weight(load / servo.model.stall_torque_nm)

    # --- addresses

    def refresh(self) -> None:
        """Read ids, baud rates and return delays again; needed after external changes."""
        self._stale = False
        known = AddressTable(self.servos, self._client_baud if self.check_baud else None)
        self._known = known
        self._by_id, self._twins, self._delay_s = known.by_id, known.twins, known.delay_s

    def _mark_stale(self) -> None:
        """Read addresses again before the next instruction; the old ones are valid until then."""
        self._stale = True

    def understands_baud(self, client_baud: int) -> bool:
        """Return whether any servo understands a client at this baud rate."""
        return not self.check_baud or any(at_baud(servo, client_baud) for servo in self.servos)

    def __getitem__(self, servo_id: int) -> S:
        """Return a servo by its id, without advancing it."""
        for servo in self.servos:
            if servo.id == servo_id:
                return servo
        raise KeyError(f"no servo {servo_id}; servos are {', '.join(map(str, self.ids()))}")

    def find_servo(self, servo_id: int) -> S:
        """Return a servo by its id, advanced to the present time."""
        servo = self[servo_id]
        self._advance((servo,), whole_ms(self.now_s()))
        return servo

    def ids(self) -> tuple[int, ...]:
        """Return the ids in the order of the servos."""
        return tuple(servo.id for servo in self.servos)

    def add_duplicate(self, servo_id: int) -> None:
        """Add a second servo with a taken id to the bus, slightly turned from the first."""
        first, now_ms = self.find_servo(servo_id), whole_ms(self.now_s())
        start = (first.position_steps + TWIN_AWAY_STEPS) % 4096
        spec = ServoSpec(servo_id, first.model.name, start, first.firmware)
        twin = self.servo_type(spec, now_ms)
        for name in ("baud_rate", "return_delay_time"):
            twin.memory.set_permanently(name, first.memory.get(name))
        twin.on_address = self._mark_stale
        self.servos = (*self.servos, twin)
        self._apply_quirks(self.quirks)
        self.refresh()

    def choose_behaviour(self, case: str, value: str) -> None:
        """Choose a quirk by its name, or whether servos check the baud rate."""
        if case == "baud":
            if value not in ("heed", "any"):
                raise ValueError(f"baud {value!r}: expected heed or any")
            self.check_baud = value == "heed"
            self.refresh()
            return
        self.quirks = change_quirk(self.quirks, case, value)
        self._framing.gap_s = self.quirks.packet_gap_s
        self._apply_quirks(self.quirks)

    def positions_steps(self) -> tuple[float, ...]:
        """Return the true positions now, in the order of ``servos``."""
        self._advance(self.servos, whole_ms(self.now_s()))
        return tuple(servo.position_steps for servo in self.servos)

    # --- what a make of servos adds

    def _apply_quirks(self, quirks: Q) -> None:
        """Use quirks from now on."""

    def _obeys_broadcast(self, servo: S, code: int, params: bytes) -> bool:
        """Return whether a servo executes a broadcast instruction."""
        return True

    def _touches_eeprom(self, code: int, params: bytes) -> bool:
        """Return whether servos ignore an instruction that addresses their secondary id."""
        return False

    # --- bytes

    def receive(self, data: bytes, client_baud: int | None = None) -> bytes:
        """Process received bytes and return all answers as bytes."""
        replies = self.exchange(data, client_baud)
        return b"".join([piece[1] for reply in replies for piece in reply[1]])

    def exchange(self, data: bytes, client_baud: int | None = None) -> list[DeviceReply]:
        """Process received bytes and return the answer to each instruction in them."""
        now_s = self._now_s = self.now_s()
        self._now_ms = whole_ms(now_s)
        if self._weight is not None:
            self._advance((), self._now_ms)
        if client_baud != self._client_baud:
            self._client_baud = client_baud
            self._framing.forget()
            self._stale = True
        if self._stale:
            self.refresh()
        if not self._by_id:
            # A client at a wrong baud rate gets nothing, or garbage made of its own bytes.
            if self.quirks.wrong_baud == "silence" or not data:
                return []
            garbage = bytes(b & 0x6E | 0x80 for b in data[::2])
            return [DeviceReply(len(data), [Piece(NO_DEVICE, garbage)])]
        found = self._framing.feed(data, now_s)
        replies = [DeviceReply(i.end, pieces) for i in found if (pieces := self._execute(i))]
        return self.faults.add_line_noise(replies, data) if self._wire.has_any else replies

    def _execute(self, instruction: Instruction) -> list[Piece]:
        """Execute one instruction on the addressed servos; return the bytes that they send."""
        servo_id, code, params, _ = instruction
        if self._stale:
            self.refresh()
        if servo_id != BROADCAST:
            answer = self._answer_all(servo_id, code, params)
            return self._apply_line_faults([answer]) if answer is not None else []
        if code in self._groups:
            return self._groups[code](params)
        for servo in self._known.all_servos():
            if self._obeys_broadcast(servo, code, params):
                self._answer(servo, code, params)
        return []

    def _apply_line_faults(self, answers: list[Answer]) -> list[Piece]:
        """Return answers as pieces, changed by the line's faults."""
        if not self._wire.has_any:
            return self._pieces(answers)
        spoilt = self._pieces(self._wire.spoil_answers(answers, False, self._now_s))
        return self._wire.spoil_pieces(spoilt, False, self._now_s)

    def _pieces(self, answers: Iterable[Answer]) -> list[Piece]:
        """Send each answer as its own status."""
        return [Piece(a[0], self._packet(a), a[3], a[4]) for a in answers]

    def _packet(self, answer: Answer) -> bytes:
        """Build the status of a servo, or of several that answer simultaneously under one id."""
        own = self.status(answer[0], answer[1], answer[2])
        return own if answer.twin is None else merge(own, self._packet(answer.twin))

    def _is_muted(self, servo_id: int) -> bool:
        """Return whether a fault keeps this servo from answering."""
        return (
            self._wire.has_any and self._wire.use_fault("lose", servo_id, self._now_s) is not None
        )

    # --- one id

    def _answer_all(self, servo_id: int, code: int, params: bytes) -> Answer | None:
        """Execute an instruction on all servos that listen to an id."""
        # Looked up first: the instruction may change the owner of this id.
        servo, twins = self._by_id.get(servo_id), self._twins.get(servo_id, ())
        shadows = self._known.shadows.get(servo_id, ())
        answer = None if servo is None else self._answer(servo, code, params)
        for twin in twins:
            answer = _merge_answers(answer, self._answer(twin, code, params))
        for shadow in shadows:
            if not self._touches_eeprom(code, params):
                self._answer(shadow, code, params)
        return None if answer is None or self._is_muted(servo_id) else answer

    def _answer(self, servo: S, code: int, params: bytes) -> Answer | None:
        """Execute an instruction on one servo; return its answer, None if it is silent."""
        if not servo.advance(self._now_ms, self._fed_ms):
            return None
        # Read flags, id and delay first: an answer is sent with the old settings.
        answers, flag, servo_id = servo.answers_instruction(code), servo.error_flag, servo.id
        said = self.instructions.carry_out(servo, code, params)
        if said is None or not answers:
            return None
        return Answer(servo_id, said[0] | flag, said[1], self._delay_s[servo_id])

    # --- groups

    def _group_instructions(self) -> dict[int, GroupAction]:
        """Return the handlers of group instructions, by code."""
        return {
            PING: lambda params: self._apply_line_faults(self._ping_all()),
            SYNC_READ: lambda params: self._answer_plain(self.instructions.sync_rows(params)),
            SYNC_WRITE: self._write_each,
        }

    def _ping_all(self) -> list[Answer]:
        """Return the answers to a broadcast ping, in the order of the ids."""
        answers = (self._answer_all(servo_id, PING, b"") for servo_id in sorted(self._by_id))
        return [answer for answer in answers if answer is not None]

    def _group_part(self, servo_id: int, address: int, length: int) -> Answer | None:
        """Return a servo's part of a group read, None if it is silent."""
        servo = self._by_id.get(servo_id)
        answer = None if servo is None else self._read_part(servo, address, length)
        for twin in self._twins.get(servo_id, ()) if self._twins else ():
            answer = _merge_answers(answer, self._read_part(twin, address, length))
        return None if answer is None or self._is_muted(servo_id) else answer

    def _read_part(self, servo: S, address: int, length: int) -> Answer | None:
        if not servo.advance(self._now_ms, self._fed_ms) or not servo.answers_groups:
            return None
        data, servo_id, flag = servo.read(address, length), servo.id, servo.error_flag
        if data is None:
            return Answer(servo_id, flag | servo.unreadable, b"", self._delay_s[servo_id])
        return Answer(servo_id, flag, data, self._delay_s[servo_id])

    def _answer_plain(self, rows: Iterable[GroupRead]) -> list[Piece]:
        """Answer a group read with one status per servo, in the order of the request."""
        if not self._wire.has_any and not self._twins:
            return self._answer_undisturbed(rows)
        answers, late_s, policy = list[Answer](), 0.0, self.quirks.after_missing
        for servo_id, address, length in rows:
            answer = self._group_part(servo_id, address, length)
            if answer is not None:
                answers.append(answer if late_s == 0.0 else answer._replace(late_s=late_s))
                late_s = 0.0
            elif policy == "silence":
                break
            elif policy == "timeout":
                late_s += self.quirks.slot_timeout_s
        return self._apply_line_faults(answers)

    def _answer_undisturbed(self, rows: Iterable[GroupRead]) -> list[Piece]:
        """Answer a group read for unique ids and a line without faults: this happens every tick."""
        servos, now_ms, fed_ms = self._by_id, self._now_ms, self._fed_ms
        pieces, late_s, policy = list[Piece](), 0.0, self.quirks.after_missing
        for servo_id, address, length in rows:
            servo = servos.get(servo_id)
            if servo is not None and servo.advance(now_ms, fed_ms) and servo.answers_groups:
                data, flag = servo.read(address, length), servo.error_flag
                if data is None:
                    data, flag = b"", flag | servo.unreadable
                packet = self.status(servo_id, flag, data)
                pieces.append(Piece(servo_id, packet, self._delay_s[servo_id], late_s))
                late_s = 0.0
            elif policy == "silence":
                break
            elif policy == "timeout":
                late_s += self.quirks.slot_timeout_s
        return pieces

    def _write_each(self, params: bytes) -> list[Piece]:
        """Execute a sync write; skip servos that already follow the same goals."""
        address, rows = self.instructions.sync_writes(params)
        if self._wire.has_any or self._known.twins or self._known.shadows:
            return self._write_all([(servo_id, address, data) for servo_id, data in rows])
        servos, now_ms, fed_ms = self._by_id, self._now_ms, self._fed_ms
        for servo_id, data in rows:
            servo = servos.get(servo_id)
            if servo is None or servo.drive.followed == (address, data):
                continue
            if servo.advance(now_ms, fed_ms):
                servo.write(address, data)
        return []

    def _write_all(self, writes: Iterable[GroupWrite]) -> list[Piece]:
        """Execute a group write; no servo answers."""
        if self._wire.has_any and self._wire.use_fault("lose_writes", None, self._now_s):
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


C = TypeVar("C", bound=ServoChain[Any, Any])


def build_chain(
    chain: type[C],
    specs: Iterable[ServoSpec | tuple[int, str, float]],
    now_s: Callable[[], float],
    baud: int | None = None,
    quirks: ChainQuirks | None = None,
    seed: int = 0,
    make_shaft: ShaftMaker = create_shaft,
    weight: HeadWeight | None = None,
) -> C:
    """Build servos and their bus.

    Args:
        chain: the chain type of a make.
        specs: a plain tuple is (id, model, start position in steps).
        now_s: the clock.
        baud: rate of all servos, which keep their other factory settings; only clients at their
            rate get answers; None: any rate works.
        quirks: behaviour where documents and devices differ.
        seed: seed of the random numbers of faults.
        make_shaft: creates the shaft of each servo.
        weight: weight of a head on these servos.

    Raises:
        ValueError: the model is unknown, or does not support this baud rate.
    """
    now_ms = whole_ms(now_s())
    servos = [chain.servo_type(ServoSpec(*spec), now_ms, make_shaft) for spec in specs]
    if baud is not None:
        for servo in servos:
            servo.set_baud(baud)
    return chain(servos, now_s, quirks, baud is not None, seed, weight)


def _merge_answers(one: Answer | None, other: Answer | None) -> Answer | None:
    """Return the combined answer of two servos with one id."""
    if one is None or other is None:
        return other if one is None else one
    return one._replace(twin=_merge_answers(one.twin, other))
