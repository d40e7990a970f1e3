"""Device side of a Pololu Maestro: bytes in, bytes and pulses out, nothing opened.

A board of 6, 12, 18 or 24 channels, all configured as servos, each with a hobby servo. Omitted:
inputs, digital outputs, other periods than 20 ms, PWM (accepted, no effect), and scripts other
than the one that a fault starts. Source: Pololu Maestro User's Guide (0J40), section 5; [A] is
assumed.
"""

from collections.abc import Callable, Sequence

from gazerig.sim_mock.device import DeviceReply
from gazerig.sim_mock.faults.active import NO_DEVICE
from gazerig.sim_mock.faults.grammar import Argument, CommandTable, Verb, word_choice
from gazerig.sim_mock.faults.hobby import HobbyBoard, HobbyFaults, channel_word, hobby_verbs
from gazerig.sim_mock.hobby_servo import HobbyMaker, HobbyServo, HobbySpec, build_servos
from gazerig.sim_mock.maestro.body import EmulatedChannel, MaestroBody
from gazerig.sim_mock.maestro.commands import (
    ERRORS,
    GET_ERRORS,
    GET_MOVING,
    GET_POSITION,
    GET_SCRIPT,
    GO_HOME,
    MINI_SSC,
    RUN_SCRIPT,
    RUN_SCRIPT_WITH,
    SET_ACCELERATION,
    SET_PWM,
    SET_SPEED,
    SET_TARGET,
    SET_TARGETS,
    STOP_SCRIPT,
    CommandParser,
    ParsedCommand,
    decode_word,
)
from gazerig.sim_mock.maestro.settings import LIMITS, Settings, cases, change_setting, width_steps
from gazerig.sim_mock.replies import Piece


class MaestroFaults(HobbyFaults):
    """Faults of one board; an id is a channel."""

    def __init__(
        self, board: HobbyBoard, body: MaestroBody, commands: CommandTable, seed: int = 0
    ) -> None:
        # A Maestro's packets begin with AA: a loose header and a babbling node send it.
        super().__init__(board, commands, seed, header=b"\xaa")
        self._body = body

    def error(self, name: str) -> str:
        """Register an error on the board; its channels react as configured."""
        self._body.advance()
        self._body.fail(name)
        return f"the board has found an error: {name}"

    def set_script(self, what: int | bool) -> str:
        """Start a script that does nothing or swings a channel, or end it (False)."""
        if what is False:
            self._body.advance()
            self._body.stop_script()
            return "no script runs"
        if what is True:
            self._body.run_script()
            return "a script runs and does nothing"
        self._hobby.find_servo(what)
        self._body.run_script(what)
        return f"a script swings channel {what} from end to end"

    def board_status(self) -> dict[str, object]:
        """Return the unread errors, and whether a script runs."""
        named = [name for bit, name in enumerate(ERRORS) if self._body.errors >> bit & 1]
        return {"errors": named, "script": self._body.script_running}


_CHANNEL = channel_word(23)


def _script(text: str) -> int | bool:
    return text == "on" if text in ("on", "off") else _CHANNEL.read(text)


# fmt: off
OWN: dict[str, Verb] = {
    "error": Verb(MaestroFaults.error, (Argument("NAME", word_choice(*ERRORS)),),
                  f"the board finds an error: {', '.join(ERRORS)}"),
    "script": Verb(MaestroFaults.set_script, (Argument("on|off|ID", _script),),
                   "a script runs; with a channel it swings this from end to end"),
}
# fmt: on

COMMANDS = CommandTable(
    hobby_verbs(_CHANNEL, "commands without an answer", OWN), cases(), "a channel"
)


SIZES = (6, 12, 18, 24)
ASKING = (GET_POSITION, GET_MOVING, GET_ERRORS, GET_SCRIPT)


