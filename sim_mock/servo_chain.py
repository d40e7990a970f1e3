"""The device side of Dynamixel Protocol 2.0: bytes in, bytes out, nothing opened.

Where documents and devices are silent or differ, the choice is a constructor option or
named here: a wrong CRC is met with silence; instructions are framed by their length, so
bytes that should have been stuffed and were not are still understood. What it does not
do: wire time, return delay, id collisions, faults of the wire.
"""

import struct
from collections.abc import Callable, Iterable, Sequence
from typing import Literal

from fastcrc.crc16 import umts

from sim_mock.servo import Servo, ServoSpec
from sim_mock.servo_memory import ACCESS, DATA_RANGE, INSTRUCTION_ERROR

HEADER = b"\xff\xff\xfd\x00"
RAW, STUFFED = b"\xff\xff\xfd", b"\xff\xff\xfd\xfd"
BROADCAST = 0xFE
STATUS = 0x55
SHORTEST = 10
LONGEST = 1024
"""No packet is longer; a larger length is noise."""

PING, READ, WRITE, REG_WRITE, ACTION, FACTORY_RESET, REBOOT, CLEAR = 1, 2, 3, 4, 5, 6, 8, 0x10
SYNC_READ, SYNC_WRITE, FAST_SYNC_READ = 0x82, 0x83, 0x8A
BULK_READ, BULK_WRITE, FAST_BULK_READ = 0x92, 0x93, 0x9A

CLEAR_TURNS = b"\x01\x44\x58\x4c\x22"
MIN_WATCHDOG_MS = 20

Wanted = tuple[int, int, int]
"""id, address, length of one servo's part of a group read."""

_SPAN = struct.Struct("<HH")
_ROW = struct.Struct("<BHH")
_HEAD = struct.Struct("<4sBHB")
_CRC = struct.Struct("<H")


