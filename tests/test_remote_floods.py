"""Rubbish, several programs at once, who leads, and floods: a running rig goes on."""

import contextlib
import json
import os
import re
import shutil
import socket
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from remote_rig import (
    BLINKS,
    RATE,
    Beat,
    Broken,
    SecondTuning,
    hung_up,
    server_closed,
)

from gazerig.robot.model import lead, stop_latch
from gazerig.robot.model.commands import Tune
from gazerig.robot.remote import client
from gazerig.robot.remote import socket_io as remote_socket
from gazerig.robot.remote import socket_server as server_module
from gazerig.robot.remote.client import (
    RequestRejected,
    RobotClient,
)
from gazerig.robot.remote.request_handler import RequestHandler
from gazerig.robot.remote.socket_io import REQUEST_BYTES
from gazerig.robot.remote.socket_server import Budget, RemoteServer, RequestRate

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


def raw(folder: Path) -> socket.socket:
    return remote_socket.dial(folder / f"{os.getpid()}.sock", 5.0)


def line_of(end: socket.socket) -> dict[str, Any]:
    with end.makefile("rb") as file:
        answer: dict[str, Any] = json.loads(file.readline())
    return answer


# Rubbish


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (b"hello\n", "not a line of JSON"),
        (b"\n", "not a line of JSON"),
        (b'{"do": "get", "prefix": NaN}\n', "not a number"),
        (b"\xff\xfe\n", "not a line of JSON"),
        (b"[" * 20_000 + b"\n", "nested too deep|not a line of JSON"),
        (b"[]\n", "not understood"),
        (b'{"do": "dance"}\n', "there is status; "),
        (b'{"do": "get"}\n', "not understood"),
        (b'{"do": "get", "prefix": 1}\n', "not understood"),
        (b'{"do": "get", "prefix": "", "more": 1}\n', "not understood"),
        (b'{"do": "set", "changes": [["a", 1]]}\n', "not understood"),
        (b'{"do": "save", "path": "my.yaml"}\n', "absolute path"),
        (b'{"do": "fly"}\n', "not understood; .*; ask; look_at"),
        (b'{"do": []}\n', "not understood"),
        (b'{"do": "tune", "changes": [["a", 1]]}\n', "request set"),
    ],
)
def test_rubbish_is_refused_in_words_and_the_next_request_is_heard(
    rig: RobotClient, folder: Path, line: bytes, words: str
) -> None:
    with raw(folder) as end:
        end.sendall(line)
        answer = line_of(end)
        (said,) = answer.values()
        assert re.search(words, said), said
        end.sendall(b'{"do": "characters"}\n')
        assert line_of(end) == {"ok": ["bold", "shy"]}


def test_a_huge_request_is_refused_and_hung_up_on(rig: RobotClient, folder: Path) -> None:
    with raw(folder) as end:
        with contextlib.suppress(ConnectionError):
            end.sendall(b"x" * (REQUEST_BYTES + 70_000))
        assert "longer than" in line_of(end)["refused"]
        assert hung_up(end)


