"""The socket of a running rig: who may open it, whose it is, and what becomes of it."""

import contextlib
import os
import shutil
import stat
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from branch import Branch
from remote_rig import (
    Beat,
    Broken,
    SecondTuning,
    hung_up,
    server_closed,
)

from gazerig.drivers.errors import SetupError
from gazerig.robot.model import stop_latch
from gazerig.robot.model.clock import RealClock
from gazerig.robot.remote import socket_io as remote_socket
from gazerig.robot.remote.client import (
    ConnectionLost,
    NoRobotError,
    RobotClient,
    running,
)
from gazerig.robot.remote.request_handler import Pulse, RequestHandler
from gazerig.robot.remote.socket_server import RemoteServer

pytestmark = pytest.mark.usefixtures("ideal_servos")


@pytest.fixture
def folder(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder for sockets of this test alone; pytest's own are too long for a socket."""
    place = tempfile.mkdtemp(prefix="gz-", dir="/tmp")
    monkeypatch.setenv("XDG_RUNTIME_DIR", place)
    yield Path(place) / "gazerig"
    shutil.rmtree(place)


@pytest.fixture(scope="module")
def beat() -> Iterator[Beat]:
    with pytest.MonkeyPatch.context() as patch, Beat() as running_robot:
        patch.setattr(stop_latch, "MIN_HOLD_S", 0.0)
        patch.setattr(stop_latch, "MIN_RESUME_GAP_S", 0.0)
        yield running_robot


@pytest.fixture
def errors() -> list[str]:
    return []


@pytest.fixture
def rig(folder: Path, beat: Beat, errors: list[str]) -> Iterator[RobotClient]:
    tuning = SecondTuning(beat.robot.command)  # type: ignore[arg-type]
    about = {"rig": "desk", "pid": os.getpid()}
    requests = RequestHandler(beat.robot, tuning, beat.pulse, about, (Broken,))
    server = RemoteServer(requests, errors.append)
    server.open()
    with RobotClient.connect() as connected:
        yield connected
    if not server_closed(server):
        server.close()


# The socket


def test_the_socket_is_the_owners_alone(rig: RobotClient, folder: Path) -> None:
    path = folder / f"{os.getpid()}.sock"
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert [p.name for p in folder.iterdir()] == [path.name]


def open_server() -> RemoteServer:
    beat_less = RequestHandler(None, None, Pulse(RealClock()), {"rig": "other"})  # type: ignore[arg-type]
    return RemoteServer(beat_less, lambda _: None)


def test_close_removes_it_and_hangs_up(folder: Path) -> None:
    server = open_server()
    path = server.open()
    with remote_socket.dial(path, 1.0) as end:
        server.close()
        assert hung_up(end)
    assert not path.exists() and running() == []
    server.close()  # twice is no error
    names = [thread.name for thread in threading.enumerate()]
    assert "remote control" not in names


def test_a_folder_open_to_others_is_refused_by_both_sides(folder: Path) -> None:
    folder.mkdir(mode=0o700)
    folder.chmod(0o777)
    with pytest.raises(SetupError, match="not a folder of yours alone"):
        open_server().open()
    remote_socket.listen(folder / "1.sock").close()
    assert running() == []


def test_a_link_in_place_of_the_folder_is_refused(folder: Path, tmp_path: Path) -> None:
    tmp_path.chmod(0o700)
    folder.symlink_to(tmp_path)
    with pytest.raises(SetupError, match="not a folder of yours alone"):
        open_server().open()


def test_a_folder_of_somebody_else_is_refused(folder: Path) -> None:
    folder.mkdir(mode=0o700)
    assert remote_socket.is_private(folder, os.getuid())
    assert not remote_socket.is_private(folder, os.getuid() + 1)


INTRUDES = """
import os, socket, sys
os.setgroups([])
os.setuid(65534)
try:
    socket.socket(socket.AF_UNIX).connect(sys.argv[1])
except PermissionError:
    print("kept out")
"""


@pytest.mark.skipif(os.getuid() != 0, reason="only root can play another user")
def test_another_user_is_kept_out(folder: Path) -> None:
    folder.parent.chmod(0o755)
    server = open_server()
    path = server.open()

    def said() -> str:
        words = [sys.executable, "-S", "-c", INTRUDES, str(path)]
        return subprocess.run(words, capture_output=True, text=True).stdout

    assert said() == "kept out\n"
    folder.chmod(0o755)
    assert said() == "kept out\n"  # by the socket itself
    path.chmod(0o666)
    assert said() == ""  # so the two were what kept it out
    server.close()


def test_a_path_too_long_for_a_socket_is_refused_in_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    long = tmp_path / ("x" * 100)
    long.mkdir()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(long))
    with pytest.raises(SetupError, match="too long for a socket; set XDG_RUNTIME_DIR"):
        open_server().open()


