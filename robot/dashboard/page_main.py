"""The page's own process: take the newest snapshot off the socket and draw it.

Started by ``gazerig.robot.dashboard.page_process.PageProcess`` as ``python -m
gazerig.robot.dashboard.page_main FD STOP_FD PARENT HOST PORT``, with the token and a folder of its
own in its environment, which other users cannot read as they can its arguments. It
ends when the other side of the socket closes. Nothing is fetched from anywhere: the
page's script comes from the viser package and all shapes are made here. Browsers come in
by ``gazerig.robot.dashboard.auth_proxy``; what people do there goes to the rig over the same
socket.
"""

import errno
import json
import os
import select
import shutil
import signal
import socket
import sys
import threading
from collections.abc import Callable, Mapping
from math import atan
from pathlib import Path
from typing import NamedTuple

import viser

from gazerig.robot.dashboard.auth_proxy import AuthProxy
from gazerig.robot.dashboard.control_tabs import ControlTabs
from gazerig.robot.dashboard.head_model import FLOOR_M, HeadModel
from gazerig.robot.dashboard.inbox import MESSAGE_BYTES
from gazerig.robot.dashboard.outbox import Outbox
from gazerig.robot.dashboard.overlays import OverlayPanel
from gazerig.robot.dashboard.page_process import (
    CANNOT_OPEN,
    CHOICES,
    EVERYBODY,
    FOLDER_VARIABLE,
    KNOBS,
    NOTICE,
    PICTURE,
    REPLAY,
    SNAPSHOT,
    TOKEN_VARIABLE,
    URL,
    VALUES,
    WORDS,
    unpack,
)
from gazerig.robot.dashboard.panel import PanelView
from gazerig.robot.dashboard.people import PeopleView
from gazerig.robot.dashboard.process_limits import limit_process
from gazerig.robot.dashboard.replay import ReplayView
from gazerig.robot.dashboard.stop_channel import StopSender
from gazerig.robot.dashboard.viser_server import browser_of, open_server
from gazerig.robot.model.types import Snapshot

_FRAME_S = 0.04
_SILENT_AFTER_S = 1.0
_PORTS_TRIED = 100
_PORTS = 65536
_EVERYWHERE = ("0.0.0.0", "::")

_HALF_WIDTH = 0.84  # tangent of half the horizontal field of view: 80 deg
_FOV_STEP_RAD = 0.01
# Name of the view: where the camera is and what it looks at.
VIEWS = {
    "both": ((0.80, -1.32, 0.54), (0.50, 0.0, 0.10)),
    "rig": ((0.34, -0.11, 0.19), (0.0, 0.0, 0.11)),
    "over its shoulder": ((-0.52, 0.22, 0.42), (0.60, 0.0, 0.16)),
}


class News(NamedTuple):
    """What was waiting on the socket: all snapshots, the last picture, whether it has closed.

    others: what must not be lost or passed over, as (kind, what its JSON holds), oldest first
    """

    snapshots: tuple[Snapshot, ...]
    jpeg: bytes | None
    ended: bool
    others: tuple[tuple[bytes, object], ...] = ()


def drain(feed: socket.socket) -> News:
    """Take everything that waits, without waiting for more."""
    snapshots: list[Snapshot] = []
    others: list[tuple[bytes, object]] = []
    jpeg, ended = None, False
    while not ended:
        try:
            message = feed.recv(MESSAGE_BYTES, socket.MSG_DONTWAIT)
        except BlockingIOError:
            break
        except ConnectionResetError:
            message = b""
        ended = not message
        kind, body = message[:1], message[1:]
        if kind == SNAPSHOT:
            snapshots.append(unpack(message))
        elif kind == PICTURE:
            jpeg = body
        elif kind in (CHOICES, KNOBS, VALUES, WORDS, REPLAY):
            others.append((kind, json.loads(body)))
    return News(tuple(snapshots), jpeg, ended, tuple(others))


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


