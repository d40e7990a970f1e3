"""The socket of a running rig: who may open it, whose it is, and what becomes of it."""

import contextlib
import json
import os
import re
import shutil
import socket
import stat
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from branch import Branch
from fakes.runs import simulated

from gazerig.drivers.errors import SetupError
from gazerig.robot.loop import body
from gazerig.robot.loop.events import TickFeed
from gazerig.robot.loop.loop import Robot, Tick
from gazerig.robot.model.commands import Get, ReadMenus, Request, Resume, Stop
from gazerig.robot.net import client
from gazerig.robot.net import socket_io as remote_socket
from gazerig.robot.net import socket_server as server_module
from gazerig.robot.net.client import (
    ConnectionLost,
    NoRobotError,
    RequestRejected,
    RobotClient,
    connect_to_all,
)
from gazerig.robot.net.socket_server import RemoteServer
from gazerig.robot.run.live import ParamStore
from gazerig.robot.run.requests import RequestHandler

pytestmark = pytest.mark.usefixtures("ideal_servos")


RATE = "loop.rate_hz"


class Beat:
    """A simulated robot whose loop runs in a thread, slowly enough to leave the processor."""

    def __init__(self) -> None:
        self.made = made = simulated(bus="ideal")
        self.robot: Robot = made.robot
        self.clock = made.clock
        self.pulse = TickFeed()
        self.ticks: list[Tick] = []
        self.hold = threading.Event()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> "Beat":
        self.robot.start(self.clock)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()
        self.robot.stop()

    def _run(self) -> None:
        slot = 0
        while not self._over.wait(0.002):
            if self.hold.is_set():
                continue
            slot += 1
            self.clock.sleep_until(slot * 0.005)
            self.robot.tick(slot * 0.005, 0.005, self._watch)

    def _watch(self, tick: Tick) -> None:
        self.ticks.append(tick)
        self.pulse.update(tick)


def hung_up(end: socket.socket) -> bool:
    end.settimeout(5.0)
    with contextlib.suppress(ConnectionError):
        return end.recv(100) == b""
    return True


@pytest.fixture
def folder(monkeypatch) -> Iterator[Path]:
    """A folder for sockets of this test alone; pytest's own are too long for a socket."""
    place = tempfile.mkdtemp(prefix="gz-", dir="/tmp")
    monkeypatch.setenv("XDG_RUNTIME_DIR", place)
    yield Path(place) / "gazerig"
    shutil.rmtree(place)


@pytest.fixture(scope="module")
def beat() -> Iterator[Beat]:
    with pytest.MonkeyPatch.context() as patch, Beat() as running_robot:
        patch.setattr(body, "MIN_HOLD_S", 0.0)
        patch.setattr(body, "MIN_RESUME_GAP_S", 0.0)
        yield running_robot


@pytest.fixture
def errors() -> list[str]:
    return []


@pytest.fixture
def rig(folder: Path, beat: Beat, errors: list[str]) -> Iterator[RobotClient]:
    about = {"rig": "desk", "pid": os.getpid()}
    beat.made.__dict__.pop("params", None)  # values that another test has set
    server = RemoteServer(RequestHandler(beat.made, beat.pulse, about).answer, errors.append)
    server.open()
    with RobotClient.connect() as connected:
        yield connected
    server.close()


# The socket


def test_the_socket_is_the_owners_alone(rig, folder):
    path = folder / f"{os.getpid()}.sock"
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert [p.name for p in folder.iterdir()] == [path.name]


def open_server() -> RemoteServer:
    return RemoteServer(beatless().answer, lambda _: None)


def beatless() -> RequestHandler:
    robot = SimpleNamespace(command=lambda command: None)
    run: Any = SimpleNamespace(robot=robot, params=SimpleNamespace(unsaved=tuple))
    return RequestHandler(run, TickFeed(), {"rig": "other"})


