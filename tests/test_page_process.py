"""The page's process: it delays no one, ends with its parent and finds a free port."""

import json
import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast
from urllib.parse import urlsplit

import child_processes
import pytest
import shown_page
from page_visitor import LOOKING, PATIENCE_S, Visitor, unpacked
from present import present
from shown_page import AHEAD, free_port, running_page, wait_for

from gazerig.robot.dashboard.feed.page_process import URL, PageProcess, encode_snapshot
from gazerig.robot.dashboard.page_main import free_port as first_free_port
from gazerig.robot.dashboard.page_main import show_until_closed
from gazerig.robot.dashboard.requests.inbox import BEAT
from gazerig.robot.dashboard.requests.outbox import Outbox
from gazerig.robot.dashboard.view.viewpoints import BOTH, NAMES, named_view
from gazerig.robot.dashboard.widgets.widgets import PANELS
from gazerig.robot.model.types import SeenFace

REPOSITORY = Path(__file__).parents[1]

SNAPSHOT = replace(
    shown_page.SNAPSHOT,
    faces=(SeenFace(3, (0.9, 0.1, 0.25), AHEAD, ((0.9, 0.1, 0.25), (0.9, 0.15, 0.3)) * 4),),
)


@pytest.fixture(scope="module")
def shared() -> Iterator[tuple[PageProcess, str, int]]:
    """A page that found its port busy, its address, and that port; one test closes it."""
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        busy = other.getsockname()[1]
        with running_page(busy) as (page, url):
            yield page, url, busy


def page_here() -> int | None:
    """The process of the page that this one has started, alive or stopped."""
    found = list(child_processes.running())
    assert len(found) < 2, found
    return found[0] if found else None


def page_process(parent: int) -> int | None:
    """The process of the page that another one has started, alive or stopped."""
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        try:
            words = (entry / "cmdline").read_bytes().split(b"\0")
            state = (entry / "stat").read_text().rpartition(")")[2].split()[0]
        except OSError:  # it has ended meanwhile
            continue
        if b"gazerig.robot.dashboard.page_main" in words and state != "Z":
            _fd, _stop_fd, its_parent, *_ = words[
                words.index(b"gazerig.robot.dashboard.page_main") + 1 :
            ]
            if int(its_parent) == parent:
                return int(entry.name)
    return None


def in_time(work: Callable[[], None]) -> bool:
    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join(PATIENCE_S)
    return not thread.is_alive()


def test_sending_side_needs_no_viewer_and_no_opencv() -> None:
    check = (
        "import gazerig.robot.dashboard.feed.page_process, sys;"
        "sys.exit(bool({'viser', 'cv2'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", check]).returncode == 0


def test_unopened_page_drops() -> None:
    page = PageProcess("127.0.0.1", 8080)
    page.show(SNAPSHOT)
    page.show_frame(b"jpeg")
    assert (page.dropped, page.frames_dropped, page.url(), page.notice()) == (1, 1, None, None)
    page.close()


def test_more_than_the_page_can_show_is_passed_over() -> None:
    page = PageProcess("127.0.0.1", 8080)
    for tick in range(200):
        page.show(replace(SNAPSHOT, t_s=5.0 + 0.005 * tick))
    assert page.dropped == 100  # every second one was offered, and dropped as nothing is open
    page.show(replace(SNAPSHOT, t_s=0.0))  # the clock was started again
    assert page.dropped == 101


# A page for the four that follow.


def test_busy_port_moves_on_and_says_so(shared: tuple[PageProcess, str, int]) -> None:
    page, url, busy = shared
    port = urlsplit(url).port
    assert port is not None and port > busy
    assert page.notice() == f"port {busy} is busy, using {port}"
    assert b"<html" in Visitor(url).get().lower()


def test_page_is_on_the_loopback_alone_and_ignores_ctrl_c(
    shared: tuple[PageProcess, str, int],
) -> None:
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


