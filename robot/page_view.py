"""The page's own process: take the newest snapshot off the socket and draw it.

Started by ``robot.page.Page`` as ``python -m robot.page_view FD PARENT HOST PORT``. It
ends when the other side of the socket closes. Nothing is fetched from anywhere: the
page's script comes from the viser package and all shapes are made here.
"""

import contextlib
import errno
import json
import os
import select
import signal
import socket
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from math import atan
from typing import NamedTuple

import viser

from robot.page import ASK, CHOICES, MESSAGE_BYTES, NOTICE, PICTURE, SNAPSHOT, URL, unpack
from robot.page_head import FLOOR_M, HeadView
from robot.page_panel import PanelView
from robot.page_people import PeopleView
from robot.types import Snapshot

_FRAME_S = 0.04
_SILENT_AFTER_S = 1.0
_PORTS_TRIED = 100
_PORTS = 65536
_NICENESS = 5  # the control loop comes first where both want the same core
_LOOPBACK = ("127.0.0.1", "::1", "localhost")
_EVERYWHERE = {"0.0.0.0": "127.0.0.1", "::": "::1"}

_HALF_WIDTH = 0.84  # tangent of half the horizontal field of view: 80 deg
_FOV_STEP_RAD = 0.01
# Name of the view: where the camera is and what it looks at.
VIEWS = {
    "both": ((0.72, -0.74, 0.38), (0.52, 0.0, 0.145)),
    "rig": ((0.34, -0.11, 0.19), (0.0, 0.0, 0.11)),
    "over its shoulder": ((-0.52, 0.22, 0.42), (0.60, 0.0, 0.16)),
}


class News(NamedTuple):
    """What was waiting on the socket: all snapshots, the last picture, whether it has closed.

    choices: menus to put on the page, None where none came
    """

    snapshots: tuple[Snapshot, ...]
    jpeg: bytes | None
    ended: bool
    choices: Mapping[str, Sequence[str]] | None = None


def drain(feed: socket.socket) -> News:
    """Take everything that waits, without waiting for more."""
    snapshots: list[Snapshot] = []
    jpeg, choices, ended = None, None, False
    while not ended:
        try:
            message = feed.recv(MESSAGE_BYTES, socket.MSG_DONTWAIT)
        except BlockingIOError:
            break
        except ConnectionResetError:
            message = b""
        ended = not message
        if message[:1] == SNAPSHOT:
            snapshots.append(unpack(message))
        elif message[:1] == PICTURE:
            jpeg = message[1:]
        elif message[:1] == CHOICES:
            choices = json.loads(message[1:])
    return News(tuple(snapshots), jpeg, ended, choices)


def free_port(host: str, port: int) -> int:
    """Find the first port from this one on that can be bound.

    Raises:
        OSError: the address is not this machine's, or none of the ports is free.
    """
    family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    for candidate in range(port, min(port + _PORTS_TRIED, _PORTS)):
        with socket.socket(family, socket.SOCK_STREAM) as trial:
            # As the server itself does: a port in TIME_WAIT is free, one with a listener is not.
            trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                trial.bind((address[0], candidate))
            except OSError as error:
                if error.errno != errno.EADDRINUSE:
                    raise
            else:
                return candidate
    raise OSError(errno.EADDRINUSE, f"no port from {port} on is free")


