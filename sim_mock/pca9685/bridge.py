"""Emulated PCA9685 boards with a hobby servo on each channel, on an I2C bus behind a bridge.

Commands are those of NXP's SC18IM700, a bridge from a serial line to I2C: S, the address with its
direction bit, a count and, for a write, its bytes; further S are further starts; P ends it. R, a
register, P reads a register of the bridge: the status of the last transfer. Source: NXP,
SC18IM700 data sheet, rev. 2 (10 August 2007).
"""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from gazerig.sim_mock.faults.hobby import hobby_commands
from gazerig.sim_mock.hobby_board import HobbyBoard
from gazerig.sim_mock.hobby_servo import HobbyMaker, HobbyServo, HobbySpec, build_servos
from gazerig.sim_mock.pca9685.chip import CHANNELS, LED0, NOMINAL_HZ, Chip
from gazerig.sim_mock.replies import NO_DEVICE, Piece

START, STOP, READ_REGISTER = ord("S"), ord("P"), ord("R")
OK, NO_ACKNOWLEDGE = 0xF0, 0xF1
US_STEPS = 4

COMMANDS = hobby_commands(255, "transfers that only write")


class TransferPart(NamedTuple):
    """One start of a transfer; length: length of a read, None for a write."""

    address: int
    data: bytes
    length: int | None = None


class Bridge(HobbyBoard):
    """One bus behind a bridge; a servo's id is 16 times its board's number plus its channel.

    chips: chips by their addresses
    """

    def __init__(
        self,
        chips: dict[int, Chip],
        servos: Sequence[HobbyServo],
        now_s: Callable[[], float],
        seed: int,
    ) -> None:
        super().__init__(servos, now_s, COMMANDS, seed)
        self.chips = chips
        self._unread = b""
        self._status = OK

    # --- parts of HobbyBoard

    def restart(self) -> None:
        """Restart all boards as after a dip of their supply."""
        self.advance()
        for chip in self.chips.values():
            chip.reset()

    def pulse_steps(self, channel: int) -> int:
        """Return the true pulse of a channel, quarter microseconds; 0: none."""
        board, nth = divmod(channel, CHANNELS)
        width_s = tuple(self.chips.values())[board].width_s(nth)
        return round(width_s * 1e6 * US_STEPS)

    def execute(self, data: bytes) -> Iterator[Piece]:
        """Execute every complete command; an incomplete one waits for the rest."""
        kept, at = len(self._unread), 0
        text = self._unread + data
        while at < len(text):
            if text[at] == READ_REGISTER:
                end = at + 3
                if len(text) < end:
                    break
                yield Piece(NO_DEVICE, bytes((self._status,)), end - kept)
            elif text[at] == START:
                found = _parse_transfer(text, at)
                if found is None:
                    break
                end, parts = found
                answer = self._answer(parts)
                if answer:
                    yield Piece(self._channel_of(parts[0]), answer, end - kept)
            else:
                end = at + 1  # not a command: skip the byte
            at = end
        self._unread = text[at:]

    def _answer(self, parts: Sequence[TransferPart]) -> bytes:
        """Execute one transfer; return the bytes that it reads."""
        is_write = all(part.length is None for part in parts)
        self._status = OK
        if is_write and self.faults.use_fault("lose_writes"):
            return b""
        found = self.transfer(parts)
        if found is None:
            self._status = NO_ACKNOWLEDGE
        return found or b""

    def _channel_of(self, first: TransferPart) -> int:
        if first.data and LED0 <= first.data[0] < LED0 + 4 * CHANNELS:
            return [*self.chips].index(first.address) * CHANNELS + (first.data[0] - LED0) // 4
        return NO_DEVICE

    def transfer(self, parts: Sequence[TransferPart]) -> bytes | None:
        """Execute one transfer; return the bytes that it reads, None if it is not acknowledged."""
        self.advance()
        found = b""
        for address, data, length in parts:
            chip = self.chips.get(address)
            if chip is None:
                return None
            if length is not None:
                found += chip.read(length)
            elif data:
                chip.write(data)
        return found


def _parse_transfer(text: bytes, at: int) -> tuple[int, list[TransferPart]] | None:
    """Return the end of a transfer and its parts, None while bytes are missing."""
    parts: list[TransferPart] = []
    while at < len(text):
        if text[at] != START:
            return at + 1, parts if text[at] == STOP else []  # malformed: it is dropped
        if len(text) < at + 3:
            return None
        address, count = text[at + 1], text[at + 2]
        at += 3
        if address & 1:
            parts.append(TransferPart(address >> 1, b"", count))
            continue
        if len(text) < at + count:
            return None
        parts.append(TransferPart(address >> 1, text[at : at + count]))
        at += count
    return None


def build_bridge(
    addresses: Sequence[int],
    now_s: Callable[[], float],
    oscillator_hz: float = NOMINAL_HZ,
    seed: int = 0,
    servos: Sequence[HobbySpec] = (),
    make_servo: HobbyMaker = HobbyServo,
) -> Bridge:
    """Build boards at addresses; channels without a spec have a default servo.

    Raises:
        ValueError: such boards or servos do not exist.
    """
    if len(set(addresses)) < len(addresses) or not set(addresses) <= set(range(0x40, 0x80)):
        raise ValueError(f"boards need different addresses from 0x40 to 0x7f, not {addresses}")
    chips = {address: Chip(oscillator_hz) for address in addresses}
    built = build_servos(servos, CHANNELS * len(chips), make_servo)
    return Bridge(chips, built, now_s, seed)
