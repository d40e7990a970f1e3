"""Device side of a Pololu Maestro: bytes in, bytes and pulses out, nothing opened.

A board of 6, 12, 18 or 24 channels, all configured as servos that stop on an error, each with a
hobby servo. Command bytes have bit 7 set, data bytes do not. Only the commands of our driver are
known. Omitted: inputs, digital outputs, scripts, the serial time-out, other protocols and other
reactions to errors. Source: Pololu Maestro User's Guide (0J40), section 5; [A] is assumed.
"""

from collections.abc import Callable, Iterator, Sequence

from gazerig.sim_mock.faults.grammar import CommandTable, Verb
from gazerig.sim_mock.faults.hobby import HobbyFaults, hobby_commands
from gazerig.sim_mock.hobby_board import HobbyBoard
from gazerig.sim_mock.hobby_servo import HobbyMaker, HobbyServo, HobbySpec, build_servos
from gazerig.sim_mock.maestro.channel import EmulatedChannel
from gazerig.sim_mock.replies import NO_DEVICE, Piece

SET_TARGET, SET_SPEED, SET_ACCELERATION = 0x84, 0x87, 0x89
GET_POSITION, GET_ERRORS, STOP_SCRIPT = 0x90, 0xA1, 0xA4
DATA_BYTES = {
    SET_TARGET: 3,
    SET_SPEED: 3,
    SET_ACCELERATION: 3,
    GET_POSITION: 1,
    GET_ERRORS: 0,
    STOP_SCRIPT: 0,
}
"""Number of data bytes."""
SETTERS = {
    SET_TARGET: EmulatedChannel.set_target,
    SET_SPEED: EmulatedChannel.limit_speed,
    SET_ACCELERATION: EmulatedChannel.limit_acceleration,
}
"""Commands with a number for a channel."""

PROTOCOL, CRC = 4, 3
"""Bits of the error register: a command that does not exist, and one with a wrong CRC."""

SIZES = (6, 12, 18, 24)
RESTART_S = 0.1
"""Time from a dip of the supply until it receives again [A]."""


def crc7(data: bytes) -> int:
    """Return the checksum of a command: CRC-7 with the polynomial 91 hex, lowest bit first."""
    rest = 0
    for byte in data:
        rest ^= byte
        for _ in range(8):
            rest = (rest ^ 0x91 if rest & 1 else rest) >> 1
    return rest


class EmulatedMaestro(HobbyBoard):
    """One board and its servos.

    errors: its error register
    is_script_running: whether its own script runs, which does nothing
    """

    def __init__(
        self, servos: Sequence[HobbyServo], now_s: Callable[[], float], crc: bool, seed: int
    ) -> None:
        super().__init__(servos, now_s, COMMANDS, seed)
        self.channels = [EmulatedChannel(s.spec.min_steps, s.spec.max_steps) for s in servos]
        self.errors = 0
        self.is_script_running = False
        self._crc = crc
        self._unread = b""
        self._awake_s = now_s()

    def fail(self, bit: int) -> None:
        """Set a bit of the error register; every channel stops its pulses."""
        self.errors |= 1 << bit
        for channel in self.channels:
            channel.set_target(0)

    # --- parts of HobbyBoard

    def restart(self) -> None:
        """Restart as after a dip of the supply, with an empty error register."""
        self.advance()
        self.errors = 0
        for channel in self.channels:
            channel.restart()
        self._unread = b""
        self._awake_s = self.now_s() + RESTART_S

    def target_steps(self, channel: int) -> int:
        """Return the target of a channel, quarter microseconds; 0: no pulses."""
        return self.channels[channel].target

    def pulse_steps(self, channel: int) -> int:
        """Return the present pulse of a channel, quarter microseconds; 0: none."""
        return self.channels[channel].position

    def step_outputs(self) -> None:
        """Advance the outputs by 10 ms."""
        for channel in self.channels:
            channel.step()

    def execute(self, data: bytes) -> Iterator[Piece]:
        """Execute the commands in bytes; yield their answers."""
        if self.now_s() < self._awake_s - 1e-9:
            return
        kept, at = len(self._unread), 0
        text = self._unread + data
        while at < len(text):
            command = text[at : at + self._size(text[at:])]
            begun = next((k for k, byte in enumerate(command) if k and byte >= 0x80), 0)
            if begun or not command:
                self.fail(PROTOCOL)  # an unfinished command, or none
                at += begun or 1
                continue
            if len(command) < self._size(text[at:]):
                break
            at += len(command)
            if self._crc and crc7(command[:-1]) != command[-1]:
                self.fail(CRC)
            elif command[0] not in SETTERS or not self.faults.use_fault("lose_writes"):
                body = command[1:-1] if self._crc else command[1:]
                answer = self._answer(command[0], body)
                if answer is not None:
                    yield Piece(*answer, at - kept)
        self._unread = text[at:]

    def _size(self, text: bytes) -> int:
        code = text[0]
        return 1 + DATA_BYTES[code] + self._crc if code in DATA_BYTES else 0

    def _answer(self, code: int, data: bytes) -> tuple[int, bytes] | None:
        """Execute one command; return the channel that answers, and its bytes.

        An unknown channel is a protocol error [A].
        """
        if code == GET_ERRORS:
            errors, self.errors = self.errors, 0
            return NO_DEVICE, errors.to_bytes(2, "little")
        if code == STOP_SCRIPT:
            self.is_script_running = False
        elif data[0] >= len(self.channels):
            self.fail(PROTOCOL)
        elif code == GET_POSITION:
            return data[0], self.channels[data[0]].position.to_bytes(2, "little")
        else:
            SETTERS[code](self.channels[data[0]], data[1] | data[2] << 7)
        return None


def _error(faults: HobbyFaults, bit: int) -> str:
    faults.chain.advance()
    faults.chain.fail(bit)
    return f"the board has set bit {bit} of its errors"


COMMANDS: CommandTable = hobby_commands(23, "targets and limits", {"error": Verb(_error, "BIT")})


def build_board(
    channels: int,
    now_s: Callable[[], float],
    crc: bool = False,
    seed: int = 0,
    servos: Sequence[HobbySpec] = (),
    make_servo: HobbyMaker = HobbyServo,
) -> EmulatedMaestro:
    """Build a board; channels without a spec have a default servo.

    Raises:
        ValueError: such a board or servo does not exist.
    """
    if channels not in SIZES:
        raise ValueError(f"{channels} channels: a Maestro has {', '.join(map(str, SIZES))}")
    return EmulatedMaestro(build_servos(servos, channels, make_servo), now_s, crc, seed)
