"""The host's end of an emulated I2C bus: command bytes in, answers out.

Commands are those of NXP's SC18IM700, a bridge from a serial line to I2C: S, the address with its
direction bit, a count and, for a write, its bytes; further S are further starts; P ends it. R, a
register, P reads a register of the bridge: the status of the last transfer. Source: NXP,
SC18IM700 data sheet, rev. 2 (10 August 2007).
"""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from gazerig.sim_mock.device import DeviceReply
from gazerig.sim_mock.faults.active import NO_DEVICE
from gazerig.sim_mock.faults.hobby import HobbyFaults
from gazerig.sim_mock.hobby_servo import HobbyMaker, HobbyServo, HobbySpec, build_servos
from gazerig.sim_mock.pca9685.body import CASES, COMMANDS, BusStuck, NotAcknowledged, Pca9685Body
from gazerig.sim_mock.pca9685.chip import CHANNELS, LED0, NOMINAL_HZ, Chip
from gazerig.sim_mock.replies import Piece

START, STOP, READ_REGISTER = ord("S"), ord("P"), ord("R")
STATUS_REGISTER = 0x0A
OK, NO_ACKNOWLEDGE, TIMED_OUT = 0xF0, 0xF1, 0xF8


class _TransferPart(NamedTuple):
    """One start of a transfer; length: length of a read, None for a write."""

    address: int
    data: bytes
    length: int | None


class Bridge:
    """One bus behind a bridge; a servo's id is 16 times its board's number plus its channel."""

    def __init__(
        self,
        servos: Sequence[HobbyServo],
        now_s: Callable[[], float],
        addresses: Sequence[int],
        oscillator_hz: float,
        seed: int,
    ) -> None:
        self.now_s = now_s
        chips = {address: Chip(oscillator_hz) for address in addresses}
        self.body = Pca9685Body(chips, servos, now_s)
        self.faults = HobbyFaults(self, COMMANDS, seed, header=b"S")
        self._wire = self.faults.wire
        self._order = {address: board for board, address in enumerate(addresses)}
        self._unread = b""
        self._status = OK
        self._pointers: dict[int, int] = {}
        self.check_baud = False

    # --- device interface

    def understands_baud(self, client_baud: int) -> bool:
        """Return True, because it accepts any baud rate."""
        return True

    def choose_behaviour(self, case: str, value: str) -> None:
        """Change a property of the boards."""
        if case not in CASES:
            raise ValueError(f"set {case!r}: unknown; expected {', '.join(CASES)}")
        try:
            mhz = float(value)
        except ValueError:
            mhz = 0.0
        if not 20.0 <= mhz <= 30.0:
            raise ValueError(f"{case} {value!r}: not a number of MHz from 20 to 30")
        self.body.advance()
        for chip in self.body.chips.values():
            chip.oscillator_hz = mhz * 1e6

    def restart(self) -> None:
        """Restart the boards as after a dip of their supply."""
        self.body.restart()

    def find_servo(self, place: int) -> HobbyServo:
        """Return the servo of a channel, advanced to the present time."""
        self.body.advance()
        if not 0 <= place < len(self.body.servos):
            raise KeyError(f"no channel {place}; channels are 0 to {len(self.body.servos) - 1}")
        return self.body.servos[place]

    def channel_report(self, channel: int) -> dict[str, object]:
        """Return the output of a channel, quarter microseconds."""
        return {"target": self.body.width_steps(channel, self.now_s())}

    def positions_steps(self) -> tuple[float, ...]:
        """Return the true positions of the shafts now, in quarter microseconds, by channel."""
        self.body.advance()
        return tuple(servo.place_steps for servo in self.body.servos)

    # --- bytes

    def exchange(self, data: bytes, client_baud: int | None = None) -> list[DeviceReply]:
        """Process received bytes; return the reply to each command in them."""
        self.body.advance()
        came = data
        if self._wire.has_any and self._wire.is_on("lose_bytes", self.now_s()):
            came = bytes(
                b for b in data if self._wire.use_fault("lose_bytes", None, self.now_s()) is None
            )
        missing, replies = len(data) - len(came), []
        for end, pieces in self._execute_commands(came):
            if pieces:
                replies.append(DeviceReply(missing + end, pieces))
        return self.faults.add_line_noise(replies, data) if self._wire.has_any else replies

    def _execute_commands(self, came: bytes) -> Iterator[tuple[int, list[Piece]]]:
        """Execute every complete command; an incomplete one waits for the rest."""
        kept, at = len(self._unread), 0
        text = self._unread + came
        while at < len(text):
            if text[at] == READ_REGISTER:
                if len(text) < at + 3:
                    break
                known = text[at + 1] == STATUS_REGISTER and text[at + 2] == STOP
                said = [Piece(NO_DEVICE, bytes((self._status,)))] if known else []
                at += 3
                yield at - kept, self._apply_faults(said)
            elif text[at] == START:
                found = _parse_transfer(text, at)
                if found is None:
                    break
                at, parts = found
                yield at - kept, self._apply_faults(self._execute_transfer(parts))
            else:
                at += 1  # not a command: skip the byte
        self._unread = text[at:]

    def _apply_faults(self, pieces: list[Piece]) -> list[Piece]:
        """Return an answer as it arrives; faults of one channel affect only its registers."""
        if not self._wire.has_any or not pieces:
            return pieces
        now_s = self.now_s()
        left = [p for p in pieces if self._wire.use_fault("lose", p.servo_id, now_s) is None]
        return self._wire.spoil_pieces(left, False, now_s)

    def _execute_transfer(self, parts: Sequence[_TransferPart]) -> list[Piece]:
        """Execute one transfer; the first part that fails ends it."""
        self._status = OK
        now_s, said = self.now_s(), []
        if self._wire.has_any:
            if self._wire.use_fault("nack", None, now_s) is not None:
                self._status = NO_ACKNOWLEDGE
                return []
            asks = any(part.length is not None for part in parts)
            if not asks and self._wire.use_fault("lose_writes", None, now_s) is not None:
                return []
            self.body.stuck = self._wire.is_on("stuck", now_s)
            self.body.absent = self._wire.is_on("absent", now_s)
            self.body.foreign = self._wire.is_on("foreign", now_s)
        else:
            self.body.stuck = self.body.absent = self.body.foreign = False
        try:
            for part in parts:
                if part.length is None:
                    self.body.write(part.address, part.data)
                    self._pointers[part.address] = part.data[0] if part.data else 0
                else:
                    data = self.body.read(part.address, part.length)
                    said.append(Piece(self._channel_of(part), data))
        except NotAcknowledged:
            self._status = NO_ACKNOWLEDGE
        except BusStuck:
            self._status = TIMED_OUT
        return said

    def _channel_of(self, part: _TransferPart) -> int:
        """Return the channel whose registers are read, NO_DEVICE unless it is exactly one."""
        register = self._pointers.get(part.address, 0) - LED0
        if part.length != 4 or register % 4 or not 0 <= register < 4 * CHANNELS:
            return NO_DEVICE
        return self._order.get(part.address, 0) * CHANNELS + register // 4


