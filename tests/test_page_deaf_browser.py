"""A browser that connects and reads nothing any more, as one behind a lost Wi-Fi: it harms nobody.

Its share of what the page sends fills the buffers on the way; what counts is that the rig, the
other browsers and the stop button do not notice.
"""

import json
import os
import socket
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace

import numpy as np
import pytest
import viser
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from robot.orders import Stop, as_json
from robot.page import Page
from robot.page_picture import encode
from robot.types import Snapshot

PATIENCE_S = 60.0  # how long a slow machine is waited for, not how long it takes
VISER = f"viser-v{viser.__version__}"
AHEAD = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
SNAPSHOT = Snapshot(
    t_s=1.0,
    measured_rad=(0.1,) * 9,
    wish_rad=(0.1,) * 9,
    R_world_head=AHEAD,
    p_world_head_m=(0.03, 0.0, 0.14),
    p_world_eyes_m=((0.03, 0.031, 0.14), (0.03, -0.031, 0.14)),
    gaze_world=((1.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
    lids=(0.8, 0.8),
    p_world_target_m=(0.9, 0.1, 0.25),
    target_name="the first target",
    why="it is there",
    phase="fixate",
    level="ok",
    reasons=(),
    faces=(),
    bodies=(),
    rate_hz=200.0,
    health="0 lost",
)
# Noise does not compress: what the deaf browser is owed soon fills all buffers.
NOISE = np.random.default_rng(0).integers(0, 255, (240, 320, 3)).astype(np.uint8)
OWED_BYTES = 12_000_000


def wait_for(ready: Callable[[], object], what: str) -> None:
    last_s = time.monotonic() + PATIENCE_S
    while not ready():
        assert time.monotonic() < last_s, f"{what} did not come within {PATIENCE_S:.0f} s"
        time.sleep(0.02)


@contextmanager
def deaf_browser(port: int) -> Iterator[socket.socket]:
    """Open the page's websocket, read the answer's header and then nothing."""
    there = socket.socket()
    there.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    with there:
        there.connect(("127.0.0.1", port))
        there.sendall(
            f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\n"
            f"Origin: http://127.0.0.1:{port}\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Protocol: {VISER}\r\n"
            "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n".encode()
        )
        assert b" 101 " in there.recv(1024).splitlines()[0]
        yield there


class Listener:
    """A browser that reads everything; without the drawing."""

    def __init__(self, url: str) -> None:
        self.bytes, self.last = 0, b""
        self._socket = connect(
            url.replace("http", "ws") + "/", origin=url, subprotocols=[VISER], max_size=None,
            compression=None, open_timeout=PATIENCE_S, ping_interval=None,
        )  # fmt: skip
        self._words: set[bytes] = set()
        self.awaited = b"the first target"
        self._thread = threading.Thread(target=self._read)
        self._thread.start()

    def _read(self) -> None:
        with suppress(ConnectionClosed):
            for message in self._socket:
                assert isinstance(message, bytes)
                self.bytes += len(message)
                if self.awaited in message:
                    self._words.add(self.awaited)

    def reads(self, words: bytes) -> bool:
        self.awaited = words
        return words in self._words

    def close(self) -> None:
        self._socket.close()
        self._thread.join()


class Rig:
    """A page that is fed as by a running rig, and what was heard from it."""

    def __init__(self) -> None:
        with socket.socket() as trial:
            trial.bind(("127.0.0.1", 0))
            self.port = trial.getsockname()[1]
        self.heard: list[dict[str, object]] = []
        self.page = Page("127.0.0.1", self.port, self.heard.append)
        self.snapshot = SNAPSHOT
        self.rounds = 0
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._feed)

    def open(self) -> str:
        self.page.open()
        wait_for(self.page.url, "the page's address")
        self._thread.start()
        return str(self.page.url())

    def _feed(self) -> None:
        jpeg = encode(NOISE)
        while not self._over.wait(0.02):
            self.rounds += 1
            self.page.show(replace(self.snapshot, t_s=0.02 * self.rounds))
            self.page.show_picture(jpeg)

    def memory_bytes(self) -> int:
        process = self.page._process
        assert process is not None
        with open(f"/proc/{process.pid}/statm", encoding="ascii") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    def close(self) -> None:
        self._over.set()
        self._thread.join()
        self.page.close()


@pytest.fixture
def rig() -> Iterator[Rig]:
    rig = Rig()
    try:
        yield rig
    finally:
        rig.close()


def stop_state(url: str) -> object:
    """What the stop button is told first."""
    with urllib.request.urlopen(f"{url}/rig/state", timeout=PATIENCE_S) as stream:
        return json.loads(stream.readline().removeprefix(b"data: "))["stopped"]


def press_stop(url: str) -> None:
    body = json.dumps(as_json(Stop("a test"))).encode()
    request = urllib.request.Request(f"{url}/rig/ask", body, {"Origin": url})
    with urllib.request.urlopen(request, timeout=PATIENCE_S) as answer:
        assert answer.status == 204


def drained(there: socket.socket, patience_s: float = 1.0) -> int:
    """How much was kept for the deaf one when it reads at last."""
    there.settimeout(patience_s)
    taken = 0
    with suppress(TimeoutError):
        while data := there.recv(1 << 16):
            taken += len(data)
    return taken


def test_who_reads_nothing_holds_up_neither_the_page_nor_the_rig(rig: Rig) -> None:
    url = rig.open()
    with deaf_browser(rig.port) as deaf:
        listener = Listener(url)
        try:
            t=time.monotonic()
            for k in range(1,5):
                wait_for(lambda: listener.bytes > k*OWED_BYTES, "what one who reads gets")
                print(k, time.monotonic()-t, listener.bytes, rig.memory_bytes()/1e6, rig.page.dropped, rig.page.pictures_dropped, rig.rounds)
            # Now as ever: others see the newest, a stop is heard, the button knows of it.
            rig.snapshot = replace(SNAPSHOT, target_name="the target of later", stopped="a test")
            wait_for(lambda: listener.reads(b"the target of later"), "the newest words")
            press_stop(url)
            wait_for(lambda: rig.heard, "the stop")
            assert rig.heard == [as_json(Stop("a test"))]
            wait_for(lambda: stop_state(url) == "a test", "the button's news")
            rig._over.set()
            print(drained(deaf), listener.bytes)
            assert 0
        finally:
            listener.close()
