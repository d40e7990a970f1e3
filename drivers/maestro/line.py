"""Exchanges with one Maestro: bounded waits, drained lines, counts.

Answers have no address and no checksum, so a late answer looks like any other. After a missing
answer the line is drained before the next request.
"""

from collections import Counter
from collections.abc import Sequence

from gazerig.drivers.bus.timing import TIMING, BusTiming
from gazerig.drivers.maestro.commands import MOST, PROTOCOL_ERROR, WORD, MaestroCodec, decode_words
from gazerig.drivers.maestro.params import MaestroParams
from gazerig.drivers.process.host_lateness import HostLateness
from gazerig.drivers.serial.port import BITS_PER_BYTE, QUIET_S, BusPort

AT_ONCE = 6
"""Largest number of requests in one write, as the board's receive buffer is small."""

GREETINGS = 4


ALIKE_STEPS, FASTEST_STEPS_S = 200, 40_000.0
"""Largest difference between two answers about a pulse, plus a speed times the time between
them."""


class MaestroLink:
    """A port with one board; every method may raise BusLost.

    codec: encoder of the board's commands
    tx_bytes, rx_bytes: counts since creation
    errors: counts by kind
    lateness: counter of answers after their time-outs
    """

    def __init__(self, port: BusPort, params: MaestroParams, timing: BusTiming = TIMING) -> None:
        self.port = port
        self.codec = MaestroCodec(params.crc, params.channels)
        self.tx_bytes = self.rx_bytes = 0
        self.errors: Counter[str] = Counter()
        self.lateness = HostLateness()
        self._byte_s = BITS_PER_BYTE / params.baud
        self._reply_timeout_s = timing.reply_timeout_s
        self._late = False
        self._owed_bytes = 0
        self._unhandled_errors = 0

    def send(self, packet: bytes) -> None:
        """Send commands that are not answered."""
        self.port.write(packet)
        self.tx_bytes += len(packet)

    def ask(self, packet: bytes, length: int) -> bytes | None:
        """Send requests and return their answers; None if they do not come in time."""
        port = self.port
        if self._late or self._owed_bytes:
            # After a silence answers to earlier requests may come first.
            dropped = port.drain()
            if 0 < dropped <= self._owed_bytes:
                self.lateness.record_late_answer(port.now_s())
            if not self._late and not dropped:
                self._owed_bytes = 0
        wire_s = (len(packet) + length) * self._byte_s
        deadline_s = port.now_s() + wire_s + self._reply_timeout_s
        answer, _ = port.exchange(packet, length, deadline_s)
        self.tx_bytes += len(packet)
        self.rx_bytes += len(answer)
        self._late = len(answer) < length
        self._owed_bytes += length - len(answer)
        if self._late:
            self.lateness.record_wait(deadline_s, port.now_s())
            self.errors["incomplete" if answer else "timeout"] += 1
            return None
        return answer

    def ask_words(self, packet: bytes, count: int) -> tuple[int, ...] | None:
        """Send requests and return their answers as 16-bit words; None without a good answer."""
        answer = self.ask(packet, WORD * count)
        if answer is None:
            return None
        found = decode_words(answer)
        if max(found) > MOST:
            # No pulse width and no error register is this large: bytes were lost or added.
            self.errors["damaged"] += 1
            self._late = True
            return None
        return found

    def send_checked(self, packet: bytes) -> bool:
        """Send commands and return whether the board has found no error.

        On an error it may have stopped all pulses, so no command that moves a servo may follow.
        """
        found = self.ask_words(packet + self.codec.errors(), 1)
        if found is None:
            return False
        self._unhandled_errors |= found[0]
        return not found[0]

    def take_errors(self) -> int:
        """Return the errors that ``send_checked`` has found since the last call."""
        register, self._unhandled_errors = self._unhandled_errors, 0
        return register

    def stop(self, channels: Sequence[int], last_try: bool = False) -> None:
        """Stop pulses."""
        # Each by its own command, so that a damaged one affects no other.
        self.send(b"".join(self.codec.target(channel, 0) for channel in channels))

    def wait_for_answer(self) -> int | None:
        """Read the errors until the board answers; None if it stays silent."""
        answers = (self.read_errors() for _ in range(GREETINGS))
        return next((register for register in answers if register is not None), None)

    def expects_crc(self) -> bool:
        """Return whether the board expects check bytes.

        Other boards answer too, but find an error in every command.
        """
        if not self.codec.crc:
            return True
        self.ask_words(self.codec.errors(), 1)
        found = self.ask_words(self.codec.errors(), 1)
        return found is None or not found[0] >> PROTOCOL_ERROR & 1

    def read_errors(self) -> int | None:
        """Read the errors once; None without an answer."""
        found = self.ask_words(self.codec.errors(), 1)
        return found[0] if found is not None else None

    def read_pulses(self, channels: Sequence[int]) -> tuple[int, ...] | None:
        """Read the pulse widths of some channels, quarter microseconds; 0: no pulses.

        They are read twice, as answers have no checksum and decide the position at which a channel
        is held. The result is None without an answer, if both reads differ, or if more bytes arrive
        than requested: after a doubled answer every pulse would be assigned to the next channel.
        """
        first, began_s = self._pulses_once(channels), self.port.now_s()
        second = None if first is None else self._pulses_once(channels)
        if first is None or second is None:
            return None
        reach = ALIKE_STEPS + FASTEST_STEPS_S * (self.port.now_s() - began_s)
        alike = all(
            bool(one) == bool(other) and abs(one - other) <= reach
            for one, other in zip(first, second, strict=True)
        )
        # Only for several channels, as it takes 3 ms: all are read only after an anomaly.
        over = len(channels) > 1 and self.port.read_until(1, self.port.now_s() + QUIET_S)
        if over or not alike:
            self.errors["damaged"] += 1
            self._late = True
            return None
        return second

    def _pulses_once(self, channels: Sequence[int]) -> tuple[int, ...] | None:
        found: tuple[int, ...] = ()
        for i in range(0, len(channels), AT_ONCE):
            some = channels[i : i + AT_ONCE]
            packet = b"".join(self.codec.position(channel) for channel in some)
            got = self.ask_words(packet, len(some))
            if got is None:
                return None
            found += got
        return found