def test_a_view_chosen_before_the_scene_has_loaded_is_taken(
    shared: tuple[PageProcess, str, int],
) -> None:
    visitor = Visitor(shared[1])
    position_m, look_at_m, *_ = named_view(BOTH)
    with visitor.open("/rig/panels") as panels:
        panels.send(json.dumps({"seen": list(PANELS)}))
        told: list[tuple[int, dict[str, object]]] = []
        while not (found := [n for n, props in told if props.get("options") == list(NAMES)]):
            message = panels.recv(timeout=PATIENCE_S)
            told = json.loads(message).get("put", []) if isinstance(message, str) else []
        panels.send(json.dumps({"set": [found[0], BOTH]}))
        # Messages of one browser are taken in their order: this one has an answer.
        panels.send(json.dumps({"set": [found[0], "from the moon"]}))
        while "from above" not in str(panels.recv(timeout=PATIENCE_S)):
            pass
    with visitor.open("/view") as scene:
        scene.send(LOOKING)
        sent: dict[str, object] = {}
        while len(sent) < 2:
            for one in unpacked(scene.recv(timeout=PATIENCE_S, decode=False))["messages"]:
                if one["type"].startswith("SetCamera") and not one.get("initial"):
                    sent |= {w: one[w] for w in ("position", "look_at") if w in one}
    assert sent == {"position": pytest.approx(position_m), "look_at": pytest.approx(look_at_m)}


def test_close_ends_even_a_frozen_page(shared: tuple[PageProcess, str, int]) -> None:
    page = shared[0]
    process = page_here()
    assert process is not None
    os.kill(process, signal.SIGSTOP)
    page.close()
    assert page_here() is None
    page.close()
    assert page.url() is None


# Pages of their own


def test_a_page_that_died_is_started_again_at_its_address_and_told_all() -> None:
    with running_page() as (page, url):
        page.offer({"lids": ("wink", "blink")})
        first, folder = page_here(), present(page._folder).path
        assert first is not None and folder.exists()
        os.kill(first, signal.SIGKILL)
        words = wait_for(page.notice, "the notice")
        assert words.startswith("the page has stopped") and "started again" in words
        page.show(SNAPSHOT)  # has no effect
        assert wait_for(page.url, "the page") == url  # the same port and token
        assert not folder.exists() and present(page._folder).path.stat().st_mode & 0o077 == 0
        assert page_here() not in (None, first) and page.started == 2
        assert wait_for(page.notice, "the second notice") == f"the page is there again, at {url}"
        with Visitor(url).open("/rig/panels") as talk:
            while '"blink"' not in str(talk.recv(timeout=PATIENCE_S)):
                pass
        # Once more: no more words about it.
        second = page_here()
        assert second is not None
        os.kill(second, signal.SIGKILL)
        wait_for(lambda: page.started == 3, "the third page")
        assert page.notice() is None


def test_a_suspended_page_holds_up_nobody_and_is_replaced() -> None:
    def show_many() -> None:
        for tick in range(3000):
            page.show(replace(SNAPSHOT, t_s=0.01 * tick))

    with running_page() as (page, url):
        process = page_here()
        assert process is not None
        os.kill(process, signal.SIGSTOP)
        assert in_time(show_many)
        assert 2000 < page.dropped <= 3000
        in_time(lambda: page.show_frame(bytes(100_000)))

        def replaced() -> bool:
            page.show(SNAPSHOT)
            return page.started == 2

        wait_for(replaced, "another page")
        assert page.url() == url and page_here() not in (None, process)


@pytest.mark.parametrize("beats", [True, False])
def test_a_page_that_hangs_is_ended_and_one_that_beats_is_not(beats: bool) -> None:
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
                page.show(SNAPSHOT)
            if second != 5:  # the first look counts a little more
                assert bool(killed) == (not beats and second > 5)
            if beats:
                theirs.send(BEAT)
                wait_for(lambda: page._silent_s == 0.0, "the beat")
        now_s[0] += 3600.0  # this machine slept: the page's activity is unknown
        killed.clear()
        page._silent_s = 0.0
        page.show(SNAPSHOT)
        assert not killed
    finally:
        page.close()
        theirs.close()


