"""Looking for Dynamixel servos: who answers at which baud rate, and whether answers collide.

The SDK's broadcast ping waits 0.8 s whoever answers; here the wait ends when the line has
been quiet for a while, and a thorough search takes the SDK's time. Source of the packets:
ROBOTIS e-Manual, Protocol 2.0 and 1.0.
"""

import struct
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from gazerig.drivers.dynamixel.control_table import BAUD_RATES, MODELS
from gazerig.drivers.dynamixel.protocol import BROADCAST, ERROR_NUMBER, instruction, statuses
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.family import Status

FACTORY_BAUD = 57_600
COMMON_FIRST = (1_000_000, 57_600, 115_200, 2_000_000, 3_000_000, 4_000_000, 9_600, 4_500_000)
"""Every baud rate of the servos, the usual ones first."""

QUIET_S = 0.1
"""A line quiet for so long has no more answers to a broadcast, unless ids lie far apart."""

THOROUGH_S = 0.016 + 0.003 * 253
"""What the maker's SDK allows for all ids: 3 ms each and the adaptor's latency."""

REPLY_S = 0.04
"""Patience for one servo: the longest return delay and two turns of a 16 ms latency timer."""

BABBLE_S = 2.0
"""Listening gives up on a line that never falls silent."""

SHARED = 2
"""So many of six answers in pieces are no accident."""

PING, READ = 0x01, 0x02
_SPAN = struct.Struct("<HH")
_PING = struct.Struct("<HB")
_NAMES = {model.number: model.name for model in MODELS.values()}

# Realtime Tick .. Present Position: two servos that share an id differ somewhere in it.
_TELLING = _SPAN.pack(120, 16)
_PING_1 = b"\xff\xff\xfe\x02\x01\xfe"


class Found(NamedTuple):
    """One servo that answered; ``number``: its model number; ``baud``: at which it answered."""

    id: int
    number: int
    firmware: int
    baud: int

    @property
    def model(self) -> str:
        """Name the model, "model number 350" where it is not known here."""
        return _NAMES.get(self.number, f"model number {self.number}")

    @classmethod
    def of(cls, status: Status, baud: int) -> "Found | None":
        """Take a status for the answer to a ping, None where it is none."""
        if len(status.params) != _PING.size or status.error & ERROR_NUMBER:
            return None
        number, firmware = _PING.unpack(status.params)
        return cls(status.id, number, firmware, baud)


class Heard(NamedTuple):
    """What came back.

    answers: whole statuses; junk: bytes that were part of none
    """

    answers: tuple[Status, ...]
    junk: int


class Round(NamedTuple):
    """What one baud rate has brought.

    possible: the adaptor can run at it; junk: bytes that made no sense
    protocol_1: ids that answer to the old protocol only
    shared: ids that two servos seem to have, as their longer answers come in pieces
    """

    baud: int
    possible: bool
    found: tuple[Found, ...]
    junk: int = 0
    protocol_1: tuple[int, ...] = ()
    shared: tuple[int, ...] = ()


def scan(
    port: BusPort,
    bauds: Sequence[int] = COMMON_FIRST,
    thorough: bool = False,
    old_protocol: bool = True,
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
        found, junk = everybody(port, baud, THOROUGH_S if thorough else QUIET_S)
        old = _old_protocol(port) if old_protocol and not found else ()
        shared = tuple(i for i in {one.id: 0 for one in found} if garbled(port, i) >= SHARED)
        yield Round(baud, True, found, junk, old, shared)


def everybody(port: BusPort, baud: int, quiet_s: float = QUIET_S) -> tuple[tuple[Found, ...], int]:
    """Ask all servos at once who is there; gives also the number of bytes that made no sense."""
    heard = ask(port, instruction(BROADCAST, PING), quiet_s)
    found = (Found.of(status, baud) for status in heard.answers)
    return tuple(one for one in found if one is not None), heard.junk


def ping(port: BusPort, servo_id: int, baud: int, tries: int = 2) -> Found | None:
    """Ask one servo; None where no whole answer came."""
    for _ in range(tries):
        for status in ask_one(port, instruction(servo_id, PING), 14).answers:
            found = Found.of(status, baud)
            if found is not None and found.id == servo_id:
                return found
    return None


def garbled(port: BusPort, servo_id: int, tries: int = 6) -> int:
    """Count how many of some answers of one servo came in pieces.

    Two servos with one id speak at the same time: where their bytes differ they spoil
    each other. Pings are often equal, positions hardly ever.
    """
    request = instruction(servo_id, READ, _TELLING)
    heard = [ask_one(port, request, 27) for _ in range(tries)]
    return sum(1 for h in heard if h.junk and not any(s.id == servo_id for s in h.answers))


def reboot(port: BusPort, servo_id: int) -> None:
    """Tell a servo to restart; whether it has is seen by asking it afterwards."""
    ask_one(port, instruction(servo_id, 0x08), 11)


def ask_one(port: BusPort, request: bytes, length: int) -> Heard:
    """Send a request to one servo and take its answer of ``length`` bytes, or what came."""
    port.drain()
    port.write(request)
    raw = port.read_until(length, port.now_s() + REPLY_S + _wire_s(port, request, length))
    if _heard(raw).junk or not raw:
        raw += _until_quiet(port, 0.01)
    return _heard(raw)


def ask(port: BusPort, request: bytes, quiet_s: float) -> Heard:
    """Send a request and take all that comes until the line has been quiet for a while."""
    port.drain()
    port.write(request)
    return _heard(_until_quiet(port, quiet_s + _wire_s(port, request, 14)))


def _wire_s(port: BusPort, request: bytes, length: int) -> float:
    """Return the time that bytes take on the wire at the port's baud rate."""
    return (len(request) + length) * 10.0 / float(getattr(port, "baudrate", FACTORY_BAUD))


def _until_quiet(port: BusPort, quiet_s: float) -> bytes:
    end_s = port.now_s() + BABBLE_S
    raw = port.read_until(1, port.now_s() + quiet_s)
    while len(raw) and port.now_s() < end_s:
        more = port.read_until(1, port.now_s() + quiet_s)
        if not more:
            break
        raw += more
        if len(raw) > 8192:  # more than all ids can say
            break
    return raw


def _heard(raw: bytes) -> Heard:
    """Sort what came into whole statuses and junk."""
    whole = tuple(status for status in statuses(raw) if status.intact)
    used = sum(11 + len(status.params) for status in whole)
    return Heard(whole, max(0, len(raw) - used))


def _old_protocol(port: BusPort) -> tuple[int, ...]:
    """Ask in Protocol 1.0, which some servos are set to and other makers' servos speak."""
    port.drain()
    port.write(_PING_1)
    return old_answers(_until_quiet(port, REPLY_S))


def old_answers(raw: bytes) -> tuple[int, ...]:
    """Take the ids out of ping answers of Protocol 1.0: FF FF id 02 error checksum."""
    ids = []
    at = raw.find(b"\xff\xff")
    while 0 <= at <= len(raw) - 6:
        servo_id, length, error, checksum = raw[at + 2 : at + 6]
        good = length == 2 and servo_id <= 253 and raw[at : at + 6] != _PING_1
        if good and checksum == ~(servo_id + length + error) & 0xFF:
            ids.append(servo_id)
        at = raw.find(b"\xff\xff", at + 1)
    return tuple(ids)


def known_bauds(model: str) -> tuple[int, ...]:
    """List the baud rates a model can be set to."""
    return BAUD_RATES[:-1] if MODELS[model].family == "x330" else BAUD_RATES
