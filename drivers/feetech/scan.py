"""Looking for STS servos: who answers at which baud rate, and whether answers collide.

A ping to everybody is answered by all at once, over each other, so every id is asked. It is
asked for its first registers, not pinged: a ping's echo looks like its answer. An answer
names its id, so one that an adapter hands over late is counted all the same.

Source of the packets: Feetech, communication protocol of the SCS and STS series.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from gazerig.drivers.feetech.memory_table import (
    BAUD_RATES,
    HIGHEST_ID,
    MODELS,
    REGISTERS,
    STEPS_PER_TURN,
)
from gazerig.drivers.feetech.protocol import (
    BROADCAST,
    PING,
    STATUS_OVERHEAD,
    instruction,
    read,
    statuses,
)
from gazerig.drivers.serial.port import BITS_PER_BYTE, BusPort
from gazerig.drivers.servo_bus.family import Status

FACTORY_BAUD = 1_000_000
COMMON_FIRST = BAUD_RATES
"""Every baud rate of the servos, the usual ones first."""

REPLY_S = 0.04
"""Patience for one servo: the longest return delay and two turns of a 16 ms latency timer."""

PATIENCE_S, THOROUGH_S = 0.004, 0.02
"""Patience for each id when all are asked."""

SHARED = 2
"""So many of six answers in pieces are no accident."""

IDENTITY_LENGTH = 9
"""Registers 0..8: firmware, model, id, baud rate, return delay, status level."""

_TELLING, _TELLING_LENGTH = REGISTERS["present_position"].address, 15
_NAMES = {model.number: model.name for model in reversed(MODELS.values())}

Progress = Callable[[int, int], None]
"""Told the baud rate and the id that is asked."""


class Found(NamedTuple):
    """One servo that answered.

    number: its model number; baud: at which it answered
    firmware: a hundred times the major version and the minor one, 310 for 3.10
    """

    id: int
    number: int
    firmware: int
    baud: int

    @property
    def model(self) -> str:
        """Name the model, "model number 1029" where it is not known here."""
        return _NAMES.get(self.number, f"model number {self.number}")

    @property
    def version(self) -> str:
        """Return the firmware as the maker writes it, "3.10"."""
        return f"{self.firmware // 100}.{self.firmware % 100}"


class Heard(NamedTuple):
    """What came back: whole statuses, and the number of bytes that were part of none."""

    answers: tuple[Status, ...]
    junk: int


class Round(NamedTuple):
    """What one baud rate has brought.

    possible: the adaptor can run at it; junk: bytes that made no sense
    shared: ids that two servos seem to have, as their longer answers come in pieces
    """

    baud: int
    possible: bool
    found: tuple[Found, ...]
    junk: int = 0
    shared: tuple[int, ...] = ()


def scan(
    port: BusPort,
    bauds: Sequence[int] = COMMON_FIRST,
    thorough: bool = False,
    progress: Progress | None = None,
    ids: Sequence[int] = range(HIGHEST_ID + 1),
) -> Iterator[Round]:
    """Ask at one baud rate after the other who is there; the port is left open at the last.

    Raises:
        PortError: the port cannot be opened.
        BusLost: it has gone away.
    """
    for baud in bauds:
        if not port.setBaudRate(baud):
            yield Round(baud, False, ())
            continue
        patience_s = THOROUGH_S if thorough else PATIENCE_S
        found, junk = everybody(port, baud, patience_s, progress, ids)
        shared = tuple(one.id for one in found if garbled(port, one.id) >= SHARED)
        yield Round(baud, True, found, junk, shared)


def everybody(
    port: BusPort,
    baud: int,
    patience_s: float = PATIENCE_S,
    progress: Progress | None = None,
    ids: Sequence[int] = range(HIGHEST_ID + 1),
) -> tuple[tuple[Found, ...], int]:
    """Ask every id who is there; gives also the number of bytes that made no sense.

    Two servos with one id answer over each other; whole answers that differ are two servos.
    """
    byte_s = BITS_PER_BYTE / baud
    port.drain()
    raw = b""
    for servo_id in ids:
        if progress is not None:
            progress(baud, servo_id)
        raw += _answer(
            port, read(servo_id, 0, IDENTITY_LENGTH), IDENTITY_LENGTH, byte_s, patience_s
        )
    raw += port.read_until(1 << 12, port.now_s() + REPLY_S)
    heard = _heard(raw)
    found = (_found(status, baud) for status in heard.answers)
    return tuple(dict.fromkeys(one for one in found if one is not None)), heard.junk


def anybody(port: BusPort) -> bool:
    """Return whether anyone answers a ping to everybody; their answers may spoil each other."""
    question = instruction(BROADCAST, PING)
    port.drain()
    port.write(question)
    heard = port.read_until(1 << 12, port.now_s() + REPLY_S)
    # An adapter that echoes puts the question before the answers.
    return bool(heard.replace(question, b"", 1))


def identify(
    port: BusPort, servo_id: int, byte_s: float, patience_s: float = REPLY_S
) -> tuple[int, int] | None:
    """Ask one servo what it is; gives model number and firmware, None where no answer came."""
    port.clearPort()
    request = read(servo_id, 0, IDENTITY_LENGTH)
    raw = _answer(port, request, IDENTITY_LENGTH, byte_s, patience_s)
    for status in statuses(raw):
        one = _found(status, 0)
        if one is not None and one.id == servo_id:
            return one.number, one.firmware
    return None


def ping(port: BusPort, servo_id: int, baud: int, tries: int = 2) -> Found | None:
    """Ask one servo; None where no whole answer came."""
    for _ in range(tries):
        port.drain()
        seen = identify(port, servo_id, BITS_PER_BYTE / baud)
        if seen is not None:
            return Found(servo_id, *seen, baud)
    return None


def garbled(port: BusPort, servo_id: int, tries: int = 6) -> int:
    """Count how many of some answers of one servo came in pieces, or disagreed about where it is.

    Two servos with one id speak at the same time: where their bytes differ they spoil
    each other. Positions hardly ever agree.
    """
    request = read(servo_id, _TELLING, _TELLING_LENGTH)
    byte_s = BITS_PER_BYTE / float(getattr(port, "baudrate", FACTORY_BAUD))
    bad, places = 0, list[int]()
    for _ in range(tries):
        port.drain()
        raw = _answer(port, request, _TELLING_LENGTH, byte_s, REPLY_S)
        whole = [
            s
            for s in statuses(raw)
            if s.intact and s.id == servo_id and len(s.params) == _TELLING_LENGTH
        ]
        register = REGISTERS["present_position"]
        places += [register.decode(status.params[:2]) for status in whole]
        bad += bool(raw and not whole)
    # The sum of two answers is right now and then by chance, but not about the place.
    wide = bool(places) and max(places) - min(places) > STEPS_PER_TURN // 8
    return max(bad, SHARED if wide else 0)


def _found(status: Status, baud: int) -> Found | None:
    """Take a status for the answer about the first registers, None where it is none."""
    data = status.params
    if not status.intact or len(data) != IDENTITY_LENGTH or data[5] != status.id:
        return None
    return Found(status.id, data[3] | data[4] << 8, 100 * data[0] + data[1], baud)


def _answer(port: BusPort, request: bytes, length: int, byte_s: float, patience_s: float) -> bytes:
    """Send a request to one servo; gives what came up to an answer with ``length`` params."""
    port.write(request)
    size = length + STATUS_OVERHEAD
    deadline_s = port.now_s() + (len(request) + size) * byte_s + patience_s
    raw = port.read_until(size, deadline_s)
    # An adapter that echoes puts the question before the answer.
    while raw and not any(len(s.params) == length for s in statuses(raw)):
        more = port.read_until(size - len(raw) if len(raw) < size else len(request), deadline_s)
        if not more:
            break
        raw += more
    return raw


def _heard(raw: bytes) -> Heard:
    """Sort what came into whole statuses and junk; echoes of requests are neither."""
    whole = tuple(status for status in statuses(raw) if status.intact)
    used = sum(STATUS_OVERHEAD + len(status.params) for status in whole)
    return Heard(whole, max(0, len(raw) - used))