def test_an_endless_request_is_refused_and_hung_up_on(
    rig: RobotClient, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gazerig.robot.remote.socket_server._REST_S", 0.2)
    with raw(folder) as end:
        end.sendall(b'{"do": "characters"}\n')
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


def test_two_requests_in_one_piece_get_two_answers(rig: RobotClient, folder: Path) -> None:
    with raw(folder) as end:
        end.sendall(b'{"do": "characters"}\n{"do": "get", "prefix": "loop"}\n')
        with end.makefile("rb") as file:
            assert json.loads(file.readline()) == {"ok": ["bold", "shy"]}
            assert json.loads(file.readline()) == {"ok": {RATE: 200.0}}


def test_who_reads_no_answers_is_hung_up_on_and_delays_nobody(
    rig: RobotClient, folder: Path, beat: Beat, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gazerig.robot.remote.socket_server._TAKES_S", 0.2)
    with raw(folder) as end:
        ticks = len(beat.ticks)
        with contextlib.suppress(OSError):
            for _ in range(20_000):
                end.sendall(b'{"do": "dance"}\n')
        rig.set(RATE, 120.0)
        assert len(beat.ticks) > ticks


# Several at once


def test_two_programs_at_once(rig: RobotClient, beat: Beat) -> None:
    refused: list[str] = []

    def work(value: float) -> None:
        with RobotClient.connect() as mine:
            for step in range(20):
                mine.set(BLINKS, value + step)
                if not mine.get(BLINKS):
                    refused.append("lost")

    before = len(beat.ticks)
    threads = [threading.Thread(target=work, args=(value,)) for value in (100.0, 500.0)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not refused
    orders = [order for tick in beat.ticks[before:] for order in tick.commands]
    given = sorted(
        float(str(change[1]))
        for order in orders
        if isinstance(order, Tune)
        for change in order.changes
    )
    assert given == [*(100.0 + n for n in range(20)), *(500.0 + n for n in range(20))]


def test_one_who_holds_a_half_request_does_not_hold_up_another(
    rig: RobotClient, folder: Path
) -> None:
    with raw(folder) as end:
        end.sendall(b'{"do": ')
        rig.stop("the other one is slow")
        assert rig.status()["stopped"]
        rig.resume()
        end.sendall(b'"characters"}\n')
        assert "ok" in line_of(end)


def test_who_was_quiet_longest_makes_room(rig: RobotClient, folder: Path) -> None:
    """Whoever comes to stop the head is let in, however many programs hang around."""
    with contextlib.ExitStack() as stack:
        ends = [stack.enter_context(raw(folder)) for _ in range(15)]
        ends[-1].sendall(b'{"do": "characters"}\n')
        assert "ok" in line_of(ends[-1])  # all are in by now
        rig.get(RATE)  # and this one was heard last
        with RobotClient.connect() as stopper:
            stopper.stop("many around")
            stopper.resume()
        assert hung_up(ends[0])
        assert rig.get(RATE) == {RATE: 200.0}
        ends[1].sendall(b'{"do": "characters"}\n')
        assert "ok" in line_of(ends[1])


# Leads of programs, and floods


@pytest.mark.slow
def test_a_program_leads_while_it_lives_and_is_named(
    rig: RobotClient, beat: Beat, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lead, "HEARTBEAT_S", 2.0)  # simulated: time goes faster here
    monkeypatch.setattr(client, "_EVERY_S", 0.05)
    with RobotClient.connect(who="a show") as show:
        reply = show.look_at(-1.0, 0.0, 0.3)
        assert 60.0 < reply.error_deg < 90.0 and "neck_yaw stays at" in reply.text()
        assert show.leads
        status = rig.status()
        assert status["led"] == f"a show (process {os.getpid()}): look at -1 0 0.3"
        count = len(beat.ticks)
        assert beat.pulse.taken_up(20.0, ticks=800)  # twice as long
        assert show.leads and beat.ticks[-1].led and len(beat.ticks) > count
    assert beat.pulse.taken_up(20.0, ticks=500)
    assert beat.ticks[-1].led == "" and rig.status()["led"] == ""


def test_nobody_passes_himself_off_as_another(rig: RobotClient, folder: Path) -> None:
    with raw(folder) as end:
        stop = {"do": "stop", "why": "x", "who": "the page"}
        end.sendall(json.dumps(stop).encode() + b"\n")
        assert "ok" in line_of(end)
    said = rig.status()["said"]
    assert any(f"stopped by the page (process {os.getpid()})" in words for words in said)
    with pytest.raises(RequestRejected, match="another may only resume who confirms"):
        rig.resume()
    rig.resume(confirmed=True)


def test_programs_of_other_users_are_hung_up_on(
    rig: RobotClient, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stranger = remote_socket.Peer(1, os.getuid() + 1)
    rig.get(RATE)  # let in
    with monkeypatch.context() as patch:
        patch.setattr(remote_socket, "peer", lambda end: stranger)
        with raw(folder) as end:
            assert hung_up(end)
    assert rig.get(RATE) == {RATE: 200.0}


def test_processor_time_is_shared_out() -> None:
    budget = Budget(RequestRate(0.1, 0.5), 100.0)
    budget.spend(0.5, 100.0)
    assert budget.wait_s(100.0) == 0.0
    budget.spend(0.2, 100.0)
    assert budget.wait_s(100.0) == pytest.approx(2.0)
    assert budget.wait_s(101.0) == pytest.approx(1.0)
    assert budget.wait_s(200.0) == 0.0
    budget.spend(0.6, 200.0)  # never more than the burst was saved
    assert budget.wait_s(200.0) == pytest.approx(1.0)


def test_who_takes_too_much_waits_and_is_refused_but_a_stop_goes_through(
    rig: RobotClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig.get(RATE)  # let in with the usual rate
    monkeypatch.setattr(server_module, "EACH", RequestRate(1e-6, 0.0))
    with RobotClient.connect() as greedy:
        greedy.get()
        with pytest.raises(RequestRejected, match="too many requests: ask again in"):
            greedy.get()
        greedy.stop("all the same")
    assert rig.status()["stopped"] == "all the same"
    rig.resume(confirmed=True)
