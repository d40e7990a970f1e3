"""A browser without the drawing: comes in with the token, asks, and listens."""

import json
import socket
import urllib.error
import urllib.request
from email.message import Message
from importlib.metadata import version
from typing import Any
from urllib.parse import urlsplit

import msgspec
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin, Subprotocol

PATIENCE_S = 180.0  # how long a slow machine is waited for, not how long it takes
VISER = Subprotocol(f"viser-v{version('viser')}")

# The page counts a browser as connected when it has sent its viewpoint.
LOOKING = msgspec.msgpack.encode(
    {
        "type": "ViewerCameraMessage",
        "wxyz": [1.0, 0.0, 0.0, 0.0],
        "position": [1.0, 0.0, 0.0],
        "fov": 1.0,
        "near": 0.1,
        "far": 100.0,
        "image_height": 600,
        "image_width": 800,
        "look_at": [0.0, 0.0, 0.0],
        "up_direction": [0.0, 0.0, 1.0],
    }
)


class Opener(urllib.request.HTTPRedirectHandler):
    """Follows no redirect, so that it can be looked at."""

    def redirect_request(self, *_: object) -> None:
        return None


def fetch(
    url: str, headers: dict[str, str] | None = None, body: bytes | None = None
) -> tuple[int, Message, str]:
    """Status, headers and text of an answer, whatever the status is."""
    request = urllib.request.Request(url, data=body, headers=headers or {})
    try:
        answer = urllib.request.build_opener(Opener).open(request, timeout=PATIENCE_S)
    except urllib.error.HTTPError as error:
        answer = error
    with answer:
        return answer.status, answer.headers, answer.read().decode()


class Visitor:
    """Who has opened the address that the terminal shows.

    url: of the page, without the token; headers: what a browser sends with every request
    """

    def __init__(self, address: str) -> None:
        parts = urlsplit(address)
        self.url = f"{parts.scheme}://{parts.netloc}"
        status, headers, _ = fetch(address)
        assert status == 302, status
        cookies = headers.get_all("Set-Cookie") or []
        pairs = "; ".join(cookie.partition(";")[0] for cookie in cookies)
        self.headers = {"Cookie": pairs, "Origin": self.url}

    def get(self, path: str = "/") -> bytes:
        """Content of a path."""
        request = urllib.request.Request(self.url + path, headers=self.headers)
        with urllib.request.urlopen(request, timeout=PATIENCE_S) as answer:
            body: bytes = answer.read()
            return body

    def ask(self, asked: object) -> int:
        """Ask for something as the page's script does; the status of the answer."""
        return fetch(f"{self.url}/api/v1/do", self.headers, json.dumps(asked).encode())[0]

    def open(self, path: str = "/view", receive_bytes: int | None = None) -> ClientConnection:
        """Open a websocket: that of the view, or that of the page's script."""
        there = socket.socket()
        if receive_bytes is not None:
            there.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_bytes)
        parts = urlsplit(self.url)
        there.connect((parts.hostname, parts.port))
        return connect(
            f"ws://{parts.netloc}{path}",
            sock=there,
            origin=Origin(self.url),
            subprotocols=[VISER] if path == "/view" else None,
            additional_headers={"Cookie": self.headers["Cookie"]},
            max_size=None,
            compression=None,
            open_timeout=PATIENCE_S,
            ping_interval=None,
            max_queue=1 if receive_bytes is not None else None,
            close_timeout=1.0,
        )

    def state(self) -> dict[str, Any]:
        """Newest state of the rig."""
        state: dict[str, Any] = json.loads(self.get("/api/v1/state"))["ok"]["state"]
        return state
