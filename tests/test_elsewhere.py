"""The emulated head runs on systems without the functions of POSIX and Linux.

tests/elsewhere/sitecustomize.py hides it from gazerig's modules, in every process beneath.
"""

import json
import os
import re
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from shown_page import free_port

from gazerig.drivers.errors import PortError
from gazerig.drivers.process import message_link
from gazerig.drivers.process.message_link import MessageLink
from gazerig.drivers.serial import port as serial_port
from gazerig.drivers.types import Detections
from gazerig.robot.dashboard.door import viser_server
from gazerig.robot.dashboard.feed.live_feed import LiveFeed, frame_with_pixels
from gazerig.robot.remote import socket_io

HIDING = Path(__file__).parent / "elsewhere"
_MAIN = "from gazerig.robot.cli.entry_point import main; main()"


def elsewhere(*words: str, folder: Path) -> subprocess.Popen[str]:
    """Start a command in a process for which POSIX is hidden, and all processes beneath it."""
    path = os.pathsep.join((str(HIDING), os.environ.get("PYTHONPATH", "")))
    return subprocess.Popen(
        [sys.executable, "-c", _MAIN, *words],
        env={**os.environ, "PYTHONPATH": path, "XDG_RUNTIME_DIR": str(folder)},
        cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def test_the_hiding_hides_and_only_from_us(tmp_path: Path) -> None:
    code = (
        "import os, select, socket, signal, sys, termios, resource\n"
        "assert not hasattr(socket, 'AF_UNIX') and not hasattr(os, 'fork')\n"
        "try: exec('import termios', {'__name__': 'gazerig.x'}); sys.exit(1)\n"
        "except ModuleNotFoundError: pass\n"
        "try: exec('import select; select.select([0], [], [], 0)', {'__name__': 'gazerig.x'})\n"
        "except OSError: sys.exit(0)\n"
        "sys.exit(2)\n"
    )
    environ = {**os.environ, "PYTHONPATH": str(HIDING)}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environ, stdin=subprocess.PIPE, check=False
    )
    assert done.returncode == 0


def test_an_emulated_head_runs_in_real_time(tmp_path: Path) -> None:
    words = (
        "run",
        "six_hobby",
        "--mock",
        "--no-page",
        "--rate=40",
        "--seconds",
        "1",
        "--summary",
        "-",
    )
    out, said = elsewhere(*words, folder=tmp_path).communicate()
    assert '"stopped_by"' in out, said
    figures = json.loads(out)
    assert figures["stopped_by"] == "seconds" and figures["ticks"] > 0
    assert "unexpected" not in said and "Traceback" not in said, said


# ---- the remote control, over a port of the loopback


