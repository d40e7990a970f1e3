"""Remote control of a head that a user moves by hand: other programs can only stop it.

While a person calibrates, parameters are fixed and no other client controls the head. But
``gazerig stop`` must reach every head that moves.
"""

from collections.abc import Callable, Mapping

from gazerig.drivers.errors import SetupError
from gazerig.robot.control.gesture_choices import GestureInfo
from gazerig.robot.control.tick import Tick
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.commands import Command, Resume, Stop
from gazerig.robot.model.reply import CommandTaker, Ticket
from gazerig.robot.remote.request_handler import Pulse, RequestHandler
from gazerig.robot.remote.socket_server import RemoteServer

_FIXED = "it is being calibrated: its parameters stay as they are until that is over"


class StopOnlyServer:
    """Server that executes stop and resume, and refuses all other commands.

    Args:
        command: Queues a command for the next tick.
        clock: Clock of the loop.
        about: Constant fields of the status, as {"rig": name, "pid": process}.
        say: Prints a line on the terminal.
    """

    def __init__(
        self,
        command: CommandTaker,
        clock: Clock,
        about: Mapping[str, object],
        say: Callable[[str], None],
    ) -> None:
        self._say = say
        self._pulse = Pulse(clock)
        only = _OnlyStops(command)
        requests = RequestHandler(only, None, self._pulse, about, fixed=_FIXED)
        self._server = RemoteServer(requests, say)

    def open(self) -> None:
        """Listen to other programs; print a line if that fails."""
        try:
            self._server.open()
        except SetupError as error:  # the head goes on without
            self._say(f"gazerig stop will not find this rig: {error}")

    def update(self, tick: Tick) -> None:
        """Store the newest tick; called by the loop."""
        self._pulse.update(tick)

    def close(self) -> None:
        """Close all connections."""
        self._server.close()


class _OnlyStops:
    """Robot that executes only stop and resume."""

    def __init__(self, command: CommandTaker) -> None:
        self._command = command

    def command(self, command: Command) -> Ticket | None:
        """Queue a stop or resume.

        Raises:
            ValueError: it is another command.
        """
        if not isinstance(command, Stop | Resume):
            raise ValueError("it is being calibrated: besides stop and resume nothing goes")
        return self._command(command)

    def menus(self) -> dict[str, tuple[str, ...]]:
        """Return no menus."""
        return {}

    def gestures(self) -> tuple[GestureInfo, ...]:
        """Return no gestures."""
        return ()
