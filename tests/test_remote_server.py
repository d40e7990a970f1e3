"""Other programs steer a running rig: what is asked is done, what is rubbish costs nobody."""

import os
import shutil
import tempfile
import threading
from collections.abc import Callable, Iterator
from math import radians
from pathlib import Path

import pytest
from remote_rig import BLINKS, RATE, Beat, Broken, SecondTuning, server_closed

from gazerig.drivers.errors import SetupError
from gazerig.robot.model import stop_latch
from gazerig.robot.model.commands import Tune, Value
from gazerig.robot.remote.client import (
    ConnectionLost,
    RequestRejected,
    RobotClient,
)
from gazerig.robot.remote.request_handler import RequestHandler
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


# What can be asked


def test_values_rules_and_changes(rig: RobotClient) -> None:
    assert rig.get() == {RATE: 200.0, BLINKS: 17.0}
    assert rig.get("gaze.") == {BLINKS: 17.0}
    assert rig.parameter(RATE).high == 1000.0 and rig.parameter(RATE).group == "loop"
    assert isinstance(described := rig._connection.ask("parameters", prefix=RATE), list)
    assert described[0]["description"] == "a rate"
    assert rig.set(RATE, 100.0) == ("taken",)
    assert rig.get(RATE) == {RATE: 100.0}
    assert rig.unsaved() == rig.differs() == ((RATE, "200.0", "100.0"),)
    assert rig.status()["version"] == 1 and rig.status()["unsaved"] == 1
    saved = rig.save("/tmp/my.yaml")
    assert saved.path == Path("/tmp/my.yaml") and saved.changes == ((RATE, "200.0", "100.0"),)
    assert rig.unsaved() == ()
    rig.set(BLINKS, 3.0)
    rig.revert()
    assert rig.get(BLINKS) == {BLINKS: 17.0}


def test_a_broken_rule_is_told_in_full_and_nothing_changes(rig: RobotClient) -> None:
    with pytest.raises(RequestRejected) as refused:
        rig.set_many({RATE: 1e9, BLINKS: -1.0})
    assert str(refused.value).splitlines() == [
        f"{RATE}: 1000000000.0 breaks the rule",
        f"{BLINKS}: -1.0 breaks the rule",
    ]
    assert rig.get() == {RATE: 200.0, BLINKS: 17.0}


@pytest.mark.parametrize("value", [float("nan"), float("inf"), object(), b"1"])
def test_what_has_no_json_is_refused_before_it_is_sent(rig: RobotClient, value: Value) -> None:
    with pytest.raises(RequestRejected, match="finite numbers"):
        rig.set(RATE, value)
    assert rig.get(RATE) == {RATE: 200.0}


def test_unknown_key_and_character(rig: RobotClient) -> None:
    with pytest.raises(RequestRejected, match="unknown key"):
        rig.parameter("loop.rate")
    assert rig.characters() == ("bold", "shy")
    rig.character("shy")
    with pytest.raises(RequestRejected, match="no character 'brave'"):
        rig.character("brave")


def test_when_set_returns_the_loop_has_it(rig: RobotClient, beat: Beat) -> None:
    rig.set(RATE, 150.0)
    assert any(Tune(((RATE, 150.0),)) in tick.commands for tick in beat.ticks)
    assert "tuned 1" in rig.status()["said"]


def test_the_first_tick_after_set_has_it(rig: RobotClient, beat: Beat) -> None:
    beat.hold.set()
    asking = threading.Thread(target=rig.set, args=(RATE, 140.0))
    try:
        asking.start()
        while not beat.robot._commands:
            asking.join(timeout=0.002)
            assert asking.is_alive()
        held = len(beat.ticks)
    finally:
        beat.hold.clear()
    asking.join()
    assert beat.ticks[held].commands == (Tune(((RATE, 140.0),)),)


def test_looking_jogging_and_asking(rig: RobotClient, beat: Beat) -> None:
    rig.look_at(1.0, 0.2, 0.1, stay=True)
    assert rig.status()["why"].endswith("makes it look at 1 0.2 0.1")
    assert rig.status()["leads"] == "person"
    assert beat.ticks[-1].target.p_world_m == (1.0, 0.2, 0.1)
    rig.look_freely()
    assert rig.status()["leads"] == "gaze" and "makes it" not in rig.status()["why"]
    rig.jog("neck_yaw", 10.0, stay=True)
    desired = dict(zip(rig.status()["joints_deg"], beat.ticks[-1].desired_rad, strict=True))
    assert desired["neck_yaw"] == pytest.approx(radians(10.0))
    rig.jog_free()
    menus = rig.menus()
    rig.ask("conversation", "talk")
    assert menus["conversation"][0] == "none" and rig.menus()["conversation"][0] == "talk"
    rig.ask("conversation", "none")


def test_stop_and_resume(rig: RobotClient, beat: Beat) -> None:
    rig.stop("finger")
    status = rig.status()
    assert status["stopped"] == "finger" and status["level"] == "torque_off"
    assert not any(beat.ticks[-1].joints.torque)
    rig.resume()
    assert rig.status()["stopped"] == ""


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda rig: rig.jog("nose", 1.0), "this rig has no joint 'nose'; there is left_eye_pan"),
        (lambda rig: rig.jog("neck_yaw", float("nan")), "finite"),
        (lambda rig: rig.look_at(float("inf"), 0.0, 0.0), "finite"),
        (lambda rig: rig.ask("mood", "good"), "nothing called 'mood'"),
        (lambda rig: rig.ask("lids", "blue"), "no lids 'blue'"),
    ],
)
def test_orders_that_cannot_be_meant(
    rig: RobotClient, ask: Callable[[RobotClient], None], words: str
) -> None:
    with pytest.raises(RequestRejected, match=words):
        ask(rig)


# A loop that hangs, a resume that fails


def test_a_loop_that_hangs_is_told_to_who_stops(
    folder: Path, beat: Beat, errors: list[str], rig: RobotClient
) -> None:
    beat.hold.set()
    try:
        with pytest.raises(RequestRejected, match="emergency stop"):
            rig.stop()
    finally:
        beat.hold.clear()
    assert beat.pulse.taken_up(20.0)
    rig.resume()


def test_a_servo_that_refuses_torque_is_named(
    rig: RobotClient, beat: Beat, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse() -> None:
        raise SetupError("neck_yaw: overload; gazerig reboot")

    rig.stop("test")
    with monkeypatch.context() as patch:
        patch.setattr(beat.robot.body, "enable_torque", refuse)
        with pytest.raises(RequestRejected, match="still stopped: neck_yaw: overload"):
            rig.resume()
    rig.resume()


def test_an_error_of_the_program_is_told_to_both_sides_and_the_rest_goes_on(
    rig: RobotClient, errors: list[str]
) -> None:
    with pytest.raises(ConnectionLost, match="KeyError"):
        rig.set("bug", 5.0)
    assert "KeyError" in errors[0]
    assert rig.get(RATE) == {RATE: 200.0}
