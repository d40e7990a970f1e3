"""What can go wrong with an emulated Maestro and its servos, beside all that can on its line."""

from collections.abc import Callable
from typing import Protocol

from gazerig.sim_mock.faults.grammar import (
    SWITCH,
    TIME,
    Commands,
    Verb,
    Word,
    count,
    number,
    one_of,
    or_all,
    whole,
)
from gazerig.sim_mock.faults.hobby import HobbyFaults
from gazerig.sim_mock.faults.verbs import adapter_verbs, closing_verbs, line_verbs
from gazerig.sim_mock.hobby_servo import HobbyServo
from gazerig.sim_mock.maestro.body import Body
from gazerig.sim_mock.maestro.commands import ERRORS
from gazerig.sim_mock.maestro.settings import cases


class Board(Protocol):
    """What faults need of the board they strike."""

    now_s: Callable[[], float]
    body: Body

    def here(self, channel: int) -> HobbyServo:
        """Return the servo of a channel, brought up to now."""
        ...

    def restart(self) -> None:
        """Restart as a dip of the supply makes it."""
        ...

    def choose(self, case: str, value: str) -> None:
        """Choose what the board is set to."""
        ...


class MaestroFaults(HobbyFaults):
    """The faults of one board; an id is a channel."""

    def __init__(self, board: Board, commands: Commands, seed: int = 0) -> None:
        # A Maestro's packets begin with AA: what a loose header and a broken node send.
        super().__init__(board, commands, seed, header=b"\xaa")
        self._board = board

    # --- on the way to the board

    def lose_settings(self, number: int | None = None, seconds: float | None = None) -> str:
        """Let commands that answer nothing be lost on their way to the board."""
        says = "commands without an answer are lost"
        return self._begin("lose_writes", None, says, number, seconds)

    def lose_bytes(self, number: int | None = None, seconds: float | None = None) -> str:
        """Let the next bytes of the host be lost on their way to the board."""
        return self._begin("lose_bytes", None, "bytes of the host are lost", number, seconds)

    # --- what happens to the board

    def error(self, name: str) -> str:
        """Let the board find an error: its channels do as they are set to do then."""
        self._board.body.advance()
        self._board.body.fail(name)
        return f"the board has found an error: {name}"

    def brown_out(self) -> str:
        """Let the board restart as a dip of the supply makes it: no answer tells."""
        self._board.restart()
        return "the board restarts"

    def script(self, what: int | bool) -> str:
        """Let a script run that does nothing, or swings a channel, or end it (False)."""
        if what is False:
            self._board.body.advance()
            self._board.body.stop_script()
            return "no script runs"
        if what is True:
            self._board.body.run_script()
            return "a script runs and does nothing"
        self._board.here(what)
        self._board.body.run_script(what)
        return f"a script swings channel {what} from end to end"

    # --- all

    def reports(self) -> list[dict[str, object]]:
        """Return what every channel sends and where its servo truly is."""
        self._board.body.advance()
        return [
            {
                "id": nth,
                "target": channel.target,
                "position": channel.position,
                "speed": channel.speed,
                "acceleration": channel.acceleration,
                "place": round(servo.place_steps, 1),
                "straining": servo.straining,
            }
            for nth, (channel, servo) in enumerate(
                zip(self._board.body.channels, self._board.body.servos, strict=True)
            )
        ]

    def board(self) -> dict[str, object]:
        """Return the errors found and not yet asked for, and whether a script runs."""
        named = [name for bit, name in enumerate(ERRORS) if self._board.body.errors >> bit & 1]
        return {"errors": named, "script": self._board.body.script_running}


def _script(text: str) -> int | bool:
    return text == "on" if text in ("on", "off") else _CHANNEL.read(text)


_CHANNEL = Word("ID", whole(0, 23, "a channel"))
_WHO = Word("ID", or_all(_CHANNEL.read))
_N = Word("N", count, True)

# fmt: off
VERBS: dict[str, Verb] = {
    **line_verbs(_CHANNEL),
    "lose-writes": Verb(MaestroFaults.lose_settings, (_N,),
                        "the next N commands without an answer are lost on their way", TIME),
    "lose-bytes": Verb(MaestroFaults.lose_bytes, (_N,),
                       "the next N bytes of the host are lost on their way", TIME),
    **adapter_verbs(),
    "error": Verb(MaestroFaults.error, (Word("NAME", one_of(*ERRORS)),),
                  f"the board finds an error: {', '.join(ERRORS)}"),
    "brown-out": Verb(MaestroFaults.brown_out, (),
                      "the board restarts as a dip of its supply makes it"),
    "script": Verb(MaestroFaults.script, (Word("on|off|ID", _script),),
                   "a script runs; with a channel it swings that from end to end"),
    "power": Verb(MaestroFaults.power, (SWITCH,),
                  "supply of the servos; the board notices nothing"),
    "stick": Verb(MaestroFaults.stick, (_WHO,), "jam the servo where it is"),
    "free": Verb(MaestroFaults.free, (_WHO,), "let a jammed servo go"),
    "turn": Verb(MaestroFaults.turn, (_WHO, Word("STEPS", number(-1e5, 1e5, "quarter us"))),
                 "turn the servo by hand; with pulses it goes back"),
    **closing_verbs(_CHANNEL),
}
# fmt: on

COMMANDS = Commands(VERBS, cases(), "a channel")
