"""Exchanges with one Maestro."""

import struct
from collections.abc import Sequence

from gazerig.drivers.bus.timing import TIMING, BusTiming
from gazerig.drivers.maestro.commands import (
    GET_ERRORS,
    GET_POSITION,
    MOST,
    PROTOCOL_ERROR,
    SCRIPT_STATUS,
    SET_TARGET,
    STOP_SCRIPT,
    MaestroCodec,
)
from gazerig.drivers.maestro.params import MaestroParams
from gazerig.drivers.serial.plain_line import PlainLine
from gazerig.drivers.serial.port import QUIET_S, BusPort

AT_ONCE = 6
"""Largest number of requests in one write, as the board's receive buffer is small."""

GREETINGS = 4

ALIKE_STEPS, FASTEST_STEPS_S = 200, 40_000.0
"""Largest difference between two answers about a pulse, plus a speed times the time between
them."""


class MaestroLink(PlainLine):
    """A port with one board; every method may raise BusLost.

    codec: encoder of the board's commands
    """

    def __init__(self, port: BusPort, params: MaestroParams, timing: BusTiming = TIMING) -> None:
        super().__init__(port, params.baud, timing.reply_timeout_s)
        self.codec = MaestroCodec(params.crc, params.channels)

    def ask(self, packet: bytes, length: int) -> bytes | None:
        """Send requests and return their answers; None if they do not come in time."""
        answer = self.exchange(packet, length)
        if len(answer) == length:
            return answer
        self.record_missing(answer)
        return None

    def ask_words(self, packet: bytes, count: int) -> tuple[int, ...] | None:
        """Send requests and return their answers as 16-bit words; None without a good answer."""
        answer = self.ask(packet, 2 * count)
        if answer is None:
            return None
        found = struct.unpack(f"<{count}H", answer)
        if max(found) > MOST:
            self.record_damage()
            return None
        return found

    def stop(self, channels: Sequence[int], last_try: bool = False) -> None:
        """Stop pulses."""
        # Each by its own command, so that a damaged one affects no other.
        self.send(b"".join(self.codec.number(SET_TARGET, channel, 0) for channel in channels))

    def read_errors(self) -> int | None:
        """Read the error register, which clears it; None if the board is silent."""
        for _ in range(GREETINGS):
            found = self.ask_words(self.codec.command(GET_ERRORS), 1)
            if found is not None:
                return found[0]
        return None

    def expects_crc(self) -> bool:
        """Return whether the board expects check bytes.

        Other boards answer too, but find an error in every command.
        """
        if not self.codec.crc:
            return True
        self.ask_words(self.codec.command(GET_ERRORS), 1)
        found = self.ask_words(self.codec.command(GET_ERRORS), 1)
        return found is None or not found[0] >> PROTOCOL_ERROR & 1

    def is_script_running(self) -> bool | None:
        """Return whether the board's own script runs, None without an answer."""
        status = self.ask(self.codec.command(SCRIPT_STATUS), 1)
        return None if status is None else status == b"\0"

    def stop_script(self) -> None:
        """Stop the board's own script."""
        self.send(self.codec.command(STOP_SCRIPT))

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
            self.record_damage()
            return None
        return second

    def _pulses_once(self, channels: Sequence[int]) -> tuple[int, ...] | None:
        found: tuple[int, ...] = ()
        for i in range(0, len(channels), AT_ONCE):
            some = channels[i : i + AT_ONCE]
            packet = b"".join(self.codec.command(GET_POSITION, channel) for channel in some)
            got = self.ask_words(packet, len(some))
            if got is None:
                return None
            found += got
        return found