def test_close_removes_it_and_hangs_up(folder):
    server = open_server()
    path = server.open()
    with remote_socket.connect_to_socket(path, 1.0) as end:
        server.close()
        assert hung_up(end)
    assert not path.exists() and connect_to_all() == []
    server.close()  # twice is no error
    names = [thread.name for thread in threading.enumerate()]
    assert "remote control" not in names


def test_a_folder_open_to_others_is_refused_by_both_sides(folder):
    folder.mkdir(mode=0o700)
    folder.chmod(0o777)
    with pytest.raises(SetupError, match="not a private folder of yours"):
        open_server().open()
    remote_socket.listen(folder / "1.sock").close()
    assert connect_to_all() == []


def test_a_folder_of_somebody_else_is_refused(folder):
    folder.mkdir(mode=0o700)
    assert remote_socket.is_private(folder, os.getuid())
    assert not remote_socket.is_private(folder, os.getuid() + 1)


def listens() -> None:
    """Have a socket until standard input ends."""
    server = RemoteServer(beatless().answer, print)
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


def test_a_killed_rig_leaves_a_socket_that_is_no_rig_and_that_the_next_removes(folder):
    with listening() as killed:
        pass
    dead = folder / f"{killed.pid}.sock"
    assert dead.exists() and connect_to_all() == []
    with pytest.raises(NoRobotError, match="no rig is running: start one with gazerig run"):
        RobotClient.connect()
    server = open_server()
    path = server.open()
    assert not dead.exists() and path.exists()
    server.close()


# Other programs steer a running rig: requests are executed, rubbish has no effect


# Requests


@pytest.mark.parametrize("value", [float("nan"), float("inf"), object(), b"1"])
def test_what_has_no_json_is_refused_before_it_is_sent(rig, value):
    with pytest.raises(RequestRejected, match="finite numbers"):
        rig.set_many({RATE: value})
    assert rig.get(RATE) == {RATE: 200.0}


# A loop that hangs, a resume that fails


def test_a_loop_that_hangs_is_told_to_who_stops(folder, beat, errors, rig):
    beat.hold.set()
    try:
        with pytest.raises(RequestRejected, match="emergency stop"):
            rig.send(Stop("test"))
    finally:
        beat.hold.clear()
    assert beat.pulse.wait_for_ticks(2, 20.0)
    rig.send(Resume())


def test_an_error_of_the_program_is_told_to_both_sides_and_the_rest_goes_on(
    rig, errors, monkeypatch
):
    with monkeypatch.context() as patch, pytest.raises(ConnectionLost, match="AttributeError"):
        patch.delattr(ParamStore, "get")
        rig.get(RATE)
    assert "AttributeError" in errors[0]
    assert rig.get(RATE) == {RATE: 200.0}


# Rubbish, several programs at once, control, and floods: a running rig continues


def raw(folder: Path) -> socket.socket:
    return remote_socket.connect_to_socket(folder / f"{os.getpid()}.sock", 5.0)


def line_of(end: socket.socket) -> dict[str, Any]:
    with end.makefile("rb") as file:
        answer: dict[str, Any] = json.loads(file.readline())
    return answer


# Rubbish


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (b"hello\n", "not a line of JSON"),
        (b'{"do": "get", "prefix": NaN}\n', "not a line of JSON"),
        (b"\xff\xfe\n", "not a line of JSON"),
        (b"[" * 20_000 + b"\n", "nested too deep|not a line of JSON"),
        (b'{"do": "dance"}\n', "no request 'dance'; available: hello, status, "),
        (b'{"do": "save", "path": "my.yaml"}\n', "absolute path"),
        (b'{"do": "tune", "changes": [["a", 1]]}\n', "request set, which checks it"),
    ],
)
def test_rubbish_is_refused_in_words_and_the_next_request_is_heard(rig, folder, line, words):
    with raw(folder) as end:
        end.sendall(line)
        answer = line_of(end)
        (said,) = answer.values()
        assert re.search(words, said), said
        end.sendall(b'{"do": "menus"}\n')
        assert line_of(end) == {"ok": rig.ask(ReadMenus(), dict[str, list[str]])}