@pytest.fixture
def listener(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[socket_io.Listener]:
    monkeypatch.setattr(socket_io, "HAS_SOCKET_FILES", False)
    with socket_io.listen(tmp_path / "7.sock") as found:
        yield found


def test_who_can_read_the_file_may_call(listener: socket_io.Listener, tmp_path: Path) -> None:
    file = tmp_path / "7.sock"
    assert file.stat().st_mode & 0o077 == 0
    assert socket_io.find_sockets(tmp_path) == {file: 7}
    with socket_io.connect_to_socket(file, 1.0) as caller, listener.accept() as end:
        assert listener.identify(end) is not None
        caller.sendall(b"hello")
        assert end.recv(5) == b"hello"


@pytest.mark.parametrize("shown", [b"", b"0" * 32, b"short"])
def test_who_cannot_show_the_token_is_not_admitted(
    shown: bytes, listener: socket_io.Listener, tmp_path: Path
) -> None:
    port, _, token = (tmp_path / "7.sock").read_text("ascii").partition(" ")
    assert len(token) == 32
    with socket.create_connection(("127.0.0.1", int(port))) as caller, listener.accept() as end:
        caller.sendall(shown)
        caller.shutdown(socket.SHUT_WR)
        assert listener.identify(end) is None


def test_the_file_of_a_killed_rig_is_removed(listener: socket_io.Listener, tmp_path: Path) -> None:
    assert socket_io.remove_dead_sockets(tmp_path) == ()
    listener.close()
    assert socket_io.remove_dead_sockets(tmp_path) == (7,)
    assert not list(tmp_path.glob("*.sock"))


def test_a_real_port_says_what_it_needs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(serial_port, "termios", None)
    with pytest.raises(PortError, match="COM3: real servos need Linux; use --mock here"):
        serial_port.BlockingPort("COM3").setBaudRate(57600)


# ---- the page


def told(process: subprocess.Popen[str], pattern: str) -> re.Match[str]:
    """Wait for a line on standard error."""
    assert process.stderr is not None
    lines: list[str] = []
    while line := process.stderr.readline():
        lines.append(line)
        if found := re.search(pattern, line):
            return found
    raise AssertionError(f"{pattern} was not said: {''.join(lines)}")


def test_the_page_shows_an_emulated_head_and_stops_it(tmp_path: Path) -> None:
    words = ("run", "--mock", "--rate=40", "--seconds", "60", "--page", f"127.0.0.1:{free_port()}")
    running = elsewhere(*words, folder=tmp_path)
    try:
        address = told(running, r"the page is at http://([\d.:]+)/;")[1]
        rigs, _ = elsewhere("ctl", "rigs", "--json", folder=tmp_path).communicate()
        url = json.loads(rigs)[0]["page"]
        assert url.startswith(f"http://{address}/?token=")
        asking = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
        assert b"<title>gazerig" in asking.open(url, timeout=20).read()
        assert b"viser" in asking.open(f"http://{address}/view/", timeout=20).read().lower()
        stop = urllib.request.Request(
            f"http://{address}/rig/ask",
            data=json.dumps({"do": "stop", "why": "a test"}).encode(),
            headers={"Origin": f"http://{address}", "Content-Type": "application/json"},
        )
        asking.open(stop, timeout=20).read()
        told(running, "a test")
    finally:
        running.terminate()
        running.communicate()
    assert running.returncode == 0


@pytest.fixture
def links(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[MessageLink, MessageLink]]:
    """Both ends of a link over the loopback, as parent and child have them."""
    monkeypatch.setattr(message_link, "HAS_PAIRS", False)
    offered = message_link.create_links(1)
    [ours], [word] = offered.parent_ends, offered.arguments
    ours.setblocking(False)
    theirs = message_link.open_link(word, offered.variables[message_link.TOKEN_VARIABLE])
    yield ours, theirs
    ours.close()
    theirs.close()


def arrived(link: MessageLink) -> bytes:
    """Return the next message of a link that does not wait."""
    while True:
        message_link.wait_readable(link)
        try:
            return link.recv(1)  # of any length
        except BlockingIOError:
            continue


def test_messages_stay_whole_and_in_order(links: tuple[MessageLink, MessageLink]) -> None:
    ours, theirs = links
    large = os.urandom(900_000)
    for message in (b"a", large, b"bc"):
        ours.send(message)  # the first before the other end was let in
    with pytest.raises(BlockingIOError):
        while True:
            ours.recv(1)
    assert [theirs.recv(1) for _ in range(3)] == [b"a", large, b"bc"]
    with pytest.raises(BlockingIOError):
        theirs.recv(1, message_link.DONT_WAIT)
    theirs.send(b"back")
    theirs.send(large)
    assert (arrived(ours), arrived(ours)) == (b"back", large)


def test_the_end_is_told_at_either_end(links: tuple[MessageLink, MessageLink]) -> None:
    ours, theirs = links
    theirs.send(b"last")
    assert arrived(ours) == b"last"
    ours.close()
    assert theirs.recv(1) == b""
    with pytest.raises(OSError):
        ours.send(b"x")


def test_a_link_that_is_not_read_refuses_and_never_waits(
    links: tuple[MessageLink, MessageLink],
) -> None:
    ours, _ = links
    with pytest.raises(BlockingIOError):
        for _ in range(100):
            ours.send(bytes(1 << 20))


def test_a_stranger_is_not_let_in_and_keeps_nobody_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(message_link, "HAS_PAIRS", False)
    offered = message_link.create_links(1)
    [ours], [word] = offered.parent_ends, offered.arguments
    with socket.create_connection(("127.0.0.1", int(word[5:]))) as stranger:
        stranger.sendall(b"0" * 32)
        child = message_link.open_link(word, offered.variables[message_link.TOKEN_VARIABLE])
        child.send(b"it is me")
        assert ours.recv(1) == b"it is me"
        assert stranger.recv(1) == b""
    child.close()
    ours.close()


def test_a_view_on_a_port_answers_only_who_shows_the_key(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(viser_server, "HAS_SOCKET_FILES", False)
    server, inside = viser_server.open_server(tmp_path / "page.sock")
    try:
        assert inside.path is None and len(inside.key) == 32
        with pytest.raises(urllib.error.HTTPError, match="403"):
            urllib.request.urlopen(f"http://127.0.0.1:{inside.port}/")
        shown = urllib.request.Request(
            f"http://127.0.0.1:{inside.port}/", headers={viser_server.KEY_HEADER: inside.key}
        )
        assert urllib.request.urlopen(shown).status == 200
    finally:
        server.stop()


def test_a_frame_goes_along_with_its_pixels_where_memory_cannot() -> None:
    image = np.arange(24, dtype=np.uint8).reshape(2, 4, 3)
    found = Detections(1.0, 7, 4, 2, (), image=image)
    feed = LiveFeed()
    assert feed.handle_message(frame_with_pixels(found, image, depth=False, wants_depth=False))
    shown = feed._found
    assert shown is not None and shown.image is not None
    assert np.array_equal(shown.image, image)
