"""Exchanges on a servo bus: bounded waits, late answers, counts, detection of starvation."""

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from math import inf

from gazerig.drivers.process.host_lateness import HostLateness
from gazerig.drivers.serial.port import BABBLE_S, BITS_PER_BYTE, QUIET_S, TIMING, BusPort
from gazerig.drivers.servo_bus.family import Family, Identity, Status
from gazerig.drivers.servo_bus.poll_list import silent_servos

FACTOR, DECAY = 2.0, 0.99
"""The time-out is twice the longest delay of the answers so far, which decays with each answer."""

TRIES, HURRIED = 3, 2.0
SETUP_PAUSES_S = 0.1, 0.4
"""Pauses before a silent servo is read again, outside the loop."""

REPLY_S = 0.04
"""Time-out of a request to one servo, outside the loop: the longest return delay and two turns of a
16 ms latency timer."""

LATE_S = 0.15
"""Longest delay of an answer after its time-out."""

ROOM = 4096
"""Largest number of bytes read at once from a line that does not fall silent."""


def sort_answers(
    statuses: Iterable[Status], ids: Collection[int], length: int, refusal: int
) -> tuple[dict[int, Status], set[int]]:
    """Return the answers of some servos with ``length`` params, or with bits of ``refusal``.

    Two equal answers are an echo; two different ones are those of two servos with one id.

    Returns:
        Intact answers by id, refusals included, and servos whose answers are damaged or disagree.
    """
    good: dict[int, Status] = {}
    damaged, twofold = set[int](), set[int]()
    for status in statuses:
        if status.id not in ids:
            continue
        fits = len(status.params) == length or (status.error & refusal and not status.params)
        if not status.intact:
            damaged.add(status.id)
        elif fits and good.setdefault(status.id, status) != status:
            twofold.add(status.id)
    for servo_id in twofold:
        del good[servo_id]
    return good, (damaged - good.keys()) | twofold


