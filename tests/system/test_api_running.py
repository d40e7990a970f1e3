"""A head next to its program in real time: however its block ends, it parks and releases."""

import asyncio
import os
import re
import signal
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from branch import Branch, script
from slow_rigs import at_rate

import gazerig
from gazerig.robot.loop.events import TickFeed
from gazerig.robot.loop.loop import Robot, Tick

LET_GO = "(not )?parked, torque off"
"""On a starved machine the time for parking may be over before."""

pytestmark = [
    pytest.mark.usefixtures("ideal_servos", "own_sockets"),
]


@pytest.fixture
def own_sockets(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Have sockets in a folder without rigs of other tests."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))


@pytest.fixture
def said() -> list[str]:
    return []


@pytest.fixture(scope="module")
def rigs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with rigs whose loops are slow."""
    folder = tmp_path_factory.mktemp("rigs")
    for rig in ("desk", "feetech"):
        at_rate(folder, rig, 40.0)
    return folder


Open = Callable[..., gazerig.Head]


@pytest.fixture
def opened(said: list[str], rigs: Path) -> Open:
    """Return what opens a head, the desk rig if no other is named."""

    def head(rig: str = "desk") -> gazerig.Head:
        file = rigs / f"{rig}.yaml"
        rig = str(file) if file.exists() else rig
        return gazerig.open(rig, mock=True, scene="face-to-face", say=said.append)

    return head


@pytest.fixture
def head(opened: Open) -> Iterator[gazerig.Head]:
    with opened() as head:
        yield head


def assert_let_go(said: list[str], why: str = "the program") -> None:
    """See that it parked, its torque is off, and no thread of it is left."""
    assert re.fullmatch(f"stopped by {why}: {LET_GO}", said[-1])
    assert not [t for t in threading.enumerate() if t.name.startswith("head ")]


def test_the_end_of_the_block(said: list[str], opened: Open):
    numbers = signal.SIGINT, signal.SIGTERM, signal.SIGHUP
    handlers = [signal.getsignal(n) for n in numbers]
    switching_s = sys.getswitchinterval()
    with opened() as head:
        assert not {signal.getsignal(n) for n in numbers} & {*handlers}
        assert head.look_at(1.0, 0.4, 0.3).wait(100.0) == "arrived"
        assert head.look_at(-1.0, 0.1, 0.3).wait(100.0) == "out of reach"
    assert_let_go(said)
    assert [signal.getsignal(n) for n in numbers] == handlers
    assert sys.getswitchinterval() == pytest.approx(switching_s)


def test_handlers_of_the_program_stay(said: list[str], opened: Open):
    def handle(number: int, frame: object) -> None:
        said.append(signal.Signals(number).name)

    before = signal.signal(signal.SIGTERM, handle)
    try:
        with opened() as head:
            signal.raise_signal(signal.SIGTERM)
            assert head.look_at(1.0, 0.4, 0.3).wait(100.0) == "arrived"
        assert signal.getsignal(signal.SIGTERM) is handle and "SIGTERM" in said
    finally:
        signal.signal(signal.SIGTERM, before)
    assert_let_go(said)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_request_to_end_parks_and_ends_the_program(
    said: list[str], opened: Open, number: signal.Signals
):
    with pytest.raises(SystemExit) as caught, opened():
        signal.raise_signal(number)
    assert caught.value.code == 128 + number
    assert_let_go(said, number.name)


def test_a_fork_leaves_the_head_to_its_parent(said: list[str], opened: Open):
    with opened() as head:
        pid = os.fork()
        if pid == 0:
            code = 1
            try:
                head.__exit__(None, None, None)
                code = 0 if signal.getsignal(signal.SIGTERM) == signal.SIG_DFL else 2
            finally:
                os._exit(code)
        assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 0
        assert head.look_at(1.0, 0.4, 0.3).wait(100.0) == "arrived"
    assert_let_go(said)


@pytest.mark.parametrize("error", [ZeroDivisionError, KeyboardInterrupt])
def test_an_error_in_the_block(said: list[str], opened: Open, error: type[BaseException]):
    with pytest.raises(error), opened():
        raise error
    assert_let_go(said)


def test_the_death_of_the_thread_that_opened_it(said: list[str], opened: Open):
    kept: list[gazerig.Head] = []

    def forget() -> None:
        kept.append(opened().__enter__())  # and no end of it

    thread = threading.Thread(target=forget)
    thread.start()
    thread.join()
    for running in [t for t in threading.enumerate() if t.name.startswith("head ")]:
        running.join(30.0)
    assert_let_go(said, "the end of the thread that opened it")
    with pytest.raises(gazerig.HeadEnded, match="the end of the thread"):
        kept[0].look_at(1.0, 0.0, 0.3)


def test_an_error_of_the_loop_reaches_the_program(
    said: list[str], opened: Open, monkeypatch: pytest.MonkeyPatch
):
    tick, failed = Robot.tick, threading.Event()

    def failing(self: Robot, *values: Any) -> Tick:
        if failed.is_set():
            raise RuntimeError("a bug")
        return tick(self, *values)

    monkeypatch.setattr(Robot, "tick", failing)
    with pytest.raises(gazerig.HeadEnded, match="a bug") as caught, opened() as head:
        order = head.look_at(-1.0, 0.0, 0.3)
        failed.set()
        order.wait(100.0)
    assert isinstance(caught.value, gazerig.Error)
    assert re.fullmatch(f"stopped by fault: unexpected RuntimeError: a bug: {LET_GO}", said[-1])


def test_a_start_that_fails_raises_what_failed(said: list[str], opened: Open):
    with pytest.raises(gazerig.ConfigError, match="did you mean"), opened("dusk"):
        pass
    with (
        pytest.raises(gazerig.SetupError, match="nowhere"),
        gazerig.open("desk", port="/dev/nowhere", say=said.append),
    ):
        pass
    assert not [t for t in threading.enumerate() if t.name.startswith("head ")]


def test_another_program_has_the_same_orders(head: gazerig.Head):
    mine = head.look_at(1.0, 0.4, 0.3)
    mine.wait(100.0)
    with gazerig.connect(os.getpid(), who="a show") as far:
        order = far.look_at(1.0, -0.4, 0.3)
        assert order.wait(100.0) == "arrived"
        assert mine.outcome == "arrived" and not mine.active
        assert head.state.controlled_by.startswith("a show (process ")
        assert far.look_at_person(99).wait(100.0) == "refused"
        assert far.look_at_person(far.people[0].id).wait(100.0) == "arrived"
        assert far.look_at(-1.0, 0.1, 0.3).wait(100.0) == "out of reach"
        with pytest.raises(gazerig.Refused, match="0 to 180 deg"):
            far.set({"gaze.head.eye_only_range_deg": 1e9})
        assert far.set({"gaze.head.eye_only_range_deg": 11.0}) and far.get(
            "gaze.head.eye_only_range_deg"
        )
        assert far.menus() == head.menus()
        texts = [event.text for event in far.events(timeout_s=0.0)]
        assert any("controlled by the program" in text for text in texts)
        far.stop("a hand")
        assert head.state.stopped == "a hand"
        assert far.play("nod").wait(100.0) == "refused" and far.resume().refused
        head.sleep(2.1)
        assert not far.resume().refused


def test_a_state_after_an_awaited_reply_is_as_new(opened: Open, monkeypatch: pytest.MonkeyPatch):
    usual = TickFeed.update

    def update_late(feed: TickFeed, tick: Tick) -> None:
        time.sleep(0.005)
        usual(feed, tick)

    monkeypatch.setattr(TickFeed, "update", update_late)

    async def orders() -> list[tuple[int, int, str]]:
        seen = []
        async with gazerig.aio.connect(os.getpid()) as far:
            for k in range(30):
                reply = await far.look_at(1.0, 0.01 * k, 0.3).reply()
                state = await far.state()
                seen.append((reply.control_number, state.client_control.number, state.stopped))
            await far.stop("a hand").reply()
            seen.append((1, 1, (await far.state()).stopped))
        return seen

    with opened():
        *moves, stop = asyncio.run(orders())
    assert [there for _, there, _ in moves] == [number for number, _, _ in moves]
    assert moves[0][0] > 0 and stop[2] == "a hand"


def run_script(
    file: Path, *arguments: str, fresh: bool = False
) -> subprocess.CompletedProcess[str]:
    """Run a program of its own, which finds the helpers of the tests."""
    pipe = subprocess.PIPE
    if fresh:
        tests = str(Path(__file__).parents[2] / "tests" / "helpers")
        path = os.pathsep.join(filter(None, (os.environ.get("PYTHONPATH"), tests)))
        return subprocess.run(
            [sys.executable, str(file), *arguments], env={**os.environ, "PYTHONPATH": path},
            stdout=pipe, stderr=pipe, text=True, timeout=120, check=False,
        )  # fmt: skip
    with Branch(script(file, *arguments), stdout=pipe, stderr=pipe, text=True) as process:
        out, err = process.communicate(timeout=120)
    return subprocess.CompletedProcess(process.args, process.returncode, out, err)


FORGETFUL = """
import signal, sys, threading
import gazerig
from ideal_bus import ideal_buses
with ideal_buses():
    head = gazerig.open("desk", mock=True, say=lambda line: print(line, flush=True)).__enter__()
    {end}
"""


@pytest.mark.parametrize(
    ("end", "status", "why"),
    [
        ("head.look_at(1.0, 0.2, 0.3).wait(100.0)", 0, "the end of the program"),
        ("raise SystemExit(3)", 3, "the end of the program"),
        ("signal.raise_signal(signal.SIGINT)", 1, "the end of the program"),
    ],
)
def test_the_end_of_the_interpreter(tmp_path: Path, end: str, status: int, why: str):
    """Nobody left the block: it parks even so, before the program is gone."""
    file = tmp_path / "forgetful.py"
    file.write_text(textwrap.dedent(FORGETFUL).format(end=end))
    done = run_script(file, fresh="SystemExit" in end)  # Python itself ends once
    last = done.stdout.splitlines()[-1]
    assert re.fullmatch(f"stopped by {why}: {LET_GO}", last), done.stderr
    assert done.returncode in (status, -signal.SIGINT if status == 1 else status)
