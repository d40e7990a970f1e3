"""Process of the page: receives the newest snapshot from the socket and draws it.

Started by ``gazerig.robot.dashboard.feed.page_process.PageProcess`` as ``python -m
gazerig.robot.dashboard.page_main FD STOP_FD PARENT HOST PORT``. The token and a private folder are
in its environment, because other users can read its arguments. It ends when the other side of the
socket closes. Nothing is downloaded: the page's script is part of the viser package and all shapes
are made here. Browsers connect through ``gazerig.robot.dashboard.door.auth_proxy``; their users'
requests are sent to the rig over the same socket.
"""

import errno
import logging
import os
import resource
import select
import shutil
import signal
import socket
import sys
import threading
from math import inf
from pathlib import Path
from typing import NamedTuple

import msgspec
import viser

from gazerig.drivers.process import message_link
from gazerig.drivers.process.message_link import MessageLink
from gazerig.drivers.process.priority import lower_priority
from gazerig.robot.dashboard.door.admission import page_url
from gazerig.robot.dashboard.door.auth_proxy import AuthProxy
from gazerig.robot.dashboard.door.browsers import Browsers
from gazerig.robot.dashboard.door.viser_server import browser_of, camera_of, open_server
from gazerig.robot.dashboard.feed.live_feed import LiveFeed, read_waiting
from gazerig.robot.dashboard.feed.page_process import (
    CANNOT_OPEN,
    COMMANDS_VARIABLE,
    FOLDER_VARIABLE,
    NOTICE,
    ONCE_VARIABLE,
    TOKEN_VARIABLE,
    URL,
)
from gazerig.robot.dashboard.page_view import PageView
from gazerig.robot.dashboard.requests.outbox import Outbox
from gazerig.robot.dashboard.requests.pointer_to_look import PointerToLook
from gazerig.robot.dashboard.requests.stop_sender import StopSender
from gazerig.robot.dashboard.widgets.widgets import Widgets
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.commands import LookAt, MoveOpponent

_FRAME_S = 0.04
_SILENT_AFTER_S = 1.0
_BEAT_S = 0.5
_PORTS_TRIED = 100
_PORTS = 65536
_NICENESS = 5  # the control loop has priority on a shared core
_MOST_FILES = 8192  # a burst of connections must not use all file descriptors


def free_port(host: str, port: int) -> int:
    """Find the first port from this one on that can be bound.

    Raises:
        OSError: the address does not belong to this machine, or none of the ports is free.
    """
    family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    for candidate in range(port, min(port + _PORTS_TRIED, _PORTS)):
        with socket.socket(family, socket.SOCK_STREAM) as trial:
            # Like the server itself: a port in TIME_WAIT is free, one with a listener is not.
            trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                trial.bind((address[0], candidate))
            except OSError as error:
                if error.errno != errno.EADDRINUSE:
                    raise
            else:
                return candidate
    raise OSError(errno.EADDRINUSE, f"no port from {port} on is free")


class ServedPage(NamedTuple):
    """Open page: the server behind the door, the door and the address.

    outbox: sends requests to the rig; pointer: receives pointers of browsers
    words: message for the terminal, None if there is none
    """

    server: viser.ViserServer
    door: AuthProxy
    outbox: Outbox
    pointer: PointerToLook
    url: str
    words: str | None


def serve(
    host: str, port: int, token: str, folder: Path, feed: MessageLink, stop: StopSender,
    rig: Path | None = None,
) -> ServedPage:  # fmt: skip
    """Open the page's server, and its door on the first free port.

    Raises:
        OSError: see ``free_port``.
    """
    open_port = free_port(host, port)
    inside = folder / "page.sock"
    server = open_server(inside)
    browsers, widgets = Browsers(token), Widgets()

    def name(client: str) -> str:
        """Return the name of a client's browser; client: its name, or its number in the view."""
        in_view = browser_of(server, int(client)) if client.isdecimal() else ""
        return widgets.browser(client) or in_view

    outbox = Outbox(
        feed,
        name=name,
        leads=browsers.give_control,
    )
    pointer = PointerToLook(
        lambda browser: camera_of(server, browser),
        # Do not mark the browser as in control: only its points show that a pointer is present.
        lambda point, who: outbox.forward(
            msgspec.json.encode(LookAt(point, who=who, pointer=True))
        ),
        move_opponent=lambda point: outbox.forward(msgspec.json.encode(MoveOpponent(point))),
    )
    door = AuthProxy(
        host, open_port, inside, outbox.forward, stop, token, browsers, widgets, pointer.look_at_pointer,
        outbox.send_picture, rig,
    )  # fmt: skip
    door.open()
    text = []
    if port not in (0, open_port):  # 0 asks for any port
        text.append(f"port {port} is busy, using {open_port}")
    url = f"{page_url(host, open_port)}/?token={token}"
    return ServedPage(server, door, outbox, pointer, url, "; ".join(text) or None)


def show_until_closed(feed: MessageLink, view: PageView, parent: int, served: ServedPage) -> None:
    """Draw incoming snapshots until the other side has closed.

    Raises:
        RuntimeError: no browser can connect any more; a restart of the page may help.
    """
    door, pointer = served.door, served.pointer
    pause, live = threading.Event(), LiveFeed()
    live.choices = view.choices
    clock, beat_s = RealClock(), -inf
    while True:
        if not door.is_open():
            raise RuntimeError("the page's door has closed")
        if clock.now_s() >= beat_s:
            # Started here and sent by the door's thread, so both are alive.
            beat_s = clock.now_s() + _BEAT_S
            door.call_soon(served.outbox.send_heartbeat)
        readable, _, _ = select.select([feed], [], [], _SILENT_AFTER_S)
        if readable:
            live.watched = view.watched()
            news = read_waiting(feed, live)
            if news.ended:
                return
            view.emulated, view.choice = live.emulated, live.choice
            view.show(news)
            if news.snapshots:
                pointer.p_world_eyes_m = news.snapshots[-1].p_world_head_m
            pause.wait(_FRAME_S)
        else:
            # A process forked by the rig may hold the socket open after the rig's death.
            if os.getppid() != parent:
                return
            view.silent()


def main(arguments: list[str]) -> int:
    """Run the page; return the exit code of the process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    lower_priority(_NICENESS)
    least, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(least, min(_MOST_FILES, most)), most))
    # Standard error is in memory, and a client that sends malformed data fills it with errors.
    logging.disable(logging.CRITICAL)
    fd, stop_fd, parent, host, port = arguments
    token = os.environ.pop(TOKEN_VARIABLE)
    # Do not close it explicitly: its end makes the other side read this process's last messages,
    # and those of an exception are written only after the end of a ``with`` block.
    feed = message_link.open_link(fd)
    stop = StopSender(message_link.open_link(stop_fd))
    folder = Path(os.environ.pop(FOLDER_VARIABLE))
    commands = os.environ.pop(COMMANDS_VARIABLE, "")
    try:
        try:
            rig = Path(commands) if commands else None
            served = serve(host, int(port), token, folder, feed, stop, rig)
        except OSError as error:
            sys.stderr.write(f"cannot open {host} port {port}: {error.strerror or error}\n")
            return CANNOT_OPEN
        served.door.admission.one_time_token = os.environ.pop(ONCE_VARIABLE, "")
        if served.words is not None:
            feed.send(NOTICE + served.words.encode())
        view = PageView(served.server, served.door.widgets, served.outbox, served.door.send_state)
        feed.send(URL + served.url.encode())
        show_until_closed(feed, view, int(parent), served)
        served.door.close()
        served.server.stop()
        return 0
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