class ServoChain:
    """Servos on one bus.

    Args:
        servos: any order; ids must differ.
        now_s: the chain's clock.
        after_missing: what servos later in a group read do when one before them is
            silent: "silence" (they wait for its status and never answer) or "skip".
        packet_gap_s: a packet that stays unfinished so long is dropped.
    """

    def __init__(
        self,
        servos: Iterable[Servo],
        now_s: Callable[[], float],
        after_missing: Literal["silence", "skip"] = "silence",
        packet_gap_s: float = 0.0015,
    ) -> None:
        self.servos = tuple(servos)
        self.now_s = now_s
        self._skip = after_missing == "skip"
        self._gap_s = packet_gap_s
        self._unfinished = b""
        self._arrived_s = now_s()
        self._now_ms = self._fed_ms = whole_ms(self._arrived_s)
        self._index()
        self._single: dict[int, Callable[[Servo, bytes], tuple[int, bytes]]] = {
            PING: self._ping,
            READ: self._read,
            WRITE: self._write,
            REG_WRITE: self._register,
            ACTION: lambda servo, params: (servo.action(), b""),
            FACTORY_RESET: self._factory_reset,
            REBOOT: self._reboot,
            CLEAR: self._clear,
        }
        self._group: dict[int, Callable[[bytes], bytes]] = {
            PING: self._ping_all,
            SYNC_READ: lambda params: self._plain(_sync_rows(params)),
            FAST_SYNC_READ: lambda params: self._fast(_sync_rows(params)),
            BULK_READ: lambda params: self._plain(_bulk_rows(params)),
            FAST_BULK_READ: lambda params: self._fast(_bulk_rows(params)),
            SYNC_WRITE: self._sync_write,
            BULK_WRITE: self._bulk_write,
        }

    def _index(self) -> None:
        self._by_id = {servo.id: servo for servo in self.servos}

    def __getitem__(self, servo_id: int) -> Servo:
        """Give a servo by its id, as it was when last looked at."""
        return self._by_id[servo_id]

    def positions_steps(self) -> tuple[float, ...]:
        """Give the true positions now, in the order of ``servos``."""
        now_ms = whole_ms(self.now_s())
        for servo in self.servos:
            servo.advance(now_ms, self._fed_ms)
        return tuple(servo.position_steps for servo in self.servos)

    def receive(self, data: bytes) -> bytes:
        """Take bytes off the wire and give the bytes all servos answer with."""
        now_s = self.now_s()
        if self._unfinished:
            fresh = now_s - self._arrived_s < self._gap_s
            data = self._unfinished + data if fresh else data
        self._arrived_s = now_s
        self._now_ms = whole_ms(now_s)
        answers, at, done = [], 0, 0
        while done < len(data):
            at = data.find(HEADER, at)
            if at < 0:
                done = max(done, len(data) - len(HEADER) + 1)
                break
            end = at + 7 + int.from_bytes(data[at + 5 : at + 7], "little")
            if len(data) - at < SHORTEST or len(data) < end <= at + LONGEST:
                done = at
                break
            if at + SHORTEST <= end <= len(data) and _intact(data[at:end]):
                answers.append(self._execute(data[at + 4], data[at + 7], data[at + 8 : end - 2]))
                at = done = end
            else:
                at += len(HEADER)
        self._unfinished = data[done:]
        return b"".join(answers)

    def _execute(self, servo_id: int, instruction: int, params: bytes) -> bytes:
        """Let the addressed servos carry out one instruction; gives their answers."""
        self._feed()
        params = params.replace(STUFFED, RAW)
        if servo_id != BROADCAST:
            servo = self._by_id.get(servo_id)
            return self._answer(servo, instruction, params) if servo else b""
        if instruction in self._group:
            return self._group[instruction](params)
        for servo in self.servos:
            self._answer(servo, instruction, params)
        return b""

    def _feed(self) -> None:
        """Feed every bus watchdog, after those that have starved have tripped."""
        if self._now_ms - self._fed_ms >= MIN_WATCHDOG_MS:
            for servo in self.servos:
                servo.advance(self._now_ms, self._fed_ms)
        self._fed_ms = self._now_ms

    def _awake(self, servo_id: int) -> Servo | None:
        """Give the servo with this id brought up to now, None where there is none or it is deaf."""
        servo = self._by_id.get(servo_id)
        if servo is not None and servo.advance(self._now_ms, self._fed_ms):
            return servo
        return None

    # --- one servo

    def _answer(self, servo: Servo, instruction: int, params: bytes) -> bytes:
        servo_id = servo.id
        if self._awake(servo_id) is None:
            return b""
        # Flags and level as they were before: an answer leaves under the old settings.
        level, flag = servo.status_level, servo.error_flag
        action = self._single.get(instruction)
        error, answer = (INSTRUCTION_ERROR, b"") if action is None else action(servo, params)
        needed = 0 if instruction == PING else 1 if instruction == READ else 2
        if servo.id != servo_id:
            self._index()
        return status(servo_id, error | flag, answer) if level >= needed else b""

    def _ping(self, servo: Servo, params: bytes) -> tuple[int, bytes]:
        return 0, struct.pack("<HB", servo.model.number, servo.firmware)

    def _read(self, servo: Servo, params: bytes) -> tuple[int, bytes]:
        if len(params) != _SPAN.size:
            return INSTRUCTION_ERROR, b""
        data = servo.read(*_SPAN.unpack(params))
        return (ACCESS, b"") if data is None else (0, data)

    def _write(self, servo: Servo, params: bytes) -> tuple[int, bytes]:
        return servo.write(int.from_bytes(params[:2], "little"), params[2:]), b""

    def _register(self, servo: Servo, params: bytes) -> tuple[int, bytes]:
        return servo.register(int.from_bytes(params[:2], "little"), params[2:]), b""

    def _reboot(self, servo: Servo, params: bytes) -> tuple[int, bytes]:
        servo.reboot()
        return 0, b""

    def _factory_reset(self, servo: Servo, params: bytes) -> tuple[int, bytes]:
        return servo.factory_reset(params[0] if params else -1), b""

    def _clear(self, servo: Servo, params: bytes) -> tuple[int, bytes]:
        return (servo.clear_turns() if params == CLEAR_TURNS else DATA_RANGE), b""

    # --- groups

    def _ping_all(self, params: bytes) -> bytes:
        return b"".join(self._answer(self._by_id[i], PING, b"") for i in sorted(self._by_id))

    def _plain(self, rows: Sequence[Wanted]) -> bytes:
        """Answer with one status a servo, in the order asked."""
        out = []
        for servo_id, address, length in rows:
            servo = self._awake(servo_id)
            if servo is not None and servo.status_level >= 1:
                data = servo.read(address, length)
                error = servo.error_flag | (ACCESS if data is None else 0)
                out.append(status(servo_id, error, data or b""))
            elif not self._skip:
                break
        return b"".join(out)

    def _fast(self, rows: Sequence[Wanted]) -> bytes:
        """Answer as one packet; every block ends with the CRC over all bytes before it.

        Nobody can take the place of a missing block: the packet ends there.
        """
        length = 1 + sum([4 + row[2] for row in rows])
        parts = [_HEAD.pack(HEADER, BROADCAST, length, STATUS)]
        crc = umts(parts[0])
        for servo_id, address, size in rows:
            servo = self._awake(servo_id)
            if servo is None or not servo.fast_reads or servo.status_level < 1:
                break
            data = servo.read(address, size)
            error = servo.error_flag | (ACCESS if data is None else 0)
            block = bytes((error, servo_id)) + (data or bytes(size))
            crc = umts(block, crc)
            tail = _CRC.pack(crc)
            crc = umts(tail, crc)
            parts += (block, tail)
        return b"".join(parts) if len(parts) > 1 else b""

    def _sync_write(self, params: bytes) -> bytes:
        if len(params) < _SPAN.size:
            return b""
        address, length = _SPAN.unpack_from(params)
        if (len(params) - _SPAN.size) % (1 + length) == 0:
            for servo_id, data in struct.iter_unpack(f"<B{length}s", params[_SPAN.size :]):
                self._write_at(servo_id, address, data)
        return b""

    def _bulk_write(self, params: bytes) -> bytes:
        at = 0
        while len(params) - at > _ROW.size:
            servo_id, address, length = _ROW.unpack_from(params, at)
            at += _ROW.size + length
            if at <= len(params):
                self._write_at(servo_id, address, params[at - length : at])
        return b""

    def _write_at(self, servo_id: int, address: int, data: bytes) -> None:
        servo = self._awake(servo_id)
        if servo is not None:
            servo.write(address, data)
            if servo.id != servo_id:
                self._index()


