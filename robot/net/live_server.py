"""Requests of programs and of the page to a running rig.

A rig that is being calibrated accepts only stops.
"""

from collections.abc import Callable, Mapping
from functools import partial

from gazerig.drivers.errors import SetupError
from gazerig.robot.loop.events import TickFeed
from gazerig.robot.loop.loop import Robot
from gazerig.robot.net.request_handler import (
    ParamAccess,
    PathGuard,
    RequestHandler,
    Speaker,
    accept_only_stops,
)
from gazerig.robot.net.socket_server import RemoteServer

_CALIBRATED = "it is being calibrated"


class LiveServer:
    """Remote control of one running rig.

    Args:
        robot: Executes commands.
        tuning: Parameters and their files; None: only stop and resume are accepted.
        about: Constant fields of the status, e.g. {"rig": name, "pid": process}.
        say: Prints a line on the terminal.
        fault: Executes a fault command of emulated servos; None if the servos are real.
        changing: Returns the other fields of the status, e.g. {"page": address}.
        paths: Rules for the files that a client of the network may name; None if any.
        voice: Says sounds and texts; None if the head has no voice.

    Attributes:
        serve: Answers the page's process over a connection.
        update: Stores the newest tick, for the loop.
    """

    def __init__(
        self,
        robot: Robot,
        tuning: ParamAccess | None,
        about: Mapping[str, object],
        say: Callable[[str], None],
        fault: Callable[[str], str] | None = None,
        changing: Callable[[], Mapping[str, object]] = dict,
        paths: PathGuard | None = None,
        voice: Speaker | None = None,
    ) -> None:
        self._say = say
        feed = TickFeed()
        if tuning is None:
            only = accept_only_stops(robot.command, _CALIBRATED)
            handler = partial(RequestHandler, only, feed, about)
        else:
            handler = partial(
                RequestHandler, robot.command, feed, about, tuning, voice=voice,
                menus=robot.menus, tracks=robot.tracks, fault=fault, changing=changing,
            )  # fmt: skip
        self._server = RemoteServer(handler(), say)
        # Apart from programs of this computer, so that neither uses up the other's time.
        self._page_server = RemoteServer(handler(paths=paths), say)
        self.serve, self.update = self._page_server.serve, feed.update

    def open(self) -> None:
        """Listen to other programs; print a line if that fails."""
        try:
            self._server.open()
        except SetupError as error:  # the head runs without remote control
            self._say(f"gazerig ctl set and stop cannot find this rig: {error}")

    def close(self) -> None:
        """Close all connections."""
        self._page_server.close()
        self._server.close()