class View:
    """Scene and panel of one server."""

    def __init__(self, server: viser.ViserServer, ask: Callable[[str, str], None]) -> None:
        """Build the empty room; ``ask`` is told of every choice a spectator makes."""
        self._server = server
        self._ask = ask
        server.initial_camera.position, server.initial_camera.look_at = VIEWS["both"]
        server.on_client_connect(_greet)
        _furnish(server)
        self._head = HeadView(server.scene)
        self._people = PeopleView(server.scene)
        self._panel = PanelView(server.gui)
        self._newest: Snapshot | None = None
        self._jpeg: bytes | None = None
        self._drawn = False
        self._add_views()

    def _add_views(self) -> None:
        buttons = self._server.gui.add_button_group("view", tuple(VIEWS), order=9)

        @buttons.on_click
        def _(event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
            if event.client is not None:
                camera = event.client.camera
                camera.position, camera.look_at = VIEWS[event.target.value]

    def _add_menu(self, name: str, choices: Sequence[str]) -> None:
        menu = self._server.gui.add_dropdown(name, tuple(choices), order=8)

        @menu.on_update
        def _(event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
            self._ask(name, event.target.value)

    def show(self, news: News) -> None:
        """Draw the newest of what came; without a spectator it is kept until one comes."""
        for name, choices in (news.choices or {}).items():
            self._add_menu(name, choices)
        self._panel.note(news.snapshots)
        if news.snapshots:
            self._newest = news.snapshots[-1]
        self._jpeg = news.jpeg or self._jpeg
        if self._server.get_clients() or not self._drawn:
            with self._server.atomic():  # a browser never sees half of a snapshot
                self._draw()

    def _draw(self) -> None:
        if self._newest is not None:
            self._head.show(self._newest)
            self._people.show(self._newest)
            self._panel.show(self._newest)
            self._drawn = True
        if self._jpeg is not None:
            self._panel.show_picture(self._jpeg)
        self._newest = self._jpeg = None

    def silent(self) -> None:
        """Say that nothing comes any more, beside the last that came."""
        self.show(News((), None, ended=False))
        if self._drawn:
            self._panel.silent()


def _greet(client: viser.ClientHandle) -> None:
    """Show rig and person from side to side, whatever the shape the window has or is given."""

    @client.camera.on_update
    def _(camera: viser.CameraHandle) -> None:
        fov_rad = 2.0 * atan(_HALF_WIDTH / camera.aspect)
        if abs(camera.fov - fov_rad) > _FOV_STEP_RAD:
            camera.fov = fov_rad


def _furnish(server: viser.ViserServer) -> None:
    server.gui.configure_theme(show_logo=False, show_share_button=False)
    server.gui.main_panel.dock_right()
    server.gui.main_panel.set_width(360)
    # A room's picture as light would fade the scene in slowly, and shadows cost a browser
    # without a graphics card, often on the rig's own computer, three quarters of its rate.
    server.scene.configure_environment_map(None)
    server.scene.configure_default_lights(cast_shadow=False)
    server.scene.add_light_hemisphere(
        "/sky", sky_color=(255, 255, 255), ground_color=(176, 168, 160), intensity=3.0
    )
    server.scene.add_grid(
        "/floor",
        cell_size=0.1,
        section_size=0.5,
        infinite_grid=True,
        fade_distance=5.0,
        plane_color=(240, 242, 245),
        plane_opacity=1.0,
        position=(0.0, 0.0, FLOOR_M),
    )


def serve(host: str, port: int) -> tuple[viser.ViserServer, str, str | None]:
    """Open the server on the first free port; give it with its URL and what there is to say.

    Raises:
        OSError: see ``free_port``.
    """
    server = viser.ViserServer(
        host=host, port=free_port(host, port), label="gazerig", verbose=False
    )
    bound = server.get_port()  # another program may have been quicker: this is what it got
    words = []
    if port not in (0, bound):  # 0 asks for any port
        words.append(f"port {port} is busy, using {bound}")
    if host not in _LOOPBACK:
        words.append("everyone on the network can see the page and its camera picture")
    name = _EVERYWHERE.get(host, host)
    url = f"http://[{name}]:{bound}" if ":" in name else f"http://{name}:{bound}"
    return server, url, "; ".join(words) or None


def watch(feed: socket.socket, view: View, parent: int) -> None:
    """Draw what comes until the other side is gone."""
    pause = threading.Event()
    while True:
        readable, _, _ = select.select([feed], [], [], _SILENT_AFTER_S)
        if readable:
            news = drain(feed)
            if news.ended:
                return
            view.show(news)
            pause.wait(_FRAME_S)
        else:
            # A process forked by the rig may hold the socket open after the rig's death.
            if os.getppid() != parent:
                return
            view.silent()


def tell(feed: socket.socket, menu: str, choice: str) -> None:
    """Hand a choice to the rig; a rig that is gone ends the page by itself."""
    with contextlib.suppress(OSError):
        feed.send(ASK + json.dumps((menu, choice)).encode())


def main(arguments: list[str]) -> int:
    """Run the page; give the process's exit code."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.nice(_NICENESS)
    fd, parent, host, port = arguments
    # Not closed by hand: its end tells the other side to read this process's last words,
    # and those of an exception are written only after a ``with`` has been left.
    feed = socket.socket(fileno=int(fd))
    try:
        server, url, words = serve(host, int(port))
    except OSError as error:
        sys.stderr.write(f"cannot open {host} port {port}: {error.strerror or error}\n")
        return 1
    if words is not None:
        feed.send(NOTICE + words.encode())
    view = View(server, lambda menu, choice: tell(feed, menu, choice))
    feed.send(URL + url.encode())
    watch(feed, view, int(parent))
    server.stop()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
