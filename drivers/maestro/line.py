"""Exchanges with one Maestro: bounded waiting, clean lines, counts.

Answers carry no address and no check, so an answer that came too late looks like any
other. After a missing answer the line is drained before the next request.
"""

from collections import Counter
from collections.abc import Sequence

from gazerig.drivers.maestro.commands import MOST, PROTOCOL_ERROR, WORD, MaestroCodec, decode_words
from gazerig.drivers.maestro.params import MaestroParams
from gazerig.drivers.process.host_lateness import HostLateness
from gazerig.drivers.serial.port import BITS_PER_BYTE, QUIET_S, BusPort

AT_ONCE = 6
"""So many questions in one write: the board's receive buffer is small."""

GREETINGS = 4

WAIT_PIECE_S = 0.1

ALIKE_STEPS, FASTEST_STEPS_S = 200, 40_000.0
"""Two answers about a pulse may be so far apart, and farther by the time between them."""


class MaestroLink:
    """A port with one board behind it; every method may raise BusLost.

    speech: encodes the board's commands
    tx_bytes, rx_bytes: counts since it was made
    errors: counts by kind
    lateness: answers that came after waiting had ended
    """

    def __init__(self, port: BusPort, params: MaestroParams) -> None:
        self.port = port
        self.speech = MaestroCodec(params.protocol, params.device, params.crc, params.channels)
        # A whole command in the Pololu form begins with the byte that a board waits for
        # which detects its baud rate; any other board takes it for the question it is.
        self._waking = MaestroCodec("pololu", params.device, params.crc).errors()
        self.tx_bytes = self.rx_bytes = 0
        self.errors: Counter[str] = Counter()
        self.lateness = HostLateness()
        self._byte_s = BITS_PER_BYTE / params.baud
        self._reply_timeout_s = params.reply_timeout_ms / 1000.0
        self._late = False
        self._owed = 0
        self._unhandled = 0

    def send(self, packet: bytes) -> None:
        """Send commands that are not answered."""
        self.port.write(packet)
        self.tx_bytes += len(packet)

    def ask(self, packet: bytes, length: int) -> bytes | None:
        """Send requests and return their answers; None if they do not come in time."""
        port = self.port
        if self._late or self._owed:
            # After a silence the answer to an older question may come first, and more behind it.
            dropped = port.drain()
            if 0 < dropped <= self._owed:
                self.lateness.late_answer(port.now_s())
            if not self._late and not dropped:
                self._owed = 0
        wire_s = (len(packet) + length) * self._byte_s
        deadline_s = port.now_s() + wire_s + self._reply_timeout_s
        answer, _ = port.exchange(packet, length, deadline_s)
        self.tx_bytes += len(packet)
        self.rx_bytes += len(answer)
        self._late = len(answer) < length
        self._owed += length - len(answer)
        if self._late:
            self.errors["incomplete" if answer else "timeout"] += 1
            return None
        return answer

    def ask_words(self, packet: bytes, count: int) -> tuple[int, ...] | None:
        """Send requests that are answered by 16-bit words; None if they are not."""
        answer = self.ask(packet, WORD * count)
        if answer is None:
            return None
        found = decode_words(answer)
        if max(found) > MOST:
            # No pulse width and no error register is so large: bytes were lost or added.
            self.errors["damaged"] += 1
            self._late = True
            return None
        return found

    def send_checked(self, packet: bytes) -> bool:
        """Send commands and return whether the board has found no error up to their end.

        On an error it may have stopped all pulses: what moves a servo must not come behind.
        """
        found = self.ask_words(packet + self.speech.errors(), 1)
        if found is None:
            return False
        self._unhandled |= found[0]
        return not found[0]

    def unheard(self) -> int:
        """Return the errors that ``send_checked`` has found since the last call."""
        register, self._unhandled = self._unhandled, 0
        return register

    def stop(self, channels: Sequence[int], last_try: bool = False) -> None:
        """Stop pulses."""
        # Each by its own command: one that is damaged on the way takes no other with it.
        self.send(b"".join(self.speech.target(channel, 0) for channel in channels))

    def greet(self) -> int | None:
        """Ask for the errors until the board answers; None if it stays silent.

        A board that has yet to detect its baud rate is sent the byte it waits for.
        """
        for attempt in range(GREETINGS):
            packet = self._waking if attempt % 2 else self.speech.errors()
            found = self.ask_words(packet, 1)
            if found is not None:
                return found[0]
        return None

    def takes_crc(self) -> bool:
        """Return whether the board expects the check bytes that it is sent.

        One that does not answers too, but finds an error in every command.
        """
        if not self.speech.crc:
            return True
        self.ask_words(self.speech.errors(), 1)
        found = self.ask_words(self.speech.errors(), 1)
        return found is None or not found[0] >> PROTOCOL_ERROR & 1

    def wake(self) -> int | None:
        """Ask for the errors once, so that a board that detects its baud rate wakes up."""
        found = self.ask_words(self._waking, 1)
        return found[0] if found is not None else None

    def pulses(self, channels: Sequence[int]) -> tuple[int, ...] | None:
        """Ask for the pulse widths of some channels, quarter microseconds; 0: no pulses.

        Asked twice, as answers carry no check, and much follows from what they are: where a
        channel is held. None if they did not come, if both differ, or if more came than was
        asked for: after a doubled answer every pulse would be taken for the next channel's.
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
        # Not in every read, as it takes 3 ms: all are asked for where something is odd.
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
            packet = b"".join(self.speech.position(channel) for channel in some)
            got = self.ask_words(packet, len(some))
            if got is None:
                return None
            found += got
        return found

    def wait(self, until_s: float) -> None:
        """Let time pass; what arrives meanwhile was not asked for."""
        # In pieces: each is a sign of life to the guardian that watches this port.
        while (now_s := self.port.now_s()) < until_s:
            got = self.port.read_until(1, min(until_s, now_s + WAIT_PIECE_S))
            if not got and self.port.now_s() <= now_s:
                return  # an emulated port in simulated time, where waiting takes none