def _parse_transfer(text: bytes, at: int) -> tuple[int, list[_TransferPart]] | None:
    """Return the end of a transfer and its parts, None while bytes are missing."""
    parts: list[_TransferPart] = []
    while True:
        if at >= len(text):
            return None
        if text[at] == STOP:
            return at + 1, parts
        if text[at] != START:
            return at + 1, []  # malformed: it is dropped
        if len(text) < at + 3:
            return None
        address, count = text[at + 1], text[at + 2]
        at += 3
        if address & 1:
            parts.append(_TransferPart(address >> 1, b"", count))
            continue
        if len(text) < at + count:
            return None
        parts.append(_TransferPart(address >> 1, text[at : at + count], None))
        at += count


def build_bridge(
    addresses: Sequence[int],
    now_s: Callable[[], float],
    oscillator_hz: float = NOMINAL_HZ,
    seed: int = 0,
    servos: Sequence[HobbySpec | Sequence[float]] = (),
    make_servo: HobbyMaker = HobbyServo,
) -> Bridge:
    """Build the boards of one bus; channels without a spec have a default servo.

    Raises:
        ValueError: such boards or servos do not exist.
    """
    if not addresses or len(set(addresses)) < len(addresses):
        raise ValueError(f"every board needs its own address; given {list(addresses)}")
    for address in addresses:
        if not 0x40 <= address <= 0x7F:
            raise ValueError(f"address {address:#x}: a PCA9685 has 0x40 to 0x7f")
    count = CHANNELS * len(addresses)
    built = build_servos(servos, count, make_servo)
    return Bridge(built, now_s, addresses, oscillator_hz, seed)
