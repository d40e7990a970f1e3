"""The page's process: it delays no one, ends with its parent and finds a free port."""

import itertools
import json
import os
import signal
import socket
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, suppress
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple, cast
from urllib.parse import urlsplit

import child_processes
import numpy as np
import pytest
from branch import Branch
from msgspec.structs import replace
from page_feed import PageFeed, going_on
from page_visitor import LOOKING, PATIENCE_S, Visitor
from present import present
from shown_page import free_port, running_page, wait_for
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection

from gazerig.robot.dashboard.feed.page_process import BEAT, URL, PageProcess


class Page(NamedTuple):
    """A page that found its port busy, and what its process asks of the rig."""

    page: PageProcess
    url: str
    busy_port: int
    notice: str | None
    asked: list[dict[str, Any]]


@pytest.fixture(scope="module")
def shared() -> Iterator[Page]:
    """The page of all tests that need one, in this order; the last closes it."""
    asked: list[dict[str, Any]] = []

    def answer(end: socket.socket) -> None:
        with suppress(OSError), end.makefile("rb") as lines:
            for line in lines:
                asked.append(json.loads(line))
                tag = asked[-1].get("tag")
                end.sendall(json.dumps({"ok": {}, "tag": tag}).encode() + b"\n")

    def serve(end: socket.socket) -> None:
        threading.Thread(target=answer, args=(end,), daemon=True).start()

    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        busy = other.getsockname()[1]
        with running_page(busy, serve) as (page, url):
            yield Page(page, url, busy, page.notice(), asked)


def page_here(*others: int) -> int | None:
    """The process of the page that this one has started, alive or stopped."""
    found = [pid for pid in child_processes.running() if pid not in others]
    assert len(found) < 2, found
    return found[0] if found else None


def test_busy_port_moves_on_and_says_so(shared):
    port = urlsplit(shared.url).port
    assert port is not None and port > shared.busy_port
    assert shared.notice == f"port {shared.busy_port} is busy, using {port}"
    assert b"<html" in Visitor(shared.url).get().lower()


def test_page_is_on_the_loopback_alone_and_ignores_ctrl_c(shared):
    port = urlsplit(shared.url).port
    # The whole of 127.0.0.0/8 is this machine: a page on every address would answer here.
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.2", port))
    process = page_here()
    assert process is not None
    os.kill(process, signal.SIGINT)
    assert Visitor(shared.url).get()
    assert shared.page.notice() is None
    assert page_here() == process


# --- a browser that connects and stops reading, as behind a lost Wi-Fi
#
# Its share of what the page sends fills the buffers on the way; what counts is that the rig, the
# other browsers and the stop button do not notice.


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
    taken = len(there.recv(timeout=PATIENCE_S))
    with suppress(TimeoutError, ConnectionClosed):  # sent away in the end
        while True:
            taken += len(there.recv(timeout=0.3))
    return taken


def test_who_reads_nothing_holds_up_neither_the_page_nor_the_rig(shared):
    changes: dict[str, object] = {}
    # Noise does not compress: what the deaf browsers are owed soon fills all buffers.
    noise = np.random.default_rng(0).integers(0, 255, (8, 400, 640, 3)).astype(np.uint8)
    numbers = itertools.count()
    feed, visitor = PageFeed(shared.page), Visitor(shared.url)
    percept = present(feed.tick.percept)
    (face,) = percept.faces

    def show() -> None:
        """New people again and again, with all their shapes."""
        number = next(numbers)
        newer = replace(percept, faces=(replace(face, id=number),))
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
            wait_for(lambda: "stop" in [asked["do"] for asked in shared.asked], "the stop")
            wait_for(lambda: visitor.state()["stopped"] == "a test", "the newest state")
        # They were deaf indeed: what they were owed was not all kept for them.
        for there, reader in zip(deaf, read_all, strict=True):
            assert 0 < drained(there) < reader.bytes - 1_000_000


def test_a_page_that_died_is_started_again_at_its_address_and_close_ends_it_for_good(shared):
    page, url = shared.page, shared.url
    first, folder = page_here(), Path(present(page._folder))
    assert first is not None and folder.exists()
    os.kill(first, signal.SIGKILL)
    words = wait_for(page.notice, "the notice")
    assert words.startswith("the page has stopped") and "started again" in words
    page.check()  # has no effect
    assert wait_for(page.url, "the page") == url  # the same port and token
    assert not folder.exists() and Path(present(page._folder)).stat().st_mode & 0o077 == 0
    assert page_here() not in (None, first) and page.started == 2
    assert wait_for(page.notice, "the second notice") == f"the page is there again, at {url}"
    shared.asked.clear()
    with Visitor(url).open("/api/v1/socket"):
        wait_for(lambda: "hello" in [asked["do"] for asked in shared.asked], "what it asks")

    # One that is frozen takes no messages, delays nobody, and is ended by close, too.
    os.kill(present(page_here()), signal.SIGSTOP)
    send = partial(page.send, bytes(100_000))
    sender = threading.Thread(target=lambda: [send() for _ in range(50)], daemon=True)
    sender.start()
    sender.join(PATIENCE_S)
    assert not sender.is_alive() and not send()
    page.close()
    assert page_here() is None
    page.close()
    assert page.url() is None


# --- pages of their own


@pytest.mark.parametrize("beats", [True, False])
def test_a_page_that_hangs_is_ended_and_one_that_beats_is_not(beats):
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    killed: list[bool] = []
    now_s = [100.0]
    page = PageProcess("127.0.0.1", 8080)
    process = SimpleNamespace(
        pid=os.getpid(), returncode=None, kill=lambda: killed.append(True), wait=lambda _: 0
    )
    page._process, page._clock = (
        cast(Any, process),
        cast(Any, SimpleNamespace(now_s=lambda: now_s[0])),
    )
    page.join(ours)
    try:
        theirs.send(URL + b"http://127.0.0.1:8080/?token=x")
        wait_for(page.url, "the address")
        for second in range(1, 9):
            for _ in range(10):
                now_s[0] += 0.1
                page.check()
            if second != 5:  # the first look counts a little more
                assert bool(killed) == (not beats and second > 5)
            if beats:
                theirs.send(BEAT)
                wait_for(lambda: page._silent_s == 0.0, "the beat")
        now_s[0] += 3600.0  # this machine slept: the page's activity is unknown
        killed.clear()
        page._silent_s = 0.0
        page.check()
        assert not killed
    finally:
        page.close()
        theirs.close()


def own_a_page(port: int) -> None:
    """Open a page, fork, and print both processes."""
    page = PageProcess("127.0.0.1", port)
    page.open()
    while page.url() is None:
        time.sleep(0.02)
    child = os.fork()
    if child != 0:
        print(page_here(child), child, flush=True)
    time.sleep(60.0)


def test_a_page_without_its_address_says_why_and_is_not_started_again():
    page = PageProcess("192.0.2.1", 8080)
    page.open()
    try:
        words = wait_for(page.notice, "the notice")
    finally:
        page.close()
    assert words.startswith("the page has stopped (cannot open 192.0.2.1 port 8080: ")
    assert words.endswith("; the rig runs on, start it again to see the page")


def test_page_ends_when_the_parent_is_killed():
    """Even if a fork of it goes on, which holds its sockets."""
    work = partial(own_a_page, free_port())
    with Branch(work, stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        page, sibling = map(int, parent.stdout.readline().split())
        parent.kill()
        try:
            wait_for(lambda: not child_processes.command(page), "the end of the page")
        finally:
            os.kill(sibling, signal.SIGKILL)
