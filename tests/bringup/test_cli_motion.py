"""jog, home, look-at and monitor as they are typed, on rigs of every kind."""

import json
import re
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from command_line import invoked
from commands_started import hear, start, status
from desk import GAZE_JOINTS
from served_rigs import Served, rig_files, served

from gazerig.config.schema import load_rig
from gazerig.features.bringup.cli.manual_session import holding_text, unreleased_text
from gazerig.features.bringup.manual_control import ManualControl

pytestmark = pytest.mark.usefixtures("branched_children", "simulated_wires")


@pytest.fixture
def rigs(tmp_path: Path) -> dict[str, str]:
    """Return the paths of rigs of one's own by kind."""
    return rig_files(tmp_path)


@pytest.fixture
def desk() -> Iterator[Served]:
    with served("desk") as buses:
        yield buses


@pytest.mark.pty
def test_sigterm_while_jogging_parks_and_lets_go(desk: Served) -> None:
    path = desk.ports
    process = start("jog", "neck_yaw", "60", "--speed", "15", "--port", path)
    hear(process.stderr, "torque on")
    time.sleep(0.3)
    process.send_signal(signal.SIGTERM)
    _, words = process.communicate(timeout=30)
    assert process.returncode == 1 and "SIGTERM" in words
    # A starved machine has no time left for the way.
    assert re.search(r"parked( \(not there in time\))?, torque off on all servos", words)
    assert not any(status(desk.command, servo_id)["torque"] for servo_id in range(1, 10))


def test_a_servo_that_does_not_confirm_its_torque_off_is_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stop = ManualControl.stop

    def unconfirmed(self: ManualControl) -> tuple[str, ...]:
        return *stop(self), "neck_roll (servo 9): torque-off not confirmed: cut the servo power"

    monkeypatch.setattr(ManualControl, "stop", unconfirmed)
    done = invoked("jog", "left_eye_pan", "-2", "--mock", "--seconds", "0", "--no-park")
    assert done.code == 1
    assert "torque off on all servos; neck_roll (servo 9): torque-off not confirmed" in done.err


def test_monitor_changes_nothing(desk: Served) -> None:
    path = desk.ports
    before = desk.command("status")
    done = invoked("monitor", "--once", "--port", path)
    assert done.code == 0, done.err
    assert [line.split()[0] for line in done.out.splitlines()[1:10]] == list(GAZE_JOINTS)
    after = json.loads(desk.command("status"))
    for servo, was in zip(after["servos"], json.loads(before)["servos"], strict=True):
        assert (servo["torque"], servo["goal"]) == (was["torque"], was["goal"])
    desk.command("lose 3")
    lost = invoked("monitor", "--once", "--port", path)
    assert lost.code == 0 and "no answer" in lost.out


def test_jog_says_what_was_applied() -> None:
    done = invoked(
        "jog", "left_eye_pan", "-20", "--mock", "--speed", "60", "--seconds", "0", "--no-park"
    )
    assert done.code == 0, done.err
    assert re.search(r"left_eye_pan: desired -20\.0, measured -\d+\.\d deg", done.err)
    assert "torque on: 9 servos" in done.err
    assert "torque off on all servos" in done.err


def test_jog_beyond_the_range_is_refused_at_once_with_the_range() -> None:
    done = invoked("jog", "left_eye_pan", "500", "--mock")
    assert done.code == 2
    assert done.err == "left_eye_pan 500.0 deg is outside its range, -35..35 deg\n"


def test_home_goes_to_the_centre() -> None:
    done = invoked("home", "--mock", "--speed", "60")
    assert done.code == 0, done.err
    assert "left_upper_lid: desired 20.0" in done.err
    assert "arrived" in done.err and "parked" not in done.err


def test_look_at_tells_error_and_vergence() -> None:
    done = invoked("look-at", "1", "-0.2", "0.3", "--mock", "--seconds", "3", "--no-park")
    assert done.code == 0, done.err
    errors = re.search(r"gaze error: left eye (\S+), right eye (\S+) deg", done.err)
    assert errors is not None and max(map(float, errors.groups())) < 2.0
    assert re.search(r"vergence: 3\.\d+ deg, the point needs 3\.5", done.err)


def test_monitor_as_lines_of_json() -> None:
    done = invoked("monitor", "--mock", "--json", "--seconds", "1.5", "--rate", "10")
    lines = [json.loads(line) for line in done.out.splitlines()]
    assert done.code == 0 and 2 <= len(lines) <= 16
    assert set(lines[0]["joints"]) == set(GAZE_JOINTS)
    assert lines[-1]["t_s"] > lines[0]["t_s"] and lines[-1]["unanswered"] == 0