@pytest.mark.parametrize("stuck", ["drawing", "door", ""])
def test_a_page_beats_while_it_draws_and_serves_browsers(stuck: str) -> None:
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    drawn, let_go, draws = threading.Event(), threading.Event(), [0]

    def show(_news: object) -> None:
        draws[0] += 1
        drawn.set()
        if stuck == "drawing":
            let_go.wait()

    view = SimpleNamespace(
        choices={}, emulated=None, watched=lambda: False, silent=lambda: None, show=show
    )
    # A door whose thread is stuck accepts tasks and never does them.
    door = SimpleNamespace(
        is_open=lambda: True, call_soon=lambda do: None if stuck == "door" else do()
    )
    served = SimpleNamespace(door=door, pointer=SimpleNamespace(), outbox=Outbox(cast(Any, theirs)))
    run = threading.Thread(
        target=show_until_closed, args=(theirs, view, os.getppid(), served), daemon=True
    )
    ours.send(encode_snapshot(SNAPSHOT))
    run.start()
    try:
        assert drawn.wait(PATIENCE_S)
        ours.setblocking(False)
        heard = 0
        # The first beat is of the round before; a page that is stuck has no second one.
        while heard < 2 and draws[0] < 20:
            try:
                heard += ours.recv(10) == BEAT
            except BlockingIOError:
                if stuck == "drawing":
                    break
                ours.send(encode_snapshot(SNAPSHOT))
                let_go.wait(0.02)
        assert heard == {"drawing": 1, "door": 0, "": 2}[stuck]
    finally:
        ours.close()
        let_go.set()
        run.join(PATIENCE_S)
        theirs.close()


def test_a_stop_passes_a_page_that_cannot_be_told_anything_else() -> None:
    heard: list[object] = []
    slow = threading.Event()

    def hear(asked: dict[str, object]) -> str | None:
        if asked.get("do") == "stop":
            heard.append(asked["why"])
        else:
            slow.wait(PATIENCE_S)  # the request takes for ever
        return None

    page = PageProcess("127.0.0.1", free_port(), hear)
    page.open()
    try:
        visitor = Visitor(wait_for(page.url, "the page's address"))
        answers = [visitor.ask({"do": "resume", "pad": "x" * 1500}) for _ in range(60)]
        assert 429 in answers  # and no more than the rig accepts
        assert visitor.ask({"do": "stop", "why": "a test"}) == 204 and len(heard) == 1
    finally:
        slow.set()
        page.close()


def test_snapshot_that_cannot_be_drawn_ends_the_page_in_words() -> None:
    with running_page() as (page, _):
        page.show(replace(SNAPSHOT, level="mad"))  # type: ignore[arg-type]
        assert "KeyError: 'mad'" in wait_for(page.notice, "the notice")


PARENT = """
import os, sys, time
from gazerig.robot.dashboard.feed.page_process import PageProcess
page = PageProcess("127.0.0.1", int(sys.argv[1]))
page.open()
while page.url() is None:
    time.sleep(0.02)
child = os.fork() if sys.argv[2] == "forks" else -1
if child == 0:
    time.sleep(60.0)
print(child, flush=True)
time.sleep(60.0)
"""


@pytest.mark.parametrize("habit", ["alone", "forks"])
def test_page_ends_when_the_parent_is_killed(habit: str) -> None:
    command = [sys.executable, "-c", PARENT, str(free_port()), habit]
    with subprocess.Popen(command, cwd=REPOSITORY, stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        sibling = int(parent.stdout.readline())
        assert page_process(parent.pid) is not None
        parent.kill()
        try:
            wait_for(lambda: page_process(parent.pid) is None, "the end of the page")
        finally:
            if sibling > 0:
                os.kill(sibling, signal.SIGKILL)


def test_address_of_another_machine_is_refused_in_words() -> None:
    page = PageProcess("192.0.2.1", 8080)
    page.open()
    words = wait_for(page.notice, "the notice")
    assert "cannot open 192.0.2.1 port 8080" in words and page.gone
    page.close()


def test_free_port_takes_the_first_free_one() -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        free = other.getsockname()[1]
        other.listen()
        assert first_free_port("127.0.0.1", free) > free
    assert first_free_port("127.0.0.1", free) == free
