"""A program's parts of a head may block, fail or end: the loop continues, and parks."""

import io
import json
import logging
import sys
import threading
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fakes.waiting import wait_for
from slow_rigs import at_rate

import gazerig
from gazerig.drivers.bus.checked_bus import CheckedBus
from gazerig.drivers.camera import thread
from gazerig.drivers.camera.guarded_camera import GuardedCamera
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.errors import BusLost, PluginError
from gazerig.drivers.process import bounded_call
from gazerig.drivers.process.bounded_call import (
    OVERDUE_SOURCES,
    BoundedCall,
    OverdueReport,
    overdue_text,
)
from gazerig.drivers.types import Detections, ServoConfig
from gazerig.robot.app import run_bus
from gazerig.robot.control import line_queue
from gazerig.robot.control.line_queue import LineQueue
from gazerig.sim_mock.device import Device
from gazerig.sim_mock.devices import build

LIMIT_S = 60.0


# --- faults of a user's function; each records in ``begun`` that it was called


class Misbehaviour:
    """A function of a user's, and what it does as it is called."""

    def __init__(self, how: str) -> None:
        self.how, self.gate, self.calls = how, threading.Event(), 0

    def __call__(self, *given: object) -> Any:
        self.calls += 1
        match self.how:
            case "blocks":
                self.gate.wait()
            case "sleeps":
                self.gate.wait(10.0)
            case "computes":
                while not self.gate.is_set():
                    pass
            case "exits":
                sys.exit("the user's")
            case "interrupts":
                raise KeyboardInterrupt
            case "ends":
                raise GeneratorExit
            case "prints to a closed stream":
                closed = io.StringIO()
                closed.close()
                print("a line", file=closed)


HOW = (
    "blocks", "sleeps", "computes", "exits", "interrupts", "ends", "prints to a closed stream",
)  # fmt: skip
LASTS = ("blocks", "sleeps", "computes")


@pytest.fixture
def misbehaves() -> Iterator[Callable[[str], Misbehaviour]]:
    """Return what makes a function that misbehaves; all are let go at the end."""
    made: list[Misbehaviour] = []

    def one(how: str) -> Misbehaviour:
        made.append(Misbehaviour(how))
        return made[-1]

    yield one
    for function in made:
        function.gate.set()
    wait_for(lambda: not OVERDUE_SOURCES)


def quiet(line: str) -> None:
    """Say nothing."""


class Parts:
    """A camera, a rule, a source of frames and a detector in one, all of whose methods work."""

    def __init__(self, **replaced: Callable[..., Any]) -> None:
        self.number = 0
        vars(self).update(replaced)

    def open(self) -> None:
        pass

    def latest(self, now_s: float) -> Detections | None:
        return None

    def events(self) -> tuple[str, ...]:
        return ()

    def close(self) -> None:
        pass

    def choose(self, percept: object, state: object, t_s: float) -> None:
        return None


class Frames(Parts):
    """A source of frames."""

    def take(self, now_s: Callable[[], float], stop: threading.Event) -> Shot | None:
        if stop.wait(0.02):
            return None
        self.number += 1
        return Shot(now_s(), self.number, np.zeros((48, 64, 3), np.uint8))


# --- whole heads, on emulated servos in this process that are read afterwards


