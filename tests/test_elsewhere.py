"""Where a system lacks what POSIX and Linux have, the emulated head runs all the same.

tests/elsewhere/sitecustomize.py hides it from gazerig's modules, in every process beneath.
"""

import json
import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from gazerig.drivers.errors import PortError
from gazerig.drivers.serial import port as serial_port
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


@pytest.mark.parametrize("rig", ["desk", "six_hobby"])
def test_an_emulated_head_runs_in_real_time(rig: str, tmp_path: Path) -> None:
    words = ("run", rig, "--mock", "--no-page", "--seconds", "1", "--summary", "-")
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
    assert socket_io.sockets(tmp_path) == {file: 7}
    with socket_io.dial(file, 1.0) as caller, listener.accept() as end:
        assert listener.admitted(end) is not None
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
        assert listener.admitted(end) is None


def test_the_file_of_a_killed_rig_is_removed(listener: socket_io.Listener, tmp_path: Path) -> None:
    assert socket_io.clear_dead(tmp_path) == ()
    listener.close()
    assert socket_io.clear_dead(tmp_path) == (7,)
    assert not list(tmp_path.glob("*.sock"))


def test_a_real_port_says_what_it_needs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(serial_port, "termios", None)
    with pytest.raises(PortError, match="COM3: real servos need Linux; here there is --mock"):
        serial_port.BlockingPort("COM3").setBaudRate(57600)
