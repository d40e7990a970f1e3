"""A page's door with a rig behind it that answers as a test wants, on this and another address."""

import json
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from email.message import Message
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from page_visitor import VISER, fetch
from websockets.sync.client import ClientConnection, connect
from websockets.sync.connection import Connection

from gazerig.robot.dashboard.door.page_door import PageDoor
from gazerig.robot.dashboard.door.viser_server import open_server
from gazerig.robot.loop.events import TickFeed

PATIENCE_S = 20.0
TOKEN = "what-only-the-terminal-shows"
ELSEWHERE = "http://elsewhere.example"
SOCKET = "/api/v1/socket"
OPENED: list[str] = []
"""The addresses of all doors of these tests."""
DONE: dict[str, Any] = {"ok": {"notes": []}}


class Rig:
    """A door with a server behind it, and the requests through it.

    asked, stops: what has reached the rig
    answer: what the rig answers to a request; it may wait
    """

    def __init__(self, host: str, folder: Path) -> None:
        self.asked: list[dict[str, Any]] = []
        self.stops: list[dict[str, Any]] = []
        self.answer: Callable[[dict[str, Any]], dict[str, Any]] = lambda asked: DONE
        listener = socket.create_server((host, 0))
        port = listener.getsockname()[1]
        inside = folder / "page.sock"
        self.server = open_server(inside)
        pairs = socket.socketpair(), socket.socketpair()
        self._ends = [ours for ours, _ in pairs]
        for end in self._ends:
            threading.Thread(target=self._serve, args=(end,), daemon=True).start()
        self.take_picture: Callable[[bytes], bool] = lambda jpeg: False
        self.feed = TickFeed()
        self.door = PageDoor(
            host, listener, inside, [theirs for _, theirs in pairs], TOKEN, self.feed,
            lambda jpeg: self.take_picture(jpeg),
        )  # fmt: skip
        self.door.open()
        self.address = f"{host}:{port}"
        self.url = f"http://{self.address}"
        self.cookie = f"{self.door._cookie}={TOKEN}"

    def _serve(self, end: socket.socket) -> None:
        with suppress(OSError), end.makefile("rb") as lines:
            for line in lines:
                asked = json.loads(line)
                if asked["do"] != "hello":
                    (self.stops if asked["do"] == "stop" else self.asked).append(asked)
                tag = {"tag": asked["tag"]} if "tag" in asked else {}
                end.sendall(json.dumps({**self.answer(asked), **tag}).encode() + b"\n")

    def named(self, name: str) -> str:
        """Return the cookies of a browser with a name of its own."""
        return f"{self.cookie}; {self.door._name_cookie}={name}"

    def get(self, path: str = "", **headers: str) -> tuple[int, Message, str]:
        """Get something as a browser does that has shown the token before."""
        return fetch(self.url + path, {"Cookie": self.cookie, **headers})

    def post(self, body: bytes, **headers: str | None) -> tuple[int, Message, str]:
        """Ask for something as the page's script does, with other headers as given."""
        given = {"Cookie": self.cookie, "Origin": self.url, **headers}
        words = {k: v for k, v in given.items() if v is not None}
        return fetch(f"{self.url}/api/v1/do", words, body)

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
            close_timeout=0.2,  # who floods does not read the answer to its farewell
            additional_headers={k: v for k, v in given.items() if v is not None},
        )

    def close(self) -> None:
        self.door.close()
        self.server.stop()
        for end in self._ends:
            end.close()


@contextmanager
def opened(host: str) -> Iterator[Rig]:
    with TemporaryDirectory() as folder:
        rig = Rig(host, Path(folder))
        OPENED.append(rig.address)
        try:
            yield rig
        finally:
            rig.close()


def answer_to(end: Connection, **message: object) -> dict[str, Any]:
    """Send a message over a websocket; return its answer."""
    end.send(json.dumps({**message, "tag": "t"}))
    while True:
        said: dict[str, Any] = json.loads(end.recv(timeout=PATIENCE_S))
        if said.get("tag") == "t":
            return said