@pytest.mark.parametrize(
    "words",
    [
        ("jog", "neck_yaw", "10"),
        ("home",),
        ("look-at", "1", "0", "0.3"),
        ("monitor", "--once"),
        ("calibrate", "--dry-run", "--joint", "neck_yaw"),
    ],
    ids=lambda words: words[0],
)
def test_an_absent_port_is_said_with_what_there_is(words: tuple[str, ...]) -> None:
    done = invoked(*words, "--port", "/dev/ttyNowhere")
    assert done.code == 2
    assert "no serial port /dev/ttyNowhere" in done.err


def test_nonsense_is_refused_before_the_torque_is_on() -> None:
    for words in (("jog", "nose", "3"), ("jog", "neck_yaw", "nan"), ("look-at", "nan", "0", "0")):
        done = invoked(*words, "--mock")
        assert done.code == 2 and "torque on" not in done.err


# --- hobby servos and rigs of several kinds


def test_monitor_shows_every_kind_in_one_table(rigs: dict[str, str]) -> None:
    done = invoked("monitor", rigs["mixed"], "--mock", "--once")
    assert done.code == 0, done.err
    rows = {line.split()[0]: line.split() for line in done.out.splitlines()[1:9]}
    assert rows["eyes_pan"][1:] == ["0", "-", "-", "none", "-", "-", "-", "-", "off", "-"]
    assert rows["neck_yaw"][1] == "neck:7" and rows["neck_yaw"][-1] == "none"
    assert rows["neck_pitch"][1] == "tilt:1" and "us/step" in done.out
    assert "estimated from the pulse" in done.out


def test_monitor_of_a_mixed_rig_as_json(rigs: dict[str, str]) -> None:
    done = invoked("monitor", rigs["mixed"], "--mock", "--json", "--seconds", "0")
    reported = json.loads(done.out.splitlines()[0])["joints"]
    assert reported["eyes_pan"]["measured"] is False and reported["neck_yaw"]["measured"] is True


def test_on_real_wires_hobby_servos_are_asked_for_first(
    rigs: dict[str, str],
) -> None:
    rig = rigs["mixed"]
    with served(rig) as buses:
        refused = invoked("jog", rig, "neck_yaw", "5", "--port", buses.ports)
        assert refused.code == 2 and "say --yes" in refused.err
        assert "torque on" not in refused.err
        assert all(one["target"] == 0 for one in json.loads(buses.command("status"))["servos"])
        words = ("--port", buses.ports, "--yes", "--speed", "60", "--seconds", "0")
        done = invoked("jog", rig, "eyes_pan", "8", *words)
        assert done.code == 0, done.err
        assert "go to their parking place at once" in done.err
        assert "torque on: 2 servos hold where they are, 6 hobby servos" in done.err
        assert re.search(r"eyes_pan: desired 8\.0, estimated \d\.\d deg", done.err)
        assert re.search(r"parked( \(.*\))?, torque off on all servos", done.err)
        assert all(one["target"] == 0 for one in json.loads(buses.command("status"))["servos"])


def test_home_opens_all_four_lids() -> None:
    done = invoked("home", "maker", "--mock", "--speed", "60")
    assert done.code == 0, done.err
    assert "left_lower_lid: desired 22.0, estimated 22.0" in done.err
    assert "pulses on: 6 hobby servos" in done.err


def test_look_at_of_a_maker_s_head_says_what_it_cannot_do() -> None:
    words = ("maker", "1", "-0.2", "0.1", "--mock", "--seconds", "1.5", "--no-park")
    done = invoked("look-at", *words)
    assert done.code == 0, done.err
    assert "mean line of sight" in done.err and "vergence: none" in done.err
    assert "head:" not in done.err and "estimated, not measured" in done.err


def test_what_servos_do_alone_is_said_for_the_kinds_that_there_are(rigs: dict[str, str]) -> None:
    mixed = unreleased_text(load_rig(rigs["mixed"]))
    assert "watchdog" in mixed and "Feetech" in mixed and "Maestro" in mixed
    assert "own watchdog and hold" in unreleased_text(load_rig("desk"))
    assert "watchdog" not in unreleased_text(load_rig("feetech"))
    assert holding_text(load_rig("desk")) == "torque on: 9 servos hold where they are"
