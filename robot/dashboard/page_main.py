"""Process of the page: receives the rig's ticks, serves clients and draws the view.

Started by ``gazerig.robot.dashboard.feed.page_process.PageProcess`` as ``python -m
gazerig.robot.dashboard.page_main LINK ORDERS SLOW PARENT HOST PORT``. The token and a private
folder are in its environment, because other users can read its arguments. It ends when the other
side of the link closes. Nothing is downloaded: viser's script is part of its package and all shapes
are made here. Clients connect through ``gazerig.robot.dashboard.door.page_door``; their requests
are sent to the rig over two further connections.
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
from collections.abc import Sequence
from math import inf
from pathlib import Path

from gazerig.drivers.process import message_link
from gazerig.drivers.process.message_link import DONT_WAIT, MessageLink
from gazerig.drivers.process.priority import lower_priority
from gazerig.robot.dashboard.door.admission import page_url
from gazerig.robot.dashboard.door.page_door import BACKLOG, HeadNews, PageDoor
from gazerig.robot.dashboard.door.viser_server import open_server
from gazerig.robot.dashboard.feed.page_process import (
    BEAT,
    CANNOT_OPEN,
    FOLDER_VARIABLE,
    NOTICE,
    ONCE_VARIABLE,
    PICTURE,
    TOKEN_VARIABLE,
    URL,
)
from gazerig.robot.dashboard.feed.rig_feed import RigFeed
from gazerig.robot.dashboard.package_panels import PackagePanels
from gazerig.robot.dashboard.view.scene import HeadScene
from gazerig.robot.loop.head_state import HeadEvent, head_state
from gazerig.robot.model.clock import RealClock
from gazerig.robot.net.topics import PanelContent, RigInfo, RunState

_PAUSE_S = 0.02
"""Pause after a batch of ticks, s: the frame that follows it is then shown with it."""
_SELDOM_S = 0.5
"""Time between two states of the run, and of packages' panels, s."""
_SILENT_AFTER_S = 1.0
_BEAT_S = 0.5
_PORTS_TRIED = 100
_PORTS = 65536
_NICENESS = 5  # the control loop has priority on a shared core
_MOST_FILES = 8192  # a burst of connections must not use all file descriptors


def listen(host: str, port: int) -> socket.socket:
    """Listen on the first port from this one on that is free.

    Raises:
        OSError: the address does not belong to this machine, or none of the ports is free.
    """
    family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    for candidate in range(port, min(port + _PORTS_TRIED, _PORTS)):
        try:
            return socket.create_server((address[0], candidate), family=family, backlog=BACKLOG)
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                raise
    raise OSError(errno.EADDRINUSE, f"no port from {port} on is free")