class EmulatedMaestro:
    """One board and its servos."""

    def __init__(
        self,
        servos: Sequence[HobbyServo],
        now_s: Callable[[], float],
        settings: Settings | None = None,
        seed: int = 0,
    ) -> None:
        self.now_s = now_s
        self.body = MaestroBody(servos, now_s, settings or Settings())
        self.faults = MaestroFaults(self, self.body, COMMANDS, seed)
        self._wire = self.faults.wire
        self.check_baud = False
        self._parser = CommandParser(len(servos) > SIZES[0])
        self._apply_settings(self.body.settings)
        self._do: dict[int, Callable[[bytes], bytes | None]] = {
            SET_TARGET: lambda data: self._apply_to_channel(data, EmulatedChannel.set_target),
            SET_TARGETS: self._set_targets,
            SET_SPEED: lambda data: self._apply_to_channel(data, EmulatedChannel.limit_speed),
            SET_ACCELERATION: lambda data: self._apply_to_channel(
                data, EmulatedChannel.limit_acceleration
            ),
            SET_PWM: lambda data: None,
            GET_POSITION: self._get_position,
            GET_MOVING: lambda data: bytes(
                (any(c.is_moving_under_limit for c in self.body.channels),)
            ),
            GET_ERRORS: lambda data: self.body.read_errors().to_bytes(2, "little"),
            GO_HOME: lambda data: self.body.move_all_to(self.body.settings.on_error),
            STOP_SCRIPT: lambda data: self.body.stop_script(),
            RUN_SCRIPT: lambda data: self._run_script(),
            RUN_SCRIPT_WITH: lambda data: self._run_script(),
            GET_SCRIPT: lambda data: bytes((not self.body.script_running,)),
            MINI_SSC: self._mini_ssc,
        }

    # --- device interface

    def understands_baud(self, client_baud: int) -> bool:
        """Return whether a client at this baud rate is understood: on USB every one is."""
        return True

    def choose_behaviour(self, case: str, value: str) -> None:
        """Change a setting of the board; it does not restart."""
        self.body.advance()
        if case in LIMITS:
            steps = width_steps(case, value)
            self.body.limit(*((steps, None) if case == "min-us" else (None, steps)))
            return
        self._apply_settings(change_setting(self.body.settings, case, value))
        self.body.reset_timeout()

    def _apply_settings(self, settings: Settings) -> None:
        self.body.settings = settings
        self._parser.crc = settings.crc

    def restart(self) -> None:
        """Restart as after a dip of the supply."""
        self.body.restart()
        self._parser.forget()

    def find_servo(self, channel: int) -> HobbyServo:
        """Return the servo of a channel, advanced to the present time."""
        self.body.advance()
        servos = self.body.servos
        if not 0 <= channel < len(servos):
            raise KeyError(f"no channel {channel}; channels are 0 to {len(servos) - 1}")
        return servos[channel]

    def channel_report(self, channel: int) -> dict[str, object]:
        """Return a channel's target and its present pulse."""
        one = self.body.channels[channel]
        return {
            "target": one.target,
            "position": one.position,
            "speed": one.speed,
            "acceleration": one.acceleration,
        }

    def positions_steps(self) -> tuple[float, ...]:
        """Return the true positions of the shafts now, in quarter microseconds, by channel."""
        self.body.advance()
        return tuple(servo.place_steps for servo in self.body.servos)

    # --- bytes

    def receive(self, data: bytes, client_baud: int | None = None) -> bytes:
        """Process received bytes; return the bytes of the board's answers."""
        replies = self.exchange(data, client_baud)
        return b"".join(piece.data for reply in replies for piece in reply.pieces)

    def exchange(self, data: bytes, client_baud: int | None = None) -> list[DeviceReply]:
        """Process received bytes; return the reply to each command in them."""
        self.body.advance()
        came = self._filter_input(data)
        missing, replies = len(data) - len(came), []
        for command in self._parser.feed(came):
            pieces = self._execute(command)
            if pieces:
                replies.append(DeviceReply(missing + command.end, pieces))
        return self.faults.add_line_noise(replies, data) if self._wire.has_any else replies

    def _filter_input(self, data: bytes) -> bytes:
        """Return the bytes that reach the board."""
        if not self.body.is_awake or self.body.settings.mode == "mute":
            return b""
        now_s = self.now_s()
        if not self._wire.has_any or not self._wire.is_on("lose_bytes", now_s):
            return data
        return bytes(b for b in data if self._wire.use_fault("lose_bytes", None, now_s) is None)

    def _execute(self, command: ParsedCommand) -> list[Piece]:
        """Execute one command; return the answer."""
        if command.error:
            self.body.fail(command.error)
            return []
        silent = self._wire.has_any and command.code not in ASKING
        if silent and self._wire.use_fault("lose_writes", None, self.now_s()) is not None:
            return []
        answer = self._do[command.code](command.data)
        self.body.reset_timeout()
        if answer is None:
            return []
        asked = command.data[0] if command.code == GET_POSITION else NO_DEVICE
        piece = Piece(asked, answer)
        if not self._wire.has_any:
            return [piece]
        now_s = self.now_s()
        if self._wire.use_fault("lose", piece.servo_id, now_s):
            return []
        return self._wire.spoil_pieces([piece], False, now_s)

    # --- commands

    def _apply_to_channel(self, data: bytes, do: Callable[[EmulatedChannel, int], None]) -> None:
        """Apply a number to a channel; an unknown channel is a protocol error [A]."""
        if data[0] < len(self.body.channels):
            do(self.body.channels[data[0]], decode_word(data[1], data[2]))
        else:
            self.body.fail("protocol")

    def _set_targets(self, data: bytes) -> None:
        number, first = data[0], data[1]
        if not number or first + number > len(self.body.channels):
            self.body.fail("protocol")
            return
        for nth, channel in enumerate(self.body.channels[first : first + number], 1):
            channel.set_target(decode_word(data[2 * nth], data[2 * nth + 1]))

    def _get_position(self, data: bytes) -> bytes | None:
        if data[0] < len(self.body.channels):
            return self.body.channels[data[0]].position.to_bytes(2, "little")
        self.body.fail("protocol")
        return None

    def _mini_ssc(self, data: bytes) -> None:
        """Set a target of 8 bits: 127 is 1500 us, 0 and 254 are 476.25 us to either side."""
        # Servo numbers beyond its own belong to other boards.
        if data[0] < len(self.body.channels):
            self.body.channels[data[0]].set_target(6000 + (data[1] - 127) * 15)

    def _run_script(self) -> None:
        """Handle the start of a script that does not exist [A]."""
        self.body.stop_script()
        self.body.fail("script-counter")


def build_board(
    channels: int,
    now_s: Callable[[], float],
    crc: bool = False,
    seed: int = 0,
    servos: Sequence[HobbySpec | Sequence[float]] = (),
    make_servo: HobbyMaker = HobbyServo,
) -> EmulatedMaestro:
    """Build a board; channels without a spec have a default servo.

    Raises:
        ValueError: such a board or servo does not exist.
    """
    if channels not in SIZES:
        raise ValueError(f"{channels} channels: a Maestro has {', '.join(map(str, SIZES))}")
    built = build_servos(servos, channels, make_servo)
    return EmulatedMaestro(built, now_s, Settings(crc=crc), seed)
