"""Exchanges on a servo bus: bounded waits, drained lines, counts, detection of starvation."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from math import inf

from gazerig.drivers.process.host_lateness import HostLateness
from gazerig.drivers.serial.port import BABBLE_S, BITS_PER_BYTE, QUIET_S, BusPort
from gazerig.drivers.servo_bus.family import Family
from gazerig.drivers.servo_bus.poll_list import silent_servos

WINDOW = 128
"""Number of answers in a window; a window's longest delays count until the end of the next one."""

RANK = 3
"""The third-longest delay counts: one or two answers in a window may be late."""

FACTOR = 2.0

RESERVE_S = 0.01
"""Size of a full reserve: a pause of the host up to this length loses no answer."""

REFILL = 0.01
"""Share of the elapsed time that refills the reserve."""


class AdaptiveTimeout:
    """Time-out derived from the delays of complete answers.

    A bus without a USB adapter answers within microseconds, an adapter with a latency timer of 1 ms
    within about two, one left at 16 ms within 16. The adapter does not report its timer, so the
    delay is measured. The prompt time-out is twice the longest recent delay, except for a few
    outliers, and has bounds.

    The outliers are delays of a host that was briefly busy, not of the bus. No prompt time-out can
    cover them, so a reserve is added to it. Only waits without an answer consume the reserve, and
    it refills with one hundredth of the elapsed time. So a pause of the computer loses no value,
    and silent servos cost at most one hundredth of the time in addition to their prompt time-outs.

    Args:
        least_s: Shortest prompt time-out, seconds.
        most_s: Longest time-out, the reserve included, seconds.

    seconds: the current prompt time-out; it begins at its longest
    """

    def __init__(self, least_s: float, most_s: float) -> None:
        self._least_s = min(least_s, most_s)
        self._most_s = most_s
        self.seconds = most_s
        self._before_s = 0.0
        self._worst_s = [0.0] * RANK
        self._count = 0
        self._empty_s = -inf

    def reserve_timeout_s(self, now_s: float) -> float:
        """Return the time-out with the whole reserve, seconds."""
        reserve_s = REFILL * (now_s - self._empty_s)
        return min(self._most_s, self.seconds + min(RESERVE_S, reserve_s))

    def consume_reserve(self, beyond_s: float, now_s: float) -> None:
        """Subtract from the reserve a wait without an answer, beyond the prompt time-out."""
        if beyond_s > 0.0:
            left_s = min(RESERVE_S, REFILL * (now_s - self._empty_s)) - beyond_s
            self._empty_s = now_s - max(0.0, left_s) / REFILL

    def update(self, late_s: float) -> None:
        """Record the delay of an answer beyond its time on the wire."""
        worst_s = self._worst_s
        if late_s > worst_s[0]:
            worst_s[0] = late_s
            worst_s.sort()
            if FACTOR * worst_s[0] > self.seconds:
                self.seconds = min(self._most_s, FACTOR * worst_s[0])
        self._count += 1
        if self._count >= WINDOW:
            late_s = max(self._before_s, self._worst_s[0])
            self.seconds = min(self._most_s, max(self._least_s, FACTOR * late_s))
            self._before_s, self._worst_s, self._count = self._worst_s[0], [0.0] * RANK, 0

    def record_late_answer(self) -> None:
        """Record that an answer came after its time-out."""
        self.update(self.seconds)


TRIES, HURRIED = 3, 4.0
SETUP_PAUSES_S = 0.1, 0.4
"""Pauses before a silent servo is read again, outside the loop."""

_ROOM = 4096
_BACKLOG_S = 0.05