def test_an_endless_request_is_refused_and_hung_up_on(rig, folder, monkeypatch):
    monkeypatch.setattr("gazerig.robot.net.socket_server._REST_S", 0.2)
    with raw(folder) as end:
        end.sendall(b'{"do": "menus"}\n')
        assert "ok" in line_of(end)
        over = threading.Event()

        def dribble() -> None:
            with contextlib.suppress(OSError):
                while not over.wait(0.01):
                    end.sendall(b"x")

        # The next line is waited for without end, and must then come within its time.
        dribbler = threading.Thread(target=dribble)
        dribbler.start()
        answer = line_of(end)
        over.set()
        dribbler.join()
        assert "no end of the line" in answer["refused"]


def test_who_reads_no_answers_is_hung_up_on_and_delays_nobody(rig, folder, beat, monkeypatch):
    monkeypatch.setattr("gazerig.robot.net.socket_server._TAKES_S", 0.2)
    with raw(folder) as end:
        ticks = len(beat.ticks)
        with contextlib.suppress(OSError):
            for _ in range(20_000):
                end.sendall(b'{"do": "dance"}\n')
        rig.set_many({RATE: 120.0})
        assert len(beat.ticks) > ticks


# Several at once


# Leads of programs, and floods


def test_nobody_passes_himself_off_as_another(rig, folder):
    with raw(folder) as end:
        stop = {"do": "stop", "why": "x", "who": "the page"}
        end.sendall(json.dumps(stop).encode() + b"\n")
        assert "ok" in line_of(end)
    said = rig.status()["said"]
    assert any(f"stopped by the page (process {os.getpid()})" in words for words in said)
    with pytest.raises(RequestRejected, match="another client must confirm"):
        rig.send(Resume())
    rig.send(Resume(confirmed=True))


def test_programs_of_other_users_are_hung_up_on(rig, folder, monkeypatch):
    rig.get(RATE)  # let in
    own = os.getuid()
    with monkeypatch.context() as patch:
        patch.setattr(os, "getuid", lambda: own + 1)
        with raw(folder) as end:
            assert hung_up(end)
    assert rig.get(RATE) == {RATE: 200.0}


def test_who_takes_too_much_waits_and_is_refused_but_a_stop_goes_through(rig, monkeypatch):
    rig.get(RATE)  # let in with the usual rate
    monkeypatch.setattr(server_module, "EACH", (1e-6, 0.0))
    with RobotClient.connect() as greedy:  # its greeting takes all
        with pytest.raises(RequestRejected, match="too many requests: try again in"):
            greedy.get()
        greedy.send(Stop("all the same"))
    assert rig.status()["stopped"] == "all the same"
    rig.send(Resume(confirmed=True))


LEVEL = b'{"do": "set_level", "level": "mouth", "value": 0.5}\n'
STOP = b'{"do": "stop", "why": "at last"}\n'


def lines_until(end: socket.socket, right: Callable[[dict[str, Any]], bool]) -> list[Any]:
    end.settimeout(20.0)
    found: list[Any] = []
    with end.makefile("rb") as file:
        while not found or not right(found[-1]):
            found.append(json.loads(file.readline()))
    return found


def test_a_stop_does_not_wait_for_what_its_program_has_sent_before(rig, folder, beat):
    """A resume before the stop does not follow it, and all is answered in its order."""
    with raw(folder) as end:
        ticks, count = len(beat.ticks), 2000
        sender = threading.Thread(
            target=end.sendall, args=(count * LEVEL + b'{"do": "resume", "tag": "r"}\n' + STOP,)
        )
        sender.start()
        answers = lines_until(
            end, lambda answer: "notes" in answer.get("ok", ()) and bool(beat.ticks[-1].stopped)
        )
        sender.join()
        stopped = next(k for k, tick in enumerate(beat.ticks[ticks:]) if tick.stopped)
        assert stopped < count / 2  # each of the messages before would take a tick
    assert rig.status()["stopped"] == "at last"
    assert any("64 wait for their answers" in answer.get("refused", "") for answer in answers)
    rig.send(Resume(confirmed=True))


