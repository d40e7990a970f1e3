"""A browser that connects and stops reading, as behind a lost Wi-Fi, harms no one.

Its share of what the page sends fills the buffers on the way; what counts is that the rig, the
other browsers and the stop button do not notice.
"""

import itertools
import json
import socket
import threading
from contextlib import ExitStack, closing, suppress

import numpy as np
from msgspec.structs import replace
from page_feed import PageFeed, going_on
from page_visitor import LOOKING, Visitor
from present import present
from shown_page import running_page, wait_for
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection

OWED_BYTES = 6_000_000
"""More than Linux keeps for one connection."""


SOCKET, VIEW = "/api/v1/socket?rate_hz=25&events=true&pictures=true&rig=true", "/view"


def browser(visitor: Visitor, path: str, deaf: bool = False) -> ClientConnection:
    """A browser without the drawing; a deaf one reads nothing."""
    there = visitor.open(path, receive_bytes=4096 if deaf else None)
    if path == VIEW:
        there.send(LOOKING)
    return there


class Listener:
    """A browser that reads everything; without the drawing."""

    def __init__(self, visitor: Visitor, path: str = SOCKET) -> None:
        self.bytes = 0
        self._socket = browser(visitor, path)
        self._words: set[str] = set()
        self.awaited = "the first target"
        self._thread = threading.Thread(target=self._read)
        self._thread.start()

    def _read(self) -> None:
        with suppress(ConnectionClosed):
            for message in self._socket:
                self.bytes += len(message)
                if isinstance(message, str) and self.awaited in message:
                    self._words.add(self.awaited)

    def reads(self, words: str) -> bool:
        self.awaited = words
        return words in self._words

    def close(self) -> None:
        self._socket.close()
        self._thread.join()


def drained(there: ClientConnection) -> int:
    """Return the bytes kept for the deaf browser when it finally reads."""
    taken = 0
    with suppress(TimeoutError, ConnectionClosed):  # sent away in the end
        while True:
            taken += len(there.recv(timeout=1.0))
    return taken


def test_who_reads_nothing_holds_up_neither_the_page_nor_the_rig():
    heard: list[dict[str, object]] = []

    def serve(end: socket.socket) -> None:
        """Answer what the page's process asks of the rig."""

        def answer() -> None:
            with suppress(OSError), end.makefile("rb") as lines:
                for line in lines:
                    asked = json.loads(line)
                    heard.append(asked)
                    end.sendall(json.dumps({"ok": {}, "tag": asked.get("tag")}).encode() + b"\n")

        threading.Thread(target=answer, daemon=True).start()

    changes: dict[str, object] = {}
    # Noise does not compress: what the deaf browsers are owed soon fills all buffers.
    noise = np.random.default_rng(0).integers(0, 255, (8, 400, 640, 3)).astype(np.uint8)
    numbers = itertools.count()
    with running_page(serve=serve) as (page, url):
        feed, visitor = PageFeed(page), Visitor(url)
        percept = present(feed.tick.percept)
        (face,) = percept.faces

        def show() -> None:
            """New people again and again, with all their shapes."""
            number = next(numbers)
            newer = replace(percept, faces=(replace(face, id=number // 3),))
            feed.show(noise[number % len(noise)], percept=newer, **changes)

        paths = (SOCKET, VIEW)
        with ExitStack() as stack:
            with going_on(show):
                deaf = [browser(visitor, path, deaf=True) for path in paths]
                for one in deaf:
                    stack.enter_context(one)
                read_all = [stack.enter_context(closing(Listener(visitor, path))) for path in paths]
                owed = lambda: all(it.bytes > OWED_BYTES for it in read_all)  # noqa: E731
                wait_for(owed, "what those who read get")
                # Now as ever: others see the newest, a stop is heard, the button knows of it.
                changes["stopped"] = "a test"
                wait_for(lambda: read_all[0].reads('"stopped":"a test"'), "the newest words")
                seen = [one.bytes for one in read_all]
                wait_for(lambda: all(it.bytes > n for it, n in zip(read_all, seen, strict=True)),
                         "more for those who read")  # fmt: skip
                assert visitor.ask({"do": "stop", "why": "a test"}) == 200
                wait_for(lambda: "stop" in [asked["do"] for asked in heard], "the stop")
                wait_for(lambda: visitor.state()["stopped"] == "a test", "the newest state")
            # They were deaf indeed: what they were owed was not all kept for them.
            for there, reader in zip(deaf, read_all, strict=True):
                assert 0 < drained(there) < reader.bytes - 1_000_000