@pytest.fixture(autouse=True)
def devices(monkeypatch: pytest.MonkeyPatch) -> list[Device]:
    """Return the devices behind the heads of this test."""
    made: list[Device] = []

    def built(*words: Any) -> Device:
        made.append(build(*words))
        return made[-1]

    monkeypatch.setattr(run_bus, "has_terminals", lambda: False)
    monkeypatch.setattr(run_bus, "build", built)
    monkeypatch.setattr(line_queue, "_END_S", 0.1)
    monkeypatch.setattr(thread, "_LONGEST_WAIT_S", 0.1)
    monkeypatch.setattr(GuardedCamera.__init__, "__defaults__", (0.001, 0.1, 20.0))
    return made


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return a rig whose loop is slow."""
    return at_rate(tmp_path_factory.mktemp("rigs"), "desk", 80.0)


@pytest.fixture(autouse=True)
def own_sockets(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Have sockets in a folder without rigs of other tests."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))


def torque(devices: list[Device]) -> list[bool]:
    return [
        bool(servo["torque"])
        for device in devices
        for servo in json.loads(device.faults.command("status"))["servos"]
    ]


def assert_it_runs_and_lets_go(
    opened: gazerig.Head, devices: list[Device], called: Callable[[], object]
) -> list[str]:
    """See that the loop ticks on, orders are answered, the block ends; return the events."""
    assert isinstance(opened, gazerig.local_head.RunningHead)
    with opened as head:
        head.look_at(1.0, 0.0, 0.3)  # there is a message
        wait_for(called)
        ticks = head._feed.ticks
        assert not head.look_at(1.0, 0.1, 0.3).refused
        wait_for(lambda: head._feed.ticks > ticks + 20)
        assert all(torque(devices)) and devices
    assert not any(torque(devices))
    assert not [t for t in threading.enumerate() if t.name.startswith("head ")]
    return [event.text for event in head._events(0)]


@pytest.mark.parametrize("how", HOW)
def test_say_a_camera_and_a_rule(
    rig: str, devices: list[Device], misbehaves: Callable[[str], Misbehaviour], how: str,
    capfd: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    say, latest, choose = misbehaves(how), misbehaves(how), misbehaves(how)
    camera, rule = Parts(latest=latest), Parts(choose=choose)
    head = gazerig.open(rig, mock=True, say=say, camera=camera, attention=rule)
    called = lambda: say.calls and latest.calls and choose.calls  # noqa: E731
    events = assert_it_runs_and_lets_go(head, devices, called)
    assert any("attention Parts of the program" in event for event in events), events
    assert "lines were not delivered: say of the program " in capfd.readouterr().err


@pytest.mark.parametrize("how", ("blocks", "computes", "exits", "interrupts"))
def test_a_source_of_frames(
    rig: str, devices: list[Device], misbehaves: Callable[[str], Misbehaviour], how: str
) -> None:
    take = misbehaves(how)
    head = gazerig.open(rig, mock=True, say=quiet, camera=Frames(take=take))
    events = assert_it_runs_and_lets_go(head, devices, lambda: take.calls)
    if how == "computes":  # and is ended with the head
        wait_for(lambda: not [t for t in threading.enumerate() if t.name == "camera"])
    told = [event for event in events if "camera Frames of the program" in event]
    assert how in LASTS or told, events


@pytest.mark.parametrize("how", ("blocks", "computes", "interrupts"))
def test_a_detector_in_a_drawn_scene(
    rig: str, devices: list[Device], misbehaves: Callable[[str], Misbehaviour], how: str
) -> None:
    find = misbehaves(how)
    detector: Any = Parts(find=find)
    head = gazerig.open(rig, mock=True, scene="visitor", say=quiet, detector=detector)
    if how == "interrupts":  # it ends the camera of the scene, which is no part of the program
        with pytest.raises(gazerig.HeadEnded, match="KeyboardInterrupt"), head:
            wait_for(lambda: head._ended)
        assert not any(torque(devices))
    else:
        assert_it_runs_and_lets_go(head, devices, lambda: find.calls)
    if how == "computes":
        wait_for(lambda: not [t for t in threading.enumerate() if t.name == "camera"])


class Handler(logging.Handler):
    """A handler whose ``emit`` is a user's."""

    def __init__(self, emitted: Callable[..., Any]) -> None:
        super().__init__()
        self.emitted = emitted

    def emit(self, record: logging.LogRecord) -> None:
        self.emitted(record)