def test_a_resume_from_before_a_stop_is_not_executed_after_it(rig, folder, beat):
    rig.send(Stop("a hand"))
    with raw(folder) as end:
        resume = b'{"do": "resume", "confirmed": true, "tag": "r"}\n'
        end.sendall(20 * LEVEL + resume + STOP + b'{"do": "menus"}\n')
        answers = lines_until(end, lambda answer: "character" in answer.get("ok", ()))
    assert len(answers) == 23 and answers[20] == {
        "refused": "it has been stopped meanwhile", "tag": "r",
    }  # fmt: skip
    assert rig.status()["stopped"] == "at last"
    rig.send(Resume(confirmed=True))


def test_who_sends_far_too_much_is_hung_up_on_after_his_stop(rig, folder, monkeypatch):
    monkeypatch.setattr(server_module, "REST_S", 1.5)
    with raw(folder) as end:
        over = threading.Event()

        def flood() -> None:
            while not over.wait(0.002):
                end.sendall(20 * LEVEL)
            end.sendall(STOP)

        sender = threading.Thread(target=flood)
        sender.start()
        closes = "more than 200 refused in 1 s; this connection closes"
        answers = lines_until(end, lambda answer: answer.get("refused", "").endswith(closes))
        assert {"refused": "too many requests: 64 wait for their answers"} in answers
        over.set()
        sender.join()
        with contextlib.suppress(ConnectionError):
            while end.recv(1 << 16):
                pass
    assert rig.status()["stopped"] == "at last"
    rig.send(Resume(confirmed=True))


@pytest.mark.parametrize("stop", [STOP, b'{"do": "st\\u006fp", "why": "at last"}\n'])
def test_the_last_message_before_the_end_of_a_burst_may_be_a_stop(rig, folder, stop):
    with raw(folder) as end:
        end.sendall(3000 * LEVEL + stop)
    stop_s = time.monotonic() + 20.0
    while not (stopped := rig.status()["stopped"]):
        assert time.monotonic() < stop_s
    assert stopped == "at last"
    rig.send(Resume(confirmed=True))


def test_a_client_of_another_version_is_told_so_once_and_may_stop(rig, folder, monkeypatch):
    with raw(folder) as end:
        wire = remote_socket.Wire(end, remote_socket.ANSWER_BYTES)
        wire.write({"do": "hello", "version": 1, "tag": "a"}, 5.0)
        greeting = {"version": 1, "rig": "desk", "pid": os.getpid()}
        assert wire.read(5.0, 5.0) == {"ok": greeting, "tag": "a"}
        for version in (2, "1", None):
            wire.write({"do": "hello", "version": version}, 5.0)
            answer = wire.read(5.0, 5.0)
            assert isinstance(answer, dict) and "version" in answer["refused"]
    with monkeypatch.context() as patch, RobotClient.connect() as newer:
        patch.setattr(client, "VERSION", 2)
        with pytest.raises(RequestRejected, match="version 2 of the messages: this rig has 1"):
            newer.status()
        newer.send(Stop("all the same"))
    assert rig.status()["stopped"] == "all the same"
    rig.send(Resume(confirmed=True))


def test_a_stop_does_not_wait_for_another_thread_of_its_program(rig, monkeypatch):
    """Like that of a head that is speaking: the answer to say comes when it begins."""
    perform, asked, over = RequestHandler.perform, threading.Event(), threading.Event()

    def slow(self: RequestHandler, request: Request) -> object:
        if isinstance(request, Get):
            asked.set()
            over.wait(20.0)
        return perform(self, request)

    monkeypatch.setattr(RequestHandler, "perform", slow)
    other = threading.Thread(target=rig.get)
    other.start()
    assert asked.wait(20.0)
    rig.send(Stop("meanwhile"))
    assert other.is_alive()
    over.set()
    other.join()
    assert rig.status()["stopped"] == "meanwhile"
    rig.send(Resume())  # it is the same client
