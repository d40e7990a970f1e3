"""Device side of a bus of smart servos: bytes in, bytes out, nothing opened.

The servos after a silent one in a group read never answer, as logic analysers show of real ones.
"""

import struct
from abc import ABC
from collections.abc import Callable, Iterable
from functools import lru_cache
from typing import Self

from gazerig.sim_mock.faults.grammar import CommandTable
from gazerig.sim_mock.replies import BROADCAST, Instruction, Piece, merge
from gazerig.sim_mock.smart_servo.faults import ServoFaults
from gazerig.sim_mock.smart_servo.physics import ServoSpec
from gazerig.sim_mock.smart_servo.servo import (
    PING,
    READ,
    REBOOT,
    WRITE,
    EmulatedServo,
    Result,
)
from gazerig.sim_mock.smart_servo.shaft import ShaftMaker, create_shaft, whole_ms

SYNC_READ, SYNC_WRITE = 0x82, 0x83

PACKET_GAP_S = 0.0015
"""Pause in a packet that real servos tolerate [A]."""

MIN_WATCHDOG_MS = 20
TWIN_AWAY_STEPS = 257
"""Distance of a second servo with a taken id from the first, so that they differ."""

Read = tuple[int, int, int]
"""Id, address and length of one servo's part of a group read."""


@lru_cache(64)
def sync_reads(span: struct.Struct, params: bytes) -> list[Read]:
    """Return the parts of a sync read; a control loop repeats it byte for byte."""
    ids = params[span.size :]
    return [(servo_id, *span.unpack_from(params)) for servo_id in ids]


