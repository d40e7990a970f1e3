"""Where other programs stop a head that a user leads by hand; nothing else is to be had.

While a person calibrates, parameters stay as they are and no other client leads the head. But
``gazerig stop`` must reach whatever moves.
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
    """The remote control of a head that can be stopped and resumed, and told nothing else.

    Args:
        command: takes commands for the next tick.
        clock: that of the loop; about: what does not change, as {"rig": name, "pid": process}
        say: writes a line on the terminal.
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
        """Listen to other programs; says where that cannot be."""
        try:
            self._server.open()
        except SetupError as error:  # the head goes on without
            self._say(f"gazerig stop will not find this rig: {error}")

    def update(self, tick: Tick) -> None:
        """Leave the newest tick; called by the loop."""
        self._pulse.update(tick)

    def close(self) -> None:
        """Hang up on all programs."""
        self._server.close()


class _OnlyStops:
    """A robot that takes stop and resume alone."""

    def __init__(self, command: CommandTaker) -> None:
        self._command = command

    def command(self, command: Command) -> Ticket | None:
        """Hand on a stop or the end of one.

        Raises:
            ValueError: it is anything else.
        """
        if not isinstance(command, Stop | Resume):
            raise ValueError("it is being calibrated: besides stop and resume nothing goes")
        return self._command(command)

    def menus(self) -> dict[str, tuple[str, ...]]:
        """Offer nothing."""
        return {}

    def gestures(self) -> tuple[GestureInfo, ...]:
        """Offer none."""
        return ()
