"""Faults of an emulated Maestro and its servos, in addition to those of its line."""

from gazerig.sim_mock.faults.grammar import Argument, CommandTable, Verb, one_of
from gazerig.sim_mock.faults.hobby import HobbyBoard, HobbyFaults, channel_word, hobby_verbs
from gazerig.sim_mock.maestro.body import MaestroBody
from gazerig.sim_mock.maestro.commands import ERRORS
from gazerig.sim_mock.maestro.settings import cases


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

    def script(self, what: int | bool) -> str:
        """Start a script that does nothing or swings a channel, or end it (False)."""
        if what is False:
            self._body.advance()
            self._body.stop_script()
            return "no script runs"
        if what is True:
            self._body.run_script()
            return "a script runs and does nothing"
        self._hobby.here(what)
        self._body.run_script(what)
        return f"a script swings channel {what} from end to end"

    def board(self) -> dict[str, object]:
        """Return the unread errors, and whether a script runs."""
        named = [name for bit, name in enumerate(ERRORS) if self._body.errors >> bit & 1]
        return {"errors": named, "script": self._body.script_running}


_CHANNEL = channel_word(23)


def _script(text: str) -> int | bool:
    return text == "on" if text in ("on", "off") else _CHANNEL.read(text)


# fmt: off
OWN: dict[str, Verb] = {
    "error": Verb(MaestroFaults.error, (Argument("NAME", one_of(*ERRORS)),),
                  f"the board finds an error: {', '.join(ERRORS)}"),
    "script": Verb(MaestroFaults.script, (Argument("on|off|ID", _script),),
                   "a script runs; with a channel it swings this from end to end"),
}
# fmt: on

COMMANDS = CommandTable(
    hobby_verbs(_CHANNEL, "commands without an answer", OWN), cases(), "a channel"
)