class Transactions:
    """A port with the time-outs of one bus; every method may raise BusLost.

    All reads and writes use sync read and sync write even for a single servo: an echo of such a
    request cannot be mistaken for its answer.

    family: family of the servos
    tx_bytes, rx_bytes: counts since creation
    errors: counts by kind
    timeout: time-out of the cyclic exchange; all others have the longest one
    tries: number of attempts to read a servo outside the cyclic exchange; 1 in the loop
    starving_s: silence after which a servo's own watchdog trips; inf if none is armed
    starved: whether such a silence has happened
    lateness: delays of this computer: its own silences, answers after their time-outs
    quiet: whether the line was silent at the end of the last exchange
    whole_s: time at which the last answer was due, by its time on the wire
    """

    def __init__(
        self,
        port: BusPort,
        family: Family,
        least_s: float,
        most_s: float,
        baud: int,
        names: Mapping[int, str] | None = None,
    ) -> None:
        self.port, self.family = port, family
        self._names = names or {}
        self.tx_bytes = self.rx_bytes = 0
        self.errors: Counter[str] = Counter()
        self.timeout = AdaptiveTimeout(least_s, most_s)
        self.most_s = most_s
        self.tries = TRIES
        self.starving_s = inf
        self.starved = False
        self.lateness = HostLateness()
        self._silent = self._reply_owed = self._answer_owed = False
        self.quiet = True
        self.whole_s, self._reserved = 0.0, True
        self.baud, self._byte_s = baud, BITS_PER_BYTE / baud
        self._sent_s = port.now_s()
        self._free_s = self._sent_s

    def label(self, servo_id: int) -> str:
        """Return a servo's label for messages."""
        return self._names.get(servo_id, f"servo {servo_id}")

    def send(self, packet: bytes) -> None:
        """Send a packet."""
        port = self.port
        now_s = port.now_s()
        port.write(packet)
        # Measured after the write: the host may have slept just before the bytes left.
        if port.now_s() - self._sent_s >= self.starving_s:
            self._record_starvation(port.now_s() - self._sent_s)
        self._sent_s = now_s
        # Bytes leave after those still in the output buffer, at the speed of the bus.
        free_s = self._free_s if now_s <= self._free_s <= now_s + _BACKLOG_S else now_s
        self._free_s = free_s + len(packet) * self._byte_s
        self.tx_bytes += len(packet)

    def _record_starvation(self, silent_s: float) -> None:
        """Record a silence of this computer that tripped the servos' watchdogs."""
        self.starved = True
        self.lateness.record_own_silence(silent_s, self.port.now_s())

    def exchange(self, request: bytes, length: int, reserve: bool = True) -> tuple[bytes, float]:
        """Send a request and wait for ``length`` bytes.

        The wait ends with the time-out, which is added to the time of the bytes on the wire.

        Args:
            request: Packet to send.
            length: Number of bytes of a complete answer.
            reserve: Whether to use the time-out's reserve; otherwise only the prompt time-out.

        Returns:
            The received bytes, and the time of their arrival, seconds.
        """
        port, timeout = self.port, self.timeout
        # Bytes received before the request belong to an earlier one.
        waited = self._reply_owed and bool(port.getBytesAvailable())
        if waited:
            self.record_late(port.read_until(_ROOM, port.now_s()))
        now_s, prompt_s = port.now_s(), timeout.seconds
        # Times and counts as in ``send``, without the cost of another call every tick.
        free_s = self._free_s if now_s <= self._free_s <= now_s + _BACKLOG_S else now_s
        self._free_s = free_s = free_s + len(request) * self._byte_s
        self.tx_bytes += len(request)
        self.whole_s = whole_s = free_s + length * self._byte_s
        self._reserved = reserve
        raw, sent_s = port.exchange(request, length, whole_s + 0.5 * prompt_s)
        if sent_s - self._sent_s >= self.starving_s:
            self._record_starvation(sent_s - self._sent_s)
        self._sent_s = now_s
        self.quiet = False
        if len(raw) < length:
            end_s = self.deadline_s
            if reserve:
                raw += port.read_until(length - len(raw), end_s - 0.5 * prompt_s)
            if len(raw) < length:
                # The last half of the prompt time-out shows whether the line has fallen silent.
                more = port.read_until(length - len(raw), end_s)
                self.quiet = not more
                raw += more
        at_s = port.now_s()
        self.rx_bytes += len(raw)
        # The first bytes after a silence may be a late answer too: more may follow.
        self._reply_owed = not raw or (self._reply_owed and (self._silent or waited))
        self._silent = not raw
        if len(raw) == length:
            timeout.update(at_s - whole_s)
        else:
            timeout.consume_reserve(at_s - whole_s - prompt_s, at_s)
            self.lateness.record_wait(self.deadline_s, at_s)
        return raw, at_s

    @property
    def deadline_s(self) -> float:
        """Return the end of the last exchange's time-out."""
        timeout = self.timeout
        wait_s = timeout.reserve_timeout_s(self._sent_s) if self._reserved else timeout.seconds
        return self.whole_s + wait_s

    def wait_for_rest(
        self, raw: bytes, missing: Callable[[bytes], int], deadline_s: float
    ) -> bytes:
        """Continue to wait for an answer that is longer than its shortest form."""
        while wanted := missing(raw):
            more = self.port.read_until(wanted, deadline_s)
            if not more:
                self.quiet = True
                break
            self.rx_bytes += len(more)
            raw += more
        return raw

    def drain(self, quiet_s: float = QUIET_S, raw: bytes | None = None) -> int:
        """Discard received bytes until the line is quiet; return their number.

        It stops after a while on a line that never falls silent.

        raw: bytes that arrived in time, if more are owed: late ones may complete them
        """
        end_s = self.port.now_s() + BABBLE_S
        dropped = b""
        while True:
            more = self.port.read_until(_ROOM, self.port.now_s() + quiet_s)
            dropped += more
            self.rx_bytes += len(more)
            if not more or self.port.now_s() >= end_s or len(dropped) >= 16 * _ROOM:
                if dropped and self._reply_owed:
                    self.record_late(dropped)
                    self._silent = False
                elif dropped and raw is not None:
                    self.record_late(dropped, raw)
                return len(dropped)

    def record_late(self, raw: bytes, before: bytes = b"") -> bool:
        """Record answers that arrived after their time-outs; return whether there are any.

        Noise does not count.

        before: earlier bytes, which may be the begin of the first answer
        """
        parse = self.family.codec.parse_statuses
        intact = sum(status.intact for status in parse(before + raw))
        if intact <= sum(status.intact for status in parse(before)):
            return False
        self.lateness.record_late_answer(self.port.now_s())
        return True

    def ask_bytes(self, ids: Sequence[int], address: int, length: int) -> dict[int, bytes]:
        """Read the same bytes of several servos.

        A silent servo blocks the servos after it: they are read again without it, and it alone if
        several attempts are allowed. In the loop there is no further attempt if no servo answers.
        """
        values: dict[int, bytes] = {}
        left, silent = tuple(ids), list[int]()
        while left:
            answered = self._ask(left, address, length)
            values.update(answered)
            if self.tries == 1 and not answered:
                break
            blamed = silent_servos(left, values)
            silent += blamed
            left = tuple(i for i in left if i not in values and i not in blamed)
        # A busy computer may have delayed an answer, and a servo may be restarting.
        pauses_s = (*[0.0] * (self.tries - 1), *SETUP_PAUSES_S) if self.tries > 1 else ()
        for pause_s in pauses_s:
            silent = [i for i in silent if i not in values]
            if silent and pause_s:
                self.drain(pause_s)
            for servo_id in silent:
                values.update(self._ask((servo_id,), address, length))
        return values

    def ask(self, ids: Sequence[int], name: str) -> dict[int, int]:
        """Read one register of several servos; return the values of good answers by id."""
        register = self.family.registers[name]
        found = self.ask_bytes(ids, register.address, register.size)
        return {servo_id: register.decode(data) for servo_id, data in found.items()}

    def write_all(self, ids: Sequence[int], name: str, values: Iterable[int]) -> None:
        """Write one register of several servos; no servo confirms it."""
        register = self.family.registers[name]
        rows = [register.encode(value) for value in values]
        self.send(self.family.codec.sync_write(ids, register.address, register.size, rows))

    def _ask(self, ids: Sequence[int], address: int, length: int) -> dict[int, bytes]:
        """Read the same bytes of several servos once; return those of good answers."""
        found: dict[int, bytes] = {}
        alone = not self.family.sync_read
        # If a request's echo looks like an answer, another length must be requested.
        more = int(alone and length == self.family.codec.ECHO_LENGTH)
        for asked in self.family.request_groups(ids):
            answers = self._ask_once(asked, address, length + more)
            found |= {servo_id: data[:length] for servo_id, data in answers.items()}
        return found

    def _ask_once(self, ids: Sequence[int], address: int, length: int) -> dict[int, bytes]:
        """Send one request and return the bytes of good answers by id."""
        codec, port = self.family.codec, self.port
        if self._answer_owed and port.getBytesAvailable():
            self.record_late(port.read_until(_ROOM, port.now_s()))
        port.clearPort()
        self.send(self.family.request(ids, address, length))
        # In the loop other servos wait, and the delay of answers has been measured.
        answer_bytes = len(ids) * (length + codec.STATUS_OVERHEAD)
        hurried_s = min(self.most_s, HURRIED * self.timeout.seconds)
        timeout_s = self.most_s if self.tries > 1 else hurried_s
        deadline_s = self._free_s + answer_bytes * self._byte_s + timeout_s
        found: dict[int, bytes] = {}
        refused: set[int] = set()

        def missing(raw: bytes) -> int:
            others = 0
            for status in codec.parse_statuses(raw):
                if status.intact and status.id in ids and status.error & codec.REFUSAL:
                    refused.add(status.id)
                elif status.id not in ids or len(status.params) != length:
                    others += 1
                elif status.intact:
                    found[status.id] = status.params
            done = len(found.keys() | refused) >= len(ids)
            return 0 if done else codec.bytes_missing(raw, len(ids) + others, length)

        raw = self.wait_for_rest(b"", missing, deadline_s)
        self._answer_owed = len(found) < len(ids)
        if self._answer_owed:
            self.lateness.record_wait(deadline_s, port.now_s())
            self.drain(raw=raw)
        return found
