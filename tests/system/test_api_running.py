"""A head next to its program in real time: however its block ends, it parks and releases."""

import asyncio
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import pytest
from attack.ways_out import bench
from branch import Branch, script
from slow_rigs import at_rate

import gazerig
from gazerig.robot.loop import body
from gazerig.robot.loop.events import TickFeed
from gazerig.robot.loop.loop import Robot, Tick

LET_GO = "(not )?parked, torque off"
"""On a starved machine the time for parking may be over before."""


@pytest.fixture(autouse=True)
def own_sockets(tmp_path, monkeypatch) -> None:
    """Have sockets in a folder without rigs of other tests."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))


@pytest.fixture
def said() -> list[str]:
    return []


Open = Callable[[], gazerig.Head]


@pytest.fixture
def opened(said: list[str], tmp_path) -> Open:
    """Return what opens a head with a slow loop."""
    rig = at_rate(tmp_path, "desk", 40.0)
    return partial(gazerig.open, rig, mock=True, bus="ideal", scene="face-to-face", say=said.append)


def assert_let_go(said: list[str], why: str = "the program") -> None:
    """See that it parked, its torque is off, and no thread of it is left."""
    assert re.fullmatch(f"stopped by {why}: {LET_GO}", said[-1])
    assert not [t for t in threading.enumerate() if t.name.startswith("head ")]


def test_a_block_leaves_the_program_its_handlers_and_forks_leave_it_the_head(said):
    def handle(number: int, frame: object) -> None:
        said.append(signal.Signals(number).name)

    before = signal.signal(signal.SIGTERM, handle)
    numbers = signal.SIGINT, signal.SIGHUP
    handlers = [signal.getsignal(n) for n in numbers]
    switching_s = sys.getswitchinterval()
    try:
        with (
            bench("desk", 40.0) as at,
            gazerig.open(at.file, port=at.port, scene="face-to-face", say=said.append) as head,
        ):
            assert not {signal.getsignal(n) for n in numbers} & {*handlers}
            signal.raise_signal(signal.SIGTERM)
            pid = os.fork()
            if pid == 0:
                code = 1
                try:
                    head.__exit__(None, None, None)
                    code = 0 if signal.getsignal(signal.SIGHUP) == signal.SIG_DFL else 2
                finally:
                    os._exit(code)
            assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 0
            assert head.look_at(1.0, 0.4, 0.3).wait(100.0) == "arrived"
            assert at.on() == len(at.rig.joints)
        assert signal.getsignal(signal.SIGTERM) is handle and "SIGTERM" in said
    finally:
        signal.signal(signal.SIGTERM, before)
    assert_let_go(said)
    assert [signal.getsignal(n) for n in numbers] == handlers
    assert sys.getswitchinterval() == pytest.approx(switching_s)


def test_the_death_of_the_thread_that_opened_it(said, opened):
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


def test_an_error_of_the_loop_or_of_the_start_reaches_the_program(said, opened, monkeypatch):
    with (
        pytest.raises(gazerig.SetupError, match="nowhere"),
        gazerig.open("desk", port="/dev/nowhere", say=said.append),
    ):
        pass
    assert not [t for t in threading.enumerate() if t.name.startswith("head ")]
    tick, failed = Robot.tick, threading.Event()

    def failing(self: Robot, *values: Any) -> Tick:
        if failed.is_set():
            raise RuntimeError("a bug")
        return tick(self, *values)

    monkeypatch.setattr(Robot, "tick", failing)
    with pytest.raises(gazerig.HeadEnded, match="a bug") as caught, opened() as head:
        order = head.look_at(-1.0, 0.0, 0.3)
        failed.set()
        with pytest.raises(gazerig.HeadEnded, match="a bug"):
            order.wait(100.0)
    assert isinstance(caught.value, gazerig.Error)
    assert_let_go(said, "fault: unexpected RuntimeError: a bug")


def test_another_program_has_the_same_orders_and_states(opened, monkeypatch):
    for name in ("MIN_HOLD_S", "MIN_RESUME_GAP_S"):
        monkeypatch.setattr(body, name, 0.2)
    with opened() as head:
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
            assert far.set({"gaze.head.eye_only_range_deg": 11.0})
            assert far.get("gaze.head.eye_only_range_deg") == {"gaze.head.eye_only_range_deg": 11.0}
            assert far.menus() == head.menus()
            texts = [event.text for event in far.events(timeout_s=0.0)]
            assert any("controlled by the program" in text for text in texts)
            *moves, stop = asyncio.run(orders(monkeypatch))
            assert [shown for _, shown, _ in moves] == [number for number, _, _ in moves]
            assert moves[0][0] > 0 and stop[2] == "a hand" == head.state.stopped
            assert far.play("nod").wait(100.0) == "refused" and far.resume().refused
            head.sleep(0.3)
            assert not far.resume().refused


async def orders(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, int, str]]:
    """Give orders while the states of the head come late; return what state follows each."""
    usual = TickFeed.update

    def update_late(feed: TickFeed, tick: Tick) -> None:
        time.sleep(0.005)
        usual(feed, tick)

    monkeypatch.setattr(TickFeed, "update", update_late)
    seen = []
    async with gazerig.aio.connect(os.getpid(), who="a show") as far:
        for k in range(15):
            reply = await far.look_at(1.0, 0.01 * k, 0.3).reply()
            state = await far.state()
            seen.append((reply.control_number, state.client_control.number, state.stopped))
        await far.stop("a hand").reply()
        seen.append((1, 1, (await far.state()).stopped))
    return seen


FORGETFUL = """
import signal, sys
import gazerig
head = gazerig.open("desk", mock=True, bus=sys.argv[1], say=lambda line: print(line, flush=True))
head.__enter__()
{end}
"""
ENDS = {
    "head.look_at(1.0, 0.2, 0.3).wait(100.0)": (0,),
    "raise SystemExit(3)": (3,),
    "signal.raise_signal(signal.SIGINT)": (1, -signal.SIGINT),
}
"""The exit codes by how a program ends; SystemExit in a Python of its own, which ends only once."""


def test_the_end_of_the_interpreter(tmp_path):
    """Nobody left the block: it parks even so, before the program is gone."""
    pipe, programs = subprocess.PIPE, []
    for number, (end, codes) in enumerate(ENDS.items()):
        file = tmp_path / f"forgetful_{number}.py"
        file.write_text(FORGETFUL.format(end=end))
        if codes == (3,):
            words = [sys.executable, str(file), "emulated"]
            program = subprocess.Popen(words, stdout=pipe, stderr=pipe, text=True)
        else:
            program = Branch(script(file, "ideal"), stdout=pipe, stderr=pipe, text=True)
        programs.append(program)
    for codes, program in zip(ENDS.values(), programs, strict=True):
        out, err = program.communicate(timeout=120)
        why = out.splitlines()[-1]
        assert re.fullmatch(f"stopped by the end of the program: {LET_GO}", why), err
        assert program.returncode in codes