class Page:
    """The page of one rig: the server of the view, the door, and the data that they show.

    Args:
        host: Address.
        port: First port to try.
        token: What clients must show.
        folder: Folder that only this user can read.
        link: Link to the rig.
        ends: Connections to the rig for requests.

    Attributes:
        url: Address with the token.
        words: Message for the terminal, "" if there is none.

    Raises:
        OSError: see ``listen``.
    """

    def __init__(
        self, host: str, port: int, token: str, folder: Path, link: MessageLink,
        ends: Sequence[socket.socket],
    ) -> None:  # fmt: skip
        listener = listen(host, port)
        open_port = listener.getsockname()[1]
        inside = folder / "page.sock"
        self._link, self._feed, self._clock = link, RigFeed(), RealClock()
        self._server = open_server(inside)
        self._scene = HeadScene(self._server)
        self.door = PageDoor(
            host, listener, inside, ends, token, self._feed.ticks, self._send_picture,
        )  # fmt: skip
        self._panels = PackagePanels()
        self._beat_s = self._run_s = -inf
        self._rig: RigInfo | None = None
        self._number = 0
        self.door.open()
        busy = port not in (0, open_port)  # 0 asks for any port
        self.words = f"port {port} is busy, using {open_port}" if busy else ""
        self.url = f"{page_url(host, open_port)}/?token={token}"

    def run(self, parent: int) -> None:
        """Show incoming ticks until the rig has closed the link.

        Raises:
            RuntimeError: no client can connect any more; a restart of the page may help.
        """
        pause, heard_s = threading.Event(), self._clock.now_s()
        while True:
            if not self.door.is_open():
                raise RuntimeError("the page's door has closed")
            now_s = self._clock.now_s()
            if now_s >= self._beat_s:
                # Started here and sent by the door's thread, so both are alive.
                self._beat_s = now_s + _BEAT_S
                self.door.call_soon(self._send, BEAT)
            readable, _, _ = select.select([self._link], [], [], _SILENT_AFTER_S)
            if readable:
                heard_s = now_s
                self._feed.read_waiting(self._link)
                if self._feed.ended:
                    return
                self._show()
                pause.wait(_PAUSE_S)
            else:
                # A process forked by the rig may hold the socket open after the rig's death.
                if os.getppid() != parent:
                    return
                silent_s = self._clock.now_s() - heard_s
                self.door.call_soon(self.door.distribute, HeadNews(silent_s=silent_s))

    def _show(self) -> None:
        """Give the clients and the view what is new."""
        feed, wanted = self._feed, self.door.wanted()
        head = feed.shown_head()
        if head is None or feed.rig is None:
            return
        now_s = self._clock.now_s()
        topics: list[RigInfo | RunState | PanelContent] = []
        if feed.rig.info != self._rig:
            self._rig = feed.rig.info
            topics.append(self._rig)
        if now_s - self._run_s >= _SELDOM_S:
            self._run_s = now_s
            topics.append(feed.run_state())
            topics += self._panels.draw(head_state(head.tick)) if wanted.rig else ()
        picture = feed.picture() if wanted.pictures else None
        events: tuple[HeadEvent, ...] = ()
        if feed.ticks.number > self._number:
            events = feed.ticks.events(self._number)
            self._number = feed.ticks.number
        news = HeadNews(head.tick, events, tuple(topics), picture)
        self.door.call_soon(self.door.distribute, news)
        self._scene.show(head, feed.shown_world())

    def _send(self, message: bytes) -> bool:
        """Send a message to the rig; return False if it does not accept it now."""
        try:
            self._link.send(message, DONT_WAIT)
        except OSError:  # the buffer is full, the rig has ended, or the message is too long
            return False
        return True

    def _send_picture(self, jpeg: bytes) -> bool:
        return self._send(PICTURE + jpeg)

    def close(self) -> None:
        """Close all connections."""
        self.door.close()
        self._server.stop()


def main(arguments: list[str]) -> int:
    """Run the page; return the exit code of the process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    lower_priority(_NICENESS)
    least, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(least, min(_MOST_FILES, most)), most))
    # Standard error is in memory, and a client that sends malformed data fills it with errors.
    logging.disable(logging.CRITICAL)
    fd, orders, slow, parent, host, port = arguments
    token = os.environ.pop(TOKEN_VARIABLE)
    # Do not close it explicitly: its end makes the other side read this process's last messages,
    # and those of an exception are written only after the end of a ``with`` block.
    link = message_link.open_link(fd)
    ends = [message_link.open_link(end) for end in (orders, slow)]
    folder = Path(os.environ.pop(FOLDER_VARIABLE))
    try:
        try:
            page = Page(host, int(port), token, folder, link, ends)
        except OSError as error:
            sys.stderr.write(f"cannot open {host} port {port}: {error.strerror or error}\n")
            return CANNOT_OPEN
        page.door.admission.one_time_token = os.environ.pop(ONCE_VARIABLE, "")
        if page.words:
            link.send(NOTICE + page.words.encode())
        link.send(URL + page.url.encode())
        page.run(int(parent))
        page.close()
        return 0
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