def build_chain(
    specs: Iterable[ServoSpec | tuple[int, str, float]],
    now_s: Callable[[], float],
    after_missing: Literal["silence", "skip"] = "silence",
    packet_gap_s: float = 0.0015,
) -> ServoChain:
    """Build servos and their bus; a plain tuple is (id, model, start position in steps)."""
    now_ms = whole_ms(now_s())
    servos = [Servo(ServoSpec(*spec), now_ms) for spec in specs]
    return ServoChain(servos, now_s, after_missing, packet_gap_s)


def whole_ms(now_s: float) -> int:
    """Give the whole milliseconds of a time; the margin keeps 0.005 s from being 4 ms."""
    return int(now_s * 1000.0 + 1e-3)


def status(servo_id: int, error: int, params: bytes) -> bytes:
    """Build a status packet."""
    if RAW in params:
        params = params.replace(RAW, STUFFED)
    packet = _HEAD.pack(HEADER, servo_id, len(params) + 4, STATUS) + bytes((error,)) + params
    return packet + _CRC.pack(umts(packet))


def _intact(packet: bytes) -> bool:
    return umts(packet[:-2]) == int.from_bytes(packet[-2:], "little")


def _sync_rows(params: bytes) -> tuple[Wanted, ...]:
    if len(params) <= _SPAN.size:
        return ()
    address, length = _SPAN.unpack_from(params)
    return tuple((servo_id, address, length) for servo_id in params[_SPAN.size :])


def _bulk_rows(params: bytes) -> tuple[Wanted, ...]:
    return tuple(_ROW.iter_unpack(params)) if len(params) % _ROW.size == 0 else ()