class Transactions:
    """A port with the time-outs of one bus; every method may raise BusLost.

    A bus without a USB adapter answers within microseconds, an adapter with a latency timer of 1 ms
    within about two, one left at 16 ms within 16. The adapter does not report its timer, so the
    delay is measured.

    Args:
        port: Its port.
        family: Family of the servos.
        baud: Bit/s; 0: that of the open port.
        most_s: Longest time-out of an answer in addition to its bytes on the wire, seconds; the
            first one, and always used outside the loop.
        names: Labels of the servos for messages.

    timeout_s: present time-out of an answer in addition to its bytes on the wire
    tx_bytes, rx_bytes: counts since creation
    errors: counts by kind
    tries: number of attempts to reach a servo outside the cyclic exchange; 1 in the loop
    refusal: error number of the newest request to one servo if it was refused, otherwise 0
    starving_s: silence after which a servo's own watchdog trips; inf if none is armed
    starved: whether such a silence has happened
    lateness: delays of this computer: its own silences, answers after their time-outs
    deadline_s: end of the last time-out
    """

    def __init__(
        self,
        port: BusPort,
        family: Family,
        baud: int = 0,
        most_s: float = TIMING.reply_timeout_s,
        names: Mapping[int, str] | None = None,
    ) -> None:
        self.port, self.family = port, family
        self._names = names or {}
        self.tx_bytes = self.rx_bytes = 0
        self.errors: Counter[str] = Counter()
        self._least_s, self.most_s = min(family.prompt_timeout_s, most_s), most_s
        self.timeout_s = most_s
        self.tries, self.refusal = TRIES, 0
        self._late_until_s: dict[int, float] = {}
        self.starving_s = inf
        self.starved = self._is_owed = False
        self.lateness = HostLateness()
        self.baud: int = baud or getattr(port, "baudrate", family.factory_baud)
        self._byte_s = BITS_PER_BYTE / self.baud
        self._sent_s = self._free_s = self.deadline_s = port.now_s()

    def label(self, servo_id: int) -> str:
        """Return a servo's label for messages."""
        return self._names.get(servo_id, f"servo {servo_id}")

    def send(self, packet: bytes) -> None:
        """Send a packet."""
        now_s = self.port.now_s()
        if now_s - self._sent_s >= self.starving_s:  # the servos' watchdogs have tripped
            self.starved = True
            self.lateness.record_own_silence(now_s - self._sent_s, now_s)
        self._sent_s = now_s
        count = len(packet)
        self.tx_bytes += count
        # Bytes leave after those still in the output buffer, at the speed of the bus.
        free_s = self._free_s if self._free_s > now_s else now_s
        self._free_s = free_s + count * self._byte_s
        self.port.write(packet)

    def exchange(self, request: bytes, length: int) -> tuple[bytes, float]:
        """Send a request and wait for ``length`` bytes.

        The wait ends with the time-out, which is added to the time of the bytes on the wire. It is
        lengthened at once if needed, and shortened slowly.

        Returns:
            The received bytes, and the time of their arrival, seconds.
        """
        port = self.port
        if self._is_owed:
            self._count_late(port.read_until(ROOM, port.now_s()))
        self.send(request)
        whole_s = self._free_s + length * self._byte_s
        self.deadline_s = deadline_s = whole_s + self.timeout_s
        raw = port.read_until(length, deadline_s)
        at_s = port.now_s()
        self.rx_bytes += len(raw)
        self._is_owed = len(raw) < length
        if self._is_owed:
            self.lateness.record_wait(deadline_s, at_s)
            return raw, at_s
        wanted_s, timeout_s = FACTOR * (at_s - whole_s), DECAY * self.timeout_s
        if wanted_s > timeout_s:
            timeout_s = wanted_s
        if timeout_s < self._least_s:
            timeout_s = self._least_s
        self.timeout_s = timeout_s if timeout_s < self.most_s else self.most_s
        return raw, at_s

    def collect(
        self,
        request: bytes,
        raw: bytes,
        ids: Collection[int],
        length: int,
        parse: Callable[[bytes], list[Status]],
    ) -> tuple[dict[int, Status], set[int]]:
        """Return the answers in received bytes, after waiting for those that have not arrived.

        Some adapters return the request before the answers.
        """
        while True:
            statuses = parse(raw.replace(request, b"", 1))
            good, damaged = sort_answers(statuses, ids, length, self.family.codec.REFUSAL)
            if len(good) + len(damaged) >= len(ids):
                return good, damaged
            more = self.port.read_until(1, self.deadline_s)
            if not more:
                return good, damaged
            more += self.port.read_until(ROOM, self.port.now_s())
            self.rx_bytes += len(more)
            raw += more

    def drain(self, quiet_s: float = QUIET_S) -> None:
        """Discard received bytes until the line is quiet; count intact answers as late ones.

        It stops after a while on a line that never falls silent.
        """
        end_s, dropped = self.port.now_s() + BABBLE_S, b""
        while more := self.port.read_until(ROOM, self.port.now_s() + quiet_s):
            dropped += more
            if self.port.now_s() >= end_s or len(dropped) >= 16 * ROOM:
                break
        self._count_late(dropped)

    def _count_late(self, raw: bytes) -> None:
        """Count intact answers that came after their time-outs: the next time-outs are longer."""
        self.rx_bytes += len(raw)
        if any(status.intact for status in self.family.codec.parse_statuses(raw)):
            self.lateness.record_late_answer(self.port.now_s())
            self.timeout_s = min(self.most_s, FACTOR * self.timeout_s)

    def ask_span(self, ids: Sequence[int], first: str, last: str) -> dict[int, dict[str, int]]:
        """Read a range of registers of several servos; return their values by id and name.

        A silent servo blocks the servos after it: they are read again without it. If several
        attempts are allowed, silent servos are read again, otherwise none if no servo answers.
        """
        address, length = self.family.span(first, last)
        values: dict[int, bytes] = {}
        # A busy computer may have delayed an answer, and a servo may be restarting.
        for pause_s in (0.0, 0.0, 0.0, *SETUP_PAUSES_S) if self.tries > 1 else (0.0,):
            left = [i for i in ids if i not in values]
            if left and pause_s:
                self.drain(pause_s)
            while left:
                answered = self.ask_once(left, address, length)
                values.update(answered)
                if self.tries == 1 and not answered:
                    break
                blamed = silent_servos(left, values)
                left = [i for i in left if i not in values and i not in blamed]
        return {i: self.family.decode(address, data) for i, data in values.items()}

    def ask(self, ids: Sequence[int], name: str) -> dict[int, int]:
        """Read one register of several servos; return the values of good answers by id."""
        return {i: values[name] for i, values in self.ask_span(ids, name, name).items()}

    def write_all(self, ids: Sequence[int], name: str, values: Iterable[int]) -> None:
        """Write one register of several servos; no servo confirms it."""
        self.send(self.family.sync_write(ids, name, values))

    def ask_once(self, ids: Sequence[int], address: int, length: int) -> dict[int, bytes]:
        """Read the same bytes of several servos once; return those of good answers."""
        found: dict[int, bytes] = {}
        # In the loop other servos wait, and the delay of answers has been measured.
        timeout_s = self.most_s if self.tries > 1 else min(self.most_s, HURRIED * self.timeout_s)
        for asked in [tuple(ids)] if self.family.sync_read else [(one,) for one in ids]:
            self.port.drain(0.0)
            good = self._request(
                self.family.request(asked, address, length), asked, length, timeout_s
            )
            if len(good) < len(asked):
                self.lateness.record_wait(self.deadline_s, self.port.now_s())
                self.drain()
            found |= {i: one.params for i, one in good.items() if len(one.params) == length}
        return found

    def _request(
        self, request: bytes, ids: Collection[int], length: int, timeout_s: float
    ) -> dict[int, Status]:
        """Send a request, and return the good answers with ``length`` params, by id."""
        codec = self.family.codec
        self.send(request)
        byte_count = len(ids) * (length + codec.STATUS_OVERHEAD)
        self.deadline_s = self._free_s + byte_count * self._byte_s + timeout_s
        good, damaged = self.collect(request, b"", ids, length, codec.parse_statuses)
        self.errors["corrupt"] += len(damaged)
        return good

    # --- one servo, each exchange confirmed: for tasks outside the loop

    def identify(self, servo_id: int) -> Identity | None:
        """Return a servo's model and firmware, None if it does not answer."""
        codec = self.family.codec
        request = codec.identity_request(servo_id)
        status = self._request_one(servo_id, request, codec.IDENTITY_LENGTH)
        return None if status is None else codec.parse_identity(status)

    def read(self, servo_id: int, name: str) -> int | None:
        """Return a register's value, None without a good answer."""
        return self.read_many(servo_id, (name,))[name]

    def read_many(self, servo_id: int, names: Iterable[str]) -> dict[str, int | None]:
        """Return values by name; adjacent registers are read together.

        The value is None without a good answer. A servo that falls silent is not read further.
        """
        values: dict[str, int | None] = dict.fromkeys(names)
        left = sorted((self.family.registers[name] for name in values), key=lambda r: r.address)
        while left:
            start = end = left[0].address
            while left and left[0].address == end:
                end += left.pop(0).size
            request = self.family.read(servo_id, start, end - start)
            status = self._request_one(servo_id, request, end - start)
            if status is not None:
                values |= self.family.decode(start, status.params)
            elif not self.refusal:
                break
        return values

    def write(self, servo_id: int, name: str, value: int) -> bool:
        """Write a register, again after a refusal; return whether the servo confirmed it."""
        request = self.family.write(servo_id, name, value)
        return self._request_one(servo_id, request, 0, insist=True) is not None

    def _request_one(
        self, servo_id: int, request: bytes, length: int, insist: bool = False
    ) -> Status | None:
        """Send a request until a good answer arrives; ``insist``: also after a refusal."""
        for _ in range(self.tries):
            # No answer to an earlier request may arrive any more, as it does not contain the
            # address of its register.
            self._count_late(self.port.read_until(ROOM, self._late_until_s.pop(servo_id, 0.0)))
            status = self._request(request, (servo_id,), length, REPLY_S).get(servo_id)
            self.refusal = 0 if status is None else status.error & self.family.codec.REFUSAL
            if status is None:
                self._late_until_s[servo_id] = self.port.now_s() + LATE_S
            elif not self.refusal:
                return status
            elif not insist:
                break
        return None

    def listen(self, request: bytes, length: int, timeout_s: float) -> bytes:
        """Send a request, and return up to ``length`` bytes that follow, without its echo."""
        self.send(request)
        deadline_s = self._free_s + length * self._byte_s + timeout_s
        raw = self.port.read_until(length, deadline_s)
        if request in raw:
            raw = raw.replace(request, b"", 1)
            raw += self.port.read_until(length - len(raw), deadline_s)
        return raw