class PageView:
    """Scene and panels of one server."""

    def __init__(
        self,
        server: viser.ViserServer,
        teller: Outbox,
        tell: Callable[[Mapping[str, object]], None],
    ) -> None:
        """Build the empty room.

        teller: takes what people do to the rig; tell: shows what the stop button must know
        """
        self._server = server
        self._teller = teller
        self._tell = tell
        server.initial_camera.position, server.initial_camera.look_at = VIEWS["both"]
        server.on_client_connect(_greet)
        _furnish(server)
        self._head = HeadModel(server.scene)
        self._people = PeopleView(server.scene)
        self._panel = PanelView(server.gui)
        self._layers = OverlayPanel(server.scene)
        self._panel.depth = self._ask_depth
        self._controls = ControlTabs(server, teller)
        self._replay: ReplayView | None = None
        self._newest: Snapshot | None = None
        self._jpeg: bytes | None = None
        self._drawn = self._watched = False
        self._add_views()

    def _ask_depth(self, on: bool) -> None:
        self._teller.ask({"show": {"depth": on}}, EVERYBODY)

    def _add_views(self) -> None:
        buttons = self._server.gui.add_button_group("view", tuple(VIEWS), order=9)

        @buttons.on_click
        def _(event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
            if event.client is not None:
                camera = event.client.camera
                camera.position, camera.look_at = VIEWS[event.target.value]

    def show(self, news: News) -> None:
        """Draw the newest of what came; without a spectator it is kept until one comes."""
        for kind, data in news.others:
            self._take(kind, data)
        self._panel.note(news.snapshots)
        if news.snapshots:
            self._newest = news.snapshots[-1]
            self._tell(self._stop_state())
        self._jpeg = news.jpeg or self._jpeg
        watched = bool(self._server.get_clients())
        if watched and not self._watched:  # who comes late may find a rig that stands still
            self._panel.draw_all()
        self._watched = watched
        if watched or not self._drawn:
            with self._server.atomic():  # a browser never sees half of a snapshot
                self._draw()

    def _stop_state(self) -> dict[str, object]:
        """Return what the stop button must know: a recording can neither be stopped nor resumed.

        blind: joints without feedback, which do not take hold where they are but jump
        """
        if self._replay is not None:
            return {"recording": True}
        shot = self._newest
        stopped, blind = (shot.stopped, len(shot.reckoned)) if shot else ("", 0)
        return {"stopped": stopped, "silent": False, "blind": blind}

    def _take(self, kind: bytes, data: object) -> None:
        """Take what the rig says beside snapshots and pictures."""
        if kind == WORDS and isinstance(data, list):
            who, words = data
            self._controls.answered(who, words)
        elif kind == KNOBS and isinstance(data, list):
            self._controls.knobs(data)
        elif isinstance(data, dict):
            if kind == CHOICES:
                self._controls.offer(data)
            elif kind == VALUES:
                self._controls.values(data)
            elif kind == REPLAY:
                self._show_replay(data)

    def _show_replay(self, state: Mapping[str, object]) -> None:
        if self._replay is None:
            duration_s = state.get("duration_s")
            assert isinstance(duration_s, int | float)  # the rig's side writes it first
            self._controls.leave()
            self._tell({"recording": True})
            self._replay = ReplayView(
                self._server.gui,
                self._ask_replay,
                float(duration_s),
            )
        self._replay.show(state)

    def _ask_replay(self, client: int, asked: Mapping[str, object]) -> None:
        self._teller.ask(asked, str(client))

    def _draw(self) -> None:
        if self._newest is not None:
            self._head.show(self._newest)
            self._people.show(self._newest)
            self._layers.show(self._newest, self._panel.layers)
            self._panel.show(self._newest)
            if self._replay is None:
                self._controls.show(self._newest)
            self._drawn = True
        if self._jpeg is not None:
            self._panel.show_picture(self._jpeg)
        self._newest = self._jpeg = None

    def silent(self) -> None:
        """Say that nothing comes any more, beside the last that came."""
        self.show(News((), None, ended=False))
        if self._drawn:
            self._panel.silent()
            self._tell({"stopped": "", "silent": True})


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


class Served(NamedTuple):
    """A page that can be reached: the server behind the door, the door, and where it is.

    words: what there is to say to the person in front of the rig, None for nothing
    """

    server: viser.ViserServer
    door: AuthProxy
    url: str
    words: str | None


def serve(
    host: str, port: int, token: str, folder: Path, teller: Outbox, stop: StopSender
) -> Served:
    """Open the page's server, and its door on the first free port.

    Args:
        host: the address
        port: the first to try; a busy one moves on to the next
        token: what browsers must show
        folder: that only this user can enter, for the server's socket
        teller: hands on what is asked for
        stop: hands on stops

    Raises:
        OSError: see ``free_port``.
    """
    open_port = free_port(host, port)
    server = open_server(folder / "page.sock")
    door = AuthProxy(host, open_port, folder / "page.sock", teller.hand_on, stop, token)
    teller.name = lambda client: _browser(server, client)
    teller.leads = door.browsers.led_by
    door.open()
    words = []
    if port not in (0, open_port):  # 0 asks for any port
        words.append(f"port {port} is busy, using {open_port}")
    name = socket.gethostname() if host in _EVERYWHERE else host
    url = f"http://[{name}]:{open_port}" if ":" in name else f"http://{name}:{open_port}"
    return Served(server, door, f"{url}/?token={token}", "; ".join(words) or None)


def _browser(server: viser.ViserServer, client: str) -> str:
    """Return what the browser of a client is called; client: its number, and maybe more."""
    number = client.partition(":")[0]
    return browser_of(server, int(number)) if number.isdecimal() else ""


def watch(feed: socket.socket, view: PageView, parent: int, door: AuthProxy) -> None:
    """Draw what comes until the other side is gone.

    Raises:
        RuntimeError: nobody can come in any more; a page that is started anew may help.
    """
    pause = threading.Event()
    while True:
        if not door.is_open():
            raise RuntimeError("the page's door has closed by itself")
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


def main(arguments: list[str]) -> int:
    """Run the page; give the process's exit code."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    limit_process()
    fd, stop_fd, parent, host, port = arguments
    token = os.environ.pop(TOKEN_VARIABLE)
    # Not closed by hand: its end tells the other side to read this process's last words,
    # and those of an exception are written only after a ``with`` has been left.
    feed = socket.socket(fileno=int(fd))
    teller, stop = Outbox(feed), StopSender(socket.socket(fileno=int(stop_fd)))
    folder = Path(os.environ.pop(FOLDER_VARIABLE))
    try:
        return _show(feed, teller, stop, (host, int(port)), token, folder, int(parent))
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _show(
    feed: socket.socket,
    teller: Outbox,
    stop: StopSender,
    address: tuple[str, int],
    token: str,
    folder: Path,
    parent: int,
) -> int:
    """Serve the page until the rig is gone; give the process's exit code."""
    try:
        served = serve(*address, token, folder, teller, stop)
    except OSError as error:
        host, port = address
        sys.stderr.write(f"cannot open {host} port {port}: {error.strerror or error}\n")
        return CANNOT_OPEN
    if served.words is not None:
        feed.send(NOTICE + served.words.encode())
    view = PageView(served.server, teller, served.door.tell)
    feed.send(URL + served.url.encode())
    watch(feed, view, parent, served.door)
    served.door.close()
    served.server.stop()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
