"""The page's process: it delays no one, ends with its parent and finds a free port."""

import os
import signal
import socket
import subprocess
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast
from urllib.parse import urlsplit

import child_processes
import pytest
from branch import Branch
from page_visitor import Visitor
from present import present
from shown_page import free_port, running_page, wait_for

from gazerig.robot.dashboard.feed.page_process import BEAT, URL, PageProcess


@pytest.fixture(scope="module")
def shared() -> Iterator[tuple[PageProcess, str, int]]:
    """A page that found its port busy, its address, and that port; one test closes it."""
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        busy = other.getsockname()[1]
        with running_page(busy) as (page, url):
            yield page, url, busy


def page_here(*others: int) -> int | None:
    """The process of the page that this one has started, alive or stopped."""
    found = [pid for pid in child_processes.running() if pid not in others]
    assert len(found) < 2, found
    return found[0] if found else None


# A page for the three that follow.


def test_busy_port_moves_on_and_says_so(shared: tuple[PageProcess, str, int]):
    page, url, busy = shared
    port = urlsplit(url).port
    assert port is not None and port > busy
    assert page.notice() == f"port {busy} is busy, using {port}"
    assert b"<html" in Visitor(url).get().lower()


def test_page_is_on_the_loopback_alone_and_ignores_ctrl_c(
    shared: tuple[PageProcess, str, int],
):
    page, url, _ = shared
    page.notice()
    port = urlsplit(url).port
    # The whole of 127.0.0.0/8 is this machine: a page on every address would answer here.
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.2", port))
    process = page_here()
    assert process is not None
    os.kill(process, signal.SIGINT)
    assert Visitor(url).get()
    assert page.notice() is None
    assert page_here() == process


def test_close_ends_even_a_frozen_page(shared: tuple[PageProcess, str, int]):
    page = shared[0]
    process = page_here()
    assert process is not None
    os.kill(process, signal.SIGSTOP)
    page.close()
    assert page_here() is None
    page.close()
    assert page.url() is None


# Pages of their own


def test_a_page_that_died_is_started_again_at_its_address_and_told_all():
    ends: list[socket.socket] = []
    with running_page(serve=ends.append) as (page, url):
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
        with Visitor(url).open("/api/v1/socket"):
            assert b'"do":"hello"' in ends[2].recv(1 << 16)  # the new one of two for each page


@pytest.mark.parametrize("beats", [True, False])
def test_a_page_that_hangs_is_ended_and_one_that_beats_is_not(beats: bool):
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
