"""Exchanges on a servo bus: bounded waiting, clean lines, counts, starvation noticed."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from math import inf

from gazerig.drivers.process.host_lateness import HostLateness
from gazerig.drivers.serial.port import BABBLE_S, BITS_PER_BYTE, QUIET_S, BusPort
from gazerig.drivers.servo_bus.adaptive_timeout import AdaptiveTimeout
from gazerig.drivers.servo_bus.family import Family
from gazerig.drivers.servo_bus.poll_list import silent_servos

TRIES, HURRIED = 3, 4.0
SETUP_PAUSES_S = 0.1, 0.4
"""Pauses before a servo that stayed silent is asked again, outside the loop."""

_ROOM = 4096
_BACKLOG_S = 0.05


class Transactions:
    """A port with the time-outs of one bus; every method may raise BusLost.

    What is asked and written here goes through sync read and sync write even for a single
    servo: an echo of such a question cannot be taken for its answer.

    family: the make of the servos
    tx_bytes, rx_bytes: counts since it was made
    errors: counts by kind
    timeout: that of the cyclic exchange; all others have the longest
    tries: how often a servo is asked outside the cyclic exchange; in the loop, once
    starving_s: silence after which a servo's own watchdog trips; inf where none is armed
    starved: such a silence has happened
    lateness: how this computer was late: its own silences, answers after waiting had ended
    quiet: nothing came any more when the last exchange was given up
    whole_s: when the last exchange's answer was due as far as the wire goes
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
        self._silent = self._reply_owed = False
        self.quiet = True
        self.whole_s, self._reserved = 0.0, True
        self.baud, self._byte_s = baud, BITS_PER_BYTE / baud
        self._sent_s = port.now_s()
        self._free_s = self._sent_s

    def label(self, servo_id: int) -> str:
        """Name a servo for people."""
        return self._names.get(servo_id, f"servo {servo_id}")

    def send(self, packet: bytes) -> None:
        """Send a packet."""
        port = self.port
        now_s = port.now_s()
        port.write(packet)
        # Up to after the write: the host may have been asleep just before the bytes left.
        if port.now_s() - self._sent_s >= self.starving_s:
            self._starve(port.now_s() - self._sent_s)
        self._sent_s = now_s
        # Bytes leave after those still on their way out, at the bus's own speed.
        free_s = self._free_s if now_s <= self._free_s <= now_s + _BACKLOG_S else now_s
        self._free_s = free_s + len(packet) * self._byte_s
        self.tx_bytes += len(packet)

    def _starve(self, silent_s: float) -> None:
        """Record a silence of this computer after which the servos' watchdogs have tripped."""
        self.starved = True
        self.lateness.own_silence(silent_s, self.port.now_s())

    def exchange(self, request: bytes, length: int, reserve: bool = True) -> tuple[bytes, float]:
        """Send a request, wait for ``length`` bytes; return what came, and when.

        The wait ends as the time-out does, beyond the time the bytes take on the wire.

        Args:
            request: the packet.
            length: bytes of a whole answer.
            reserve: wait for as long as the time-out's reserve goes; else only promptly.
        """
        port, timeout = self.port, self.timeout
        # What is here before the question cannot be its answer: it is that of an earlier one.
        waited = self._reply_owed and bool(port.getBytesAvailable())
        if waited:
            self._note_late(port.read_until(_ROOM, port.now_s()))
        now_s, prompt_s = port.now_s(), timeout.seconds
        # Times and counts as in ``send``, which would be one function more in every tick.
        free_s = self._free_s if now_s <= self._free_s <= now_s + _BACKLOG_S else now_s
        self._free_s = free_s = free_s + len(request) * self._byte_s
        self.tx_bytes += len(request)
        self.whole_s = whole_s = free_s + length * self._byte_s
        self._reserved = reserve
        raw, sent_s = port.exchange(request, length, whole_s + 0.5 * prompt_s)
        if sent_s - self._sent_s >= self.starving_s:
            self._starve(sent_s - self._sent_s)
        self._sent_s = now_s
        self.quiet = False
        if len(raw) < length:
            raw += self._wait_on(length - len(raw), 0.5 * prompt_s)
        at_s = port.now_s()
        self.rx_bytes += len(raw)
        # The first that is heard after a silence may be owed, too: more of that may follow.
        self._reply_owed = not raw or (self._reply_owed and (self._silent or waited))
        self._silent = not raw
        if len(raw) == length:
            timeout.update(at_s - whole_s)
        else:
            timeout.waited_in_vain(at_s - whole_s - prompt_s, at_s)
        return raw, at_s

    @property
    def deadline_s(self) -> float:
        """Return the end of the last exchange's time-out."""
        timeout = self.timeout
        wait_s = timeout.with_reserve(self._sent_s) if self._reserved else timeout.seconds
        return self.whole_s + wait_s

    def _wait_on(self, length: int, rest_s: float) -> bytes:
        """Return bytes that have not come within half of the prompt time-out.

        The last ``rest_s`` of the whole time-out show whether the line has fallen silent.
        """
        end_s = self.deadline_s
        late = self.port.read_until(length, end_s - rest_s) if self._reserved else b""
        if len(late) == length:
            return late
        more = self.port.read_until(length - len(late), end_s)
        self.quiet = not more
        return late + more

    def complete(self, raw: bytes, missing: Callable[[bytes], int], deadline_s: float) -> bytes:
        """Wait on for an answer that has turned out to be longer than its shortest form."""
        while wanted := missing(raw):
            more = self.port.read_until(wanted, deadline_s)
            if not more:
                self.quiet = True
                break
            self.rx_bytes += len(more)
            raw += more
        return raw

    def drain(self, quiet_s: float = QUIET_S) -> int:
        """Throw away what arrives until the line is quiet; return the number of bytes.

        Stops after a while on a line that never falls silent.
        """
        end_s = self.port.now_s() + BABBLE_S
        dropped = b""
        while True:
            more = self.port.read_until(_ROOM, self.port.now_s() + quiet_s)
            dropped += more
            self.rx_bytes += len(more)
            if not more or self.port.now_s() >= end_s or len(dropped) >= 16 * _ROOM:
                if dropped and self._reply_owed:
                    self._note_late(dropped)
                    self._silent = False
                return len(dropped)

    def _note_late(self, raw: bytes) -> None:
        """Record answers that came after waiting for them had ended; noise is none."""
        if any(status.intact for status in self.family.codec.statuses(raw)):
            self.lateness.late_answer(self.port.now_s())

    def ask_bytes(self, ids: Sequence[int], address: int, length: int) -> dict[int, bytes]:
        """Read the same bytes of several servos.

        A silent servo silences those behind it: they are asked again without it, and it
        alone where it may be asked more than once. In the loop, where no servo answers at all
        that is the end of it.
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
        # A computer that is busy may have kept an answer back, and a servo may be restarting.
        pauses_s = (*[0.0] * (self.tries - 1), *SETUP_PAUSES_S) if self.tries > 1 else ()
        for pause_s in pauses_s:
            silent = [i for i in silent if i not in values]
            if silent and pause_s:
                self.drain(pause_s)
            for servo_id in silent:
                values.update(self._ask((servo_id,), address, length))
        return values

    def ask(self, ids: Sequence[int], name: str) -> dict[int, int]:
        """Read one register of several servos; who is not in the answer did not answer well."""
        register = self.family.registers[name]
        found = self.ask_bytes(ids, register.address, register.size)
        return {servo_id: register.decode(data) for servo_id, data in found.items()}

    def write_all(self, ids: Sequence[int], name: str, values: Iterable[int]) -> None:
        """Write one register of several servos; no servo confirms it."""
        register = self.family.registers[name]
        rows = [register.encode(value) for value in values]
        self.send(self.family.codec.sync_write(ids, register.address, register.size, rows))

    def _ask(self, ids: Sequence[int], address: int, length: int) -> dict[int, bytes]:
        """Read the same bytes of several servos once; return those of servos that answered well."""
        found: dict[int, bytes] = {}
        alone = not self.family.sync_read
        # Where a question's echo looks like an answer the answer must be of another length.
        more = int(alone and length == self.family.codec.ECHO_LENGTH)
        for asked in self.family.asked_together(ids):
            answers = self._ask_once(asked, address, length + more)
            found |= {servo_id: data[:length] for servo_id, data in answers.items()}
        return found

    def _ask_once(self, ids: Sequence[int], address: int, length: int) -> dict[int, bytes]:
        """Send one request and return the bytes of the servos that answered well."""
        codec = self.family.codec
        self.port.clearPort()
        self.send(self.family.request(ids, address, length))
        deadline_s = self._ends_s(len(ids) * (length + codec.STATUS_OVERHEAD))
        found: dict[int, bytes] = {}
        refused: set[int] = set()

        def missing(raw: bytes) -> int:
            others = 0
            for status in codec.statuses(raw):
                if status.intact and status.id in ids and status.error & codec.REFUSAL:
                    refused.add(status.id)
                elif status.id not in ids or len(status.params) != length:
                    others += 1
                elif status.intact:
                    found[status.id] = status.params
            done = len(found.keys() | refused) >= len(ids)
            return 0 if done else codec.bytes_missing(raw, len(ids) + others, length)

        self.complete(b"", missing, deadline_s)
        if len(found) < len(ids):
            self.drain()
        return found

    def _ends_s(self, answer_bytes: int) -> float:
        """Return until when an answer to what was just sent is waited for.

        In the loop others are waiting, and how late answers are has been measured.
        """
        hurried_s = min(self.most_s, HURRIED * self.timeout.seconds)
        timeout_s = self.most_s if self.tries > 1 else hurried_s
        return self._free_s + answer_bytes * self._byte_s + timeout_s