def test_without_a_runtime_folder_it_is_one_of_the_user_in_tmp(tmp_path: Path) -> None:
    assert remote_socket.folder({"XDG_RUNTIME_DIR": str(tmp_path)}, os.getuid()) == (
        tmp_path / "gazerig"
    )
    for environ in ({}, {"XDG_RUNTIME_DIR": "/nonexistent"}, {"XDG_RUNTIME_DIR": str(tmp_path)}):
        assert remote_socket.folder(environ, 4_000_000) == Path("/tmp/gazerig-4000000")


def listens() -> None:
    """Have a socket until standard input ends."""
    pulse = Pulse(RealClock())
    server = RemoteServer(RequestHandler(None, None, pulse, {"rig": "other"}), print)  # type: ignore[arg-type]
    server.open()
    print("open", flush=True)
    sys.stdin.read()
    server.close()


@contextlib.contextmanager
def listening() -> Iterator[subprocess.Popen[str]]:
    """Another process with a socket."""
    process = Branch(listens, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None and process.stdout.readline() == "open\n"
        yield process
    finally:
        process.kill()
        process.communicate()


def test_a_killed_rig_leaves_a_socket_that_is_no_rig_and_that_the_next_removes(
    folder: Path,
) -> None:
    with listening() as killed:
        pass
    dead = folder / f"{killed.pid}.sock"
    assert dead.exists() and running() == []
    with pytest.raises(NoRobotError, match="no rig is running: start one with gazerig run"):
        RobotClient.connect()
    server = open_server()
    path = server.open()
    assert not dead.exists() and path.exists()
    server.close()


def test_a_living_neighbour_keeps_its_socket(folder: Path) -> None:
    with listening() as neighbour:
        server = open_server()
        server.open()
        assert set(remote_socket.sockets(folder).values()) == {neighbour.pid, os.getpid()}
        server.close()
        assert set(remote_socket.sockets(folder).values()) == {neighbour.pid}


def test_a_new_rig_takes_over_the_socket_of_a_dead_one_with_its_number(folder: Path) -> None:
    folder.mkdir(mode=0o700)
    remote_socket.listen(folder / f"{os.getpid()}.sock").close()  # dead
    server = open_server()
    server.open()
    (found,) = running()
    found.close()
    server.close()


def test_several_rigs_are_named_and_chosen_by_process(folder: Path, rig: RobotClient) -> None:
    with listening() as other:
        with pytest.raises(NoRobotError) as which:
            RobotClient.connect()
        assert f"{os.getpid()} (desk)" in str(which.value) and str(other.pid) in str(which.value)
        assert "\n" not in str(which.value)
        with RobotClient.connect(os.getpid()) as mine:
            assert mine.pid == os.getpid()
        with pytest.raises(NoRobotError, match=f"no rig runs as process 1: .*{other.pid}"):
            RobotClient.connect(1)


def test_a_rig_that_ends_while_asked_is_gone_in_words(folder: Path) -> None:
    with listening() as other:
        rig = RobotClient.connect()
        other.kill()
        other.wait()
        with pytest.raises(ConnectionLost, match=f"process {other.pid}\\) has ended or hung up"):
            rig.get()
        rig.close()


def test_a_rig_that_does_not_answer_is_told_so_and_not_asked_again(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gazerig.robot.remote.client._ANSWER_S", 0.1)
    folder.mkdir(mode=0o700)
    with remote_socket.listen(folder / "77.sock"), RobotClient.connect() as rig:
        for _ in range(2):
            with pytest.raises(ConnectionLost, match="does not answer|has ended or hung up"):
                rig.get()
