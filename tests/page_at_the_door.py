"""A page with its door, on this machine and on another address."""

import json
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from email.message import Message
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from page_visitor import VISER, fetch
from websockets.sync.client import ClientConnection, connect

from gazerig.robot.dashboard.door.auth_proxy import AuthProxy
from gazerig.robot.dashboard.door.browsers import Browsers
from gazerig.robot.dashboard.door.viser_server import open_server
from gazerig.robot.dashboard.requests.stop_channel import StopListener
from gazerig.robot.dashboard.requests.stop_sender import StopSender
from gazerig.robot.dashboard.widgets.widgets import Widgets

PATIENCE_S = 20.0
TOKEN = "what-only-the-terminal-shows"
ELSEWHERE = "http://elsewhere.example"
OPENED: list[str] = []
"""The addresses of all doors of these tests."""


class Rig:
    """A door with a server behind it, and the requests through it."""

    def __init__(self, host: str, folder: Path) -> None:
        self.asked: list[dict[str, Any]] = []
        self.stops: list[dict[str, Any]] = []
        self.takes = True
        self.stop_answer = ""
        with socket.socket() as trial:
            trial.bind((host, 0))
            port = trial.getsockname()[1]
        inside = folder / "page.sock"
        self.server = open_server(inside)
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._listener = StopListener(ours, self.stop)
        self._sender = theirs
        self.take_picture: Callable[[bytes], bool] = lambda jpeg: False
        self.door = AuthProxy(
            host, port, inside, self.take, StopSender(theirs), TOKEN, Browsers(TOKEN), Widgets(),
            lambda asked, who: True, lambda jpeg: self.take_picture(jpeg),
        )  # fmt: skip
        self.door.open()
        self.address = f"{host}:{port}"
        self.url = f"http://{self.address}"
        self.cookie = f"{self.door._cookie}={TOKEN}"

    def take(self, data: bytes) -> bool:
        self.asked.append(json.loads(data))
        return self.takes

    def stop(self, asked: Any) -> str:
        self.stops.append(dict(asked))
        return self.stop_answer

    def get(self, path: str = "", **headers: str) -> tuple[int, Message, str]:
        """Get something as a browser does that has shown the token before."""
        return fetch(self.url + path, {"Cookie": self.cookie, **headers})

    def post(self, body: bytes, **headers: str | None) -> tuple[int, Message, str]:
        """Ask for something as the page's script does, with other headers as given."""
        given = {"Cookie": self.cookie, "Origin": self.url, **headers}
        words = {k: v for k, v in given.items() if v is not None}
        return fetch(f"{self.url}/rig/ask", words, body)

    def knock(self, path: str = "/view", **headers: str | None) -> ClientConnection:
        """Open a websocket as a browser does, with other headers as given."""
        given: dict[str, Any] = {"Cookie": self.cookie, **headers}
        origin = given.pop("origin", self.url)
        return connect(
            f"ws://{self.address}{path}",
            origin=origin,
            subprotocols=[VISER] if path == "/view" else None,
            max_size=None,
            compression=None,
            open_timeout=PATIENCE_S,
            additional_headers={k: v for k, v in given.items() if v is not None},
        )

    def close(self) -> None:
        self.door.close()
        self.server.stop()
        self._listener.close()
        self._sender.close()


@contextmanager
def opened(host: str) -> Iterator[Rig]:
    with TemporaryDirectory() as folder:
        rig = Rig(host, Path(folder))
        OPENED.append(rig.address)
        try:
            yield rig
        finally:
            rig.close()