class ServoChain(ABC):
    """Servos on one bus.

    A make of servos defines in class attributes its servo type, its packets and its fault commands.

    Args:
        servos: any order; servos with one id answer at the same time.
        now_s: the chain's clock.
        check_baud: whether only clients at a servo's baud rate get answers, instead of all.
        seed: seed of the random numbers of faults.

    Attributes:
        packet_gap_s: time after which an unfinished packet is dropped.
    """

    servo_type: Callable[[ServoSpec, int, ShaftMaker], EmulatedServo]
    find_instructions: Callable[[bytes, int], tuple[list[Instruction], bytes]]
    """Finds instructions in bytes, of which some arrived before."""
    status: Callable[[int, int, bytes], bytes]
    """Builds a status packet from id, error and parameters."""
    span: struct.Struct
    """Layout of address and length in a packet."""
    misunderstood: Result | None
    """The answer to an unknown instruction; None: silence."""
    commands: CommandTable

    def __init__(
        self,
        servos: Iterable[EmulatedServo],
        now_s: Callable[[], float],
        check_baud: bool = False,
        seed: int = 0,
    ) -> None:
        self.servos = tuple(servos)
        self.now_s = now_s
        self.check_baud = check_baud
        self.faults = ServoFaults(self, self.commands, seed)
        self._arrived_s = now_s()
        self._now_ms = self._fed_ms = whole_ms(self._arrived_s)
        self.packet_gap_s, self._unfinished, self._end = PACKET_GAP_S, b"", 0
        self._client_baud: int | None = None
        self.refresh()

    def positions_steps(self) -> tuple[float, ...]:
        """Return the true positions now, in the order of ``servos``."""
        now_ms = whole_ms(self.now_s())
        for servo in self.servos:
            servo.advance(now_ms, self._fed_ms)
        return tuple([servo.position_steps for servo in self.servos])

    # --- addresses

    def refresh(self) -> None:
        """Read ids and baud rates again; needed after external changes."""
        self._by_id: dict[int, list[EmulatedServo]] = {}
        for servo in self.servos:
            servo.on_address = self._mark_stale
            if not self.check_baud or self._client_baud in (None, servo.baud):
                self._by_id.setdefault(servo.id, []).append(servo)
        self._stale = False

    def _mark_stale(self) -> None:
        """Read addresses again before the next instruction; the old ones are valid until then."""
        self._stale = True

    def __getitem__(self, servo_id: int) -> EmulatedServo:
        """Return a servo by its id, without advancing it."""
        for servo in self.servos:
            if servo.id == servo_id:
                return servo
        raise KeyError(f"no servo {servo_id}; servos are {', '.join(map(str, self.ids()))}")

    def find_servo(self, servo_id: int) -> EmulatedServo:
        """Return a servo by its id, advanced to the present time."""
        servo = self[servo_id]
        servo.advance(whole_ms(self.now_s()), self._fed_ms)
        return servo

    def ids(self) -> tuple[int, ...]:
        """Return the ids in the order of the servos."""
        return tuple(servo.id for servo in self.servos)

    def add_duplicate(self, servo_id: int) -> None:
        """Add a second servo with a taken id to the bus, slightly turned from the first."""
        first = self.find_servo(servo_id)
        start = (first.position_steps + TWIN_AWAY_STEPS) % 4096
        spec = first.spec._replace(start_steps=start)
        twin = self.servo_type(spec, whole_ms(self.now_s()), create_shaft)
        delay = first.memory.get("return_delay_time")
        twin.memory.set_permanently("return_delay_time", delay)
        twin.set_baud(first.baud)
        self.servos = (*self.servos, twin)
        self.refresh()

    # --- bytes

    def receive(self, data: bytes, client_baud: int | None = None) -> bytes:
        """Process received bytes and return all answers as bytes."""
        return b"".join([piece[1] for piece in self.exchange(data, client_baud)])

    def exchange(self, data: bytes, client_baud: int | None = None) -> list[Piece]:
        """Process received bytes and return the answers to the instructions in them."""
        now_s = self.now_s()
        self._now_ms = whole_ms(now_s)
        if client_baud != self._client_baud:
            self._client_baud = client_baud
            self._unfinished = b""
            self._stale = True
        if self._stale:
            self.refresh()
        pieces: list[Piece] = []
        if not self._by_id:
            return pieces
        if now_s - self._arrived_s >= self.packet_gap_s:
            self._unfinished = b""
        self._arrived_s, before = now_s, len(self._unfinished)
        found, self._unfinished = self.find_instructions(self._unfinished + data, before)
        for instruction in found:
            if self._stale:
                self.refresh()
            pieces += self._execute(instruction)
        return pieces

    def _execute(self, instruction: Instruction) -> list[Piece]:
        """Execute one instruction on the addressed servos; return the bytes that they send."""
        # An expired watchdog trips, the others start again.
        if self._now_ms - self._fed_ms >= MIN_WATCHDOG_MS:
            for servo in self.servos:
                servo.advance(self._now_ms, self._fed_ms)
        self._fed_ms = self._now_ms
        servo_id, code, params, self._end = instruction
        if servo_id == BROADCAST:
            return self._execute_group(code, params)
        answer = self._answer_all(servo_id, code, params)
        return [] if answer is None else [answer]

    def _execute_group(self, code: int, params: bytes) -> list[Piece]:
        """Execute an instruction to all servos."""
        if code == SYNC_READ:
            return self._answer_reads(sync_reads(self.span, params))
        if code == SYNC_WRITE:
            self._write_each(params)
            return []
        answers = [self._answer_all(servo_id, code, params) for servo_id in sorted(self._by_id)]
        return [one for one in answers if one is not None] if code == PING else []

    # --- one id

    def _answer_all(self, servo_id: int, code: int, params: bytes) -> Piece | None:
        # An answer is sent with the old settings.
        packet, delay_s = b"", 0.0
        for servo in self._by_id.get(servo_id, ()):
            if not servo.advance(self._now_ms, self._fed_ms):
                continue
            answers, flag = servo.answers_instruction(code), servo.error_flag
            delay_s = servo.delay_s
            said = self._carry_out(servo, code, params)
            if said is not None and answers:
                own = self.status(servo_id, said[0] | flag, said[1])
                packet = merge(packet, own) if packet else own
        if not packet or self.faults.use_fault("lose", servo_id):
            return None
        return Piece(servo_id, packet, self._end, delay_s)

    def _carry_out(self, servo: EmulatedServo, code: int, params: bytes) -> Result | None:
        """Execute an instruction on a servo; return its answer, None for silence."""
        if code == READ and len(params) == self.span.size:
            return servo.read(*self.span.unpack(params))
        if code == PING:
            return 0, servo.identity()
        half = self.span.size // 2
        if code == WRITE and len(params) >= half:
            return servo.write(int.from_bytes(params[:half], "little"), params[half:]), b""
        if code == REBOOT:
            servo.restart()
            return 0, b""
        return self.misunderstood

    # --- groups

    def _answer_reads(self, reads: Iterable[Read]) -> list[Piece]:
        """Answer a group read with one status per servo, up to the first silent one."""
        pieces: list[Piece] = []
        now_ms, fed_ms = self._now_ms, self._fed_ms
        find, faults, end = self._by_id.get, self.faults, self._end
        for servo_id, address, length in reads:
            packet, delay_s = b"", 0.0
            for servo in find(servo_id, ()):
                if servo.answers_groups and servo.advance(now_ms, fed_ms):
                    error, data = servo.read(address, length)
                    own = self.status(servo_id, error | servo.error_flag, data)
                    packet, delay_s = merge(packet, own) if packet else own, servo.delay_s
            if not packet or (faults.has_any and faults.use_fault("lose", servo_id)):
                break
            pieces.append(Piece(servo_id, packet, end, delay_s))
        return pieces

    def _write_each(self, params: bytes) -> None:
        """Execute a sync write."""
        start = self.span.size
        if len(params) < start:
            return
        address, length = self.span.unpack_from(params)
        rows = params[start:]
        if len(rows) % (1 + length) == 0:
            find, now_ms, fed_ms = self._by_id.get, self._now_ms, self._fed_ms
            for servo_id, data in struct.iter_unpack(f"B{length}s", rows):
                for servo in find(servo_id, ()):
                    # Repeating the goals that it follows would change nothing.
                    if (address, data) != servo.followed and servo.advance(now_ms, fed_ms):
                        servo.write(address, data)

    # --- construction

    @classmethod
    def build(
        cls,
        specs: Iterable[ServoSpec | tuple[int, str, float]],
        now_s: Callable[[], float],
        baud: int | None = None,
        seed: int = 0,
        make_shaft: ShaftMaker = create_shaft,
    ) -> Self:
        """Build servos and their bus.

        Args:
            specs: a plain tuple is (id, model, start position in steps).
            now_s: the clock.
            baud: rate of all servos, which keep their other factory settings; only clients at their
                rate get answers; None: any rate works.
            seed: seed of the random numbers of faults.
            make_shaft: creates the shaft of each servo.

        Raises:
            ValueError: the model is unknown, or does not support this baud rate.
        """
        now_ms = whole_ms(now_s())
        servos = [cls.servo_type(ServoSpec(*spec), now_ms, make_shaft) for spec in specs]
        if baud is not None:
            for servo in servos:
                servo.set_baud(baud)
        return cls(servos, now_s, baud is not None, seed)