@pytest.mark.parametrize("how", ("blocks", "exits"))
def test_a_logging_handler(
    rig: str, devices: list[Device], misbehaves: Callable[[str], Misbehaviour], how: str,
    capfd: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    emitted = misbehaves(how)
    handler, logger = Handler(emitted), logging.getLogger("gazerig")
    level = logger.level
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    try:
        head = gazerig.open(rig, mock=True)
        assert_it_runs_and_lets_go(head, devices, lambda: emitted.calls)
        assert "not delivered: the logger gazerig " in capfd.readouterr().err
    finally:
        logger.removeHandler(handler)
        logger.setLevel(level)


def test_a_say_that_blocks_is_an_event_that_comes_again(
    rig: str, misbehaves: Callable[[str], Misbehaviour], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bounded_call, "FIRST_LINE_S", 0.05)
    with gazerig.open(rig, mock=True, say=misbehaves("blocks")) as head:
        head.look_at(1.0, 0.0, 0.3)

        def told() -> list[str]:
            events = [event.text for event in head._events(0)]
            return [one for one in events if "say of the program has not returned" in one]

        wait_for(lambda: len(told()) > 1)
        assert "lines are waiting" in told()[0] and "say of the program" in overdue_text()


def test_a_camera_that_does_not_open_is_no_start(
    rig: str, devices: list[Device], misbehaves: Callable[[str], Misbehaviour],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setattr(GuardedCamera.__init__, "__defaults__", (0.001, 0.1, 0.1))
    for camera in (Parts(open=misbehaves("blocks")), Frames(open=misbehaves("computes"))):
        with (
            pytest.raises(gazerig.SetupError, match="has not opened within 0.1 s"),
            gazerig.open(rig, mock=True, say=quiet, camera=camera),
        ):
            pass
    assert not any(torque(devices))


def test_a_camera_that_does_not_close_is_left_behind(
    rig: str, devices: list[Device], misbehaves: Callable[[str], Misbehaviour]
) -> None:
    close = misbehaves("blocks")
    head = gazerig.open(rig, mock=True, say=quiet, camera=Parts(close=close))
    assert_it_runs_and_lets_go(head, devices, lambda: True)
    assert close.calls == 1


# --- lines


def test_lines_come_in_order_and_what_is_missing_is_told() -> None:
    gate, got = threading.Event(), list[str]()

    def slow(line: str) -> None:
        gate.wait(LIMIT_S)
        got.append(line)

    with LineQueue(slow, "slow", most=5) as queue:
        for number in range(20):
            queue.line(str(number))
        assert not queue.flush(0.01)
        gate.set()
        assert queue.flush(LIMIT_S)
        queue.line("20")
        assert queue.flush(LIMIT_S)
    kept = [line for line in got if line.isdigit()]
    assert kept == sorted(kept, key=int) and kept[-1] == "20" and len(kept) + queue.dropped == 21
    assert f"{queue.dropped} lines are missing here: slow was too slow" in got


# --- calls that are given up


def test_a_call_that_computes_is_ended_and_no_other_thread_is_hit() -> None:
    before = threading.active_count()
    calls, rounds = [BoundedCall(f"call {k}", 0.001) for k in range(3)], [0, 0, 0]

    def spin(k: int) -> None:
        while True:
            rounds[k] += 1

    for k, call in enumerate(calls):
        assert call(partial(spin, k)) is None
        call.close()
    begun, ended = 0, list[int]()
    while OVERDUE_SOURCES:  # others begin, which may have the numbers of those that have ended
        begun += 1
        other = threading.Thread(target=_work, args=(begun, ended))
        other.start()
        other.join()
    assert all(rounds) and ended == list(range(1, begun + 1))
    wait_for(lambda: threading.active_count() <= before)


def _work(number: int, ended: list[int]) -> None:
    """Compute for some microseconds."""
    for _ in range(1000):
        pass
    ended.append(number)


def test_a_call_that_catches_everything_is_met_again_and_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(bounded_call, "FIRST_LINE_S", 0.0)
    caught: list[BaseException] = []
    gate = threading.Event()

    def stubborn() -> None:
        while not gate.is_set():
            try:
                while not gate.is_set():
                    pass
            except BaseException as error:
                caught.append(error)

    call = BoundedCall("a rule", 0.001)
    assert call(stubborn) is None
    call.close()
    report, lines = OverdueReport(), list[str]()
    while len(caught) < 2:
        lines += report.due_lines()
    gate.set()
    wait_for(lambda: not OVERDUE_SOURCES)
    assert lines and lines[0].startswith("a rule was abandoned 0 s ago and has not ended")
    assert len(lines) < 20 and report.due_lines() == () and overdue_text() == ""


def test_a_call_that_waits_outside_python_is_told_as_long_as_it_lasts() -> None:
    gate = threading.Event()
    call = BoundedCall("a rule", 0.001)
    assert call(gate.wait) is None
    call.close()
    wait_for(lambda: call.overdue_call()[0] > 0.3)
    assert call in OVERDUE_SOURCES
    gate.set()
    wait_for(lambda: call not in OVERDUE_SOURCES)


# --- a package's servo bus


def test_a_bus_that_blocks_ends_the_run_and_can_be_closed(
    misbehaves: Callable[[str], Misbehaviour], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gazerig.drivers.bus.checked_bus._USUAL_S", 0.05)
    monkeypatch.setattr("gazerig.drivers.bus.checked_bus._BLOCKED_S", 0.05)
    released: list[int] = []
    inner: Any = Parts(read=misbehaves("blocks"), disable_torque=lambda: released.append(1))
    bus = CheckedBus(inner, "bus 'b' of b 1", (ServoConfig(1, "m", 0, 1000, 500.0, "neck"),))
    bus.open()
    with pytest.raises(BusLost, match="bus 'b' of b 1: read does not return$"):
        bus.read(1.0)
    with pytest.raises(BusLost, match="disable_torque does not return: cut the servo power$"):
        bus.disable_torque()
    inner.read.gate.set()  # it comes back late, and the torque can be switched off
    wait_for(lambda: _released(bus))
    assert released
    bus.close()
    bus.close()


def _released(bus: CheckedBus) -> bool:
    try:
        bus.disable_torque()
    except BusLost:
        return False
    return True


def test_a_bus_that_interrupts_is_a_lost_bus(misbehaves: Callable[[str], Misbehaviour]) -> None:
    inner: Any = Parts(read=misbehaves("interrupts"), open=misbehaves("exits"))
    bus = CheckedBus(inner, "bus 'b' of b 1", (ServoConfig(1, "m", 0, 1000, 500.0, "neck"),))
    with pytest.raises(PluginError, match="cannot be opened: SystemExit: the user's"):
        bus.open()
    with pytest.raises(BusLost, match="read failed \\(KeyboardInterrupt\\)"):
        bus.read(1.0)
    bus.close()
