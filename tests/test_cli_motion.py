"""calibrate, jog, home, look-at and monitor as they are typed, against an emulated bus."""

import json
import os
import re
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import IO, Any

import pytest
from desk import JOINTS
from typer.testing import CliRunner

from gazerig.config.save import save_rig
from gazerig.config.schema import load_rig
from gazerig.robot.cli.motion import app
from gazerig.sim_mock.pty.client import PtyBus
from gazerig.sim_mock.smart_servo.physics import ServoSpec

ROOT = Path(__file__).parents[1]
DESK = ROOT / "config" / "rigs" / "desk.yaml"
COMMAND = [sys.executable, "-c", "from gazerig.robot.cli.motion import app; app()"]


def run(*words: str) -> Any:
    return CliRunner().invoke(app, words)


@pytest.fixture
def rig(tmp_path: Path) -> Path:
    """Return a rig file of one's own."""
    mine = tmp_path / "mine.yaml"
    mine.write_text(DESK.read_text("utf-8"), encoding="utf-8")
    return mine


def script(tmp_path: Path, *lines: str) -> str:
    file = tmp_path / "answers"
    file.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
    return str(file)


# --- calibrate


def test_by_hand_a_joint_is_written_into_the_rig_with_a_backup(rig: Path, tmp_path: Path) -> None:
    before = rig.read_text("utf-8")
    answers = script(tmp_path, "turn -400", "", "turn 700", "", "turn -290", "", "y")
    done = run("calibrate", str(rig), "--mock", "--joint", "left_eye_pan", "--answers", answers)
    assert done.exit_code == 0, done.stderr
    found = load_rig(str(rig)).joints["left_eye_pan"]
    # The emulated stops lie at 1604 and 2492, the hand starts at 2116.
    assert found.sign == -1 and found.zero_step == pytest.approx(2126, abs=12)
    assert found.min_deg < -20.0 < 20.0 < found.max_deg
    (backup,) = tmp_path.glob("mine.yaml.bak-*")
    assert backup.read_text("utf-8") == before
    assert "# The desk rig" in rig.read_text("utf-8")
    assert "joints.left_eye_pan.sign: 1 -> -1" in done.stderr
    assert "left_eye_pan (servo 1): torque off" in done.stderr
    assert "joints.left_eye_pan.zero_step" in done.stdout


def test_by_motion_needs_no_answer_with_yes(rig: Path) -> None:
    near = {"joints.left_eye_tilt.min_deg": -2.0, "joints.left_eye_tilt.max_deg": 3.0}
    save_rig(rig, near, datetime(2026, 1, 1))
    words = ("--joint", "left_eye_tilt", "--by", "motion", "--margin", "1", "--yes", "--mock")
    done = run("calibrate", str(rig), *words)
    assert done.exit_code == 0, done.stderr
    # The emulated stops lie 4 deg beyond the range: -6..7.
    found = load_rig(str(rig)).joints["left_eye_tilt"]
    assert found.max_deg == pytest.approx(5.5, abs=0.5) and found.sign == 1
    assert found.min_deg == pytest.approx(-5.5, abs=0.5)
    assert len(re.findall(r"stop at step \d+, pushed for [1-4]?\d\d ms", done.stderr)) == 2


def test_a_no_writes_nothing(rig: Path, tmp_path: Path) -> None:
    before = rig.read_bytes()
    answers = script(tmp_path, "", "turn -400", "", "turn 200", "", "n")
    words = ("--joint", "left_eye_tilt", "--mock", "--answers", answers)
    done = run("calibrate", str(rig), *words)
    assert done.exit_code == 0 and "nothing written" in done.stderr
    assert rig.read_bytes() == before and not list(tmp_path.glob("*.bak-*"))


def test_what_makes_no_calibration_is_refused_and_the_rest_is_kept(
    rig: Path, tmp_path: Path
) -> None:
    answers = script(tmp_path, "", "", "", "turn 300", "", "turn -600", "", "turn 300", "", "y")
    words = ("--joint", "left_eye_pan", "--joint", "neck_yaw", "--mock", "--answers", answers)
    done = run("calibrate", str(rig), *words)
    assert done.exit_code == 1
    assert "refused: left_eye_pan: only 0.0 deg lie between the two ends" in done.stderr
    assert "not calibrated: left_eye_pan" in done.stderr
    assert load_rig(str(rig)).joints["neck_yaw"].zero_step == pytest.approx(1911, abs=8)


def test_a_shipped_rig_is_copied_not_written(tmp_path: Path) -> None:
    refused = run("calibrate", "desk", "--mock")
    assert refused.exit_code == 2 and "desk.yaml" in refused.stderr
    out = tmp_path / "copy.yaml"
    answers = script(tmp_path, "turn 300", "", "turn -600", "", "turn 300", "")
    words = ("--joint", "neck_roll", "--answers", answers, "--yes", "--mock", "--out", str(out))
    done = run("calibrate", "desk", *words)
    assert done.exit_code == 0, done.stderr
    assert load_rig(str(out)).joints["neck_roll"].max_deg > 10.0


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--joint", "nose"), "no such joint; there is left_eye_pan"),
        (("--port", "/dev/null"), "exclude each other"),
        (("--answers", "/nowhere"), "No such file"),
        (("--joint", "neck_yaw", "--answers", "EMPTY"), "no answer left to: turn neck_yaw"),
        (("--joint", "neck_yaw", "--answers", "/dev/null"), "is a device"),
    ],
)
def test_what_cannot_be_is_said(
    rig: Path, tmp_path: Path, words: tuple[str, ...], says: str
) -> None:
    before = rig.read_bytes()
    words = tuple(script(tmp_path) if word == "EMPTY" else word for word in words)
    done = run("calibrate", str(rig), "--mock", *words)
    assert done.exit_code == 2 and says in done.stderr
    assert rig.read_bytes() == before


# --- on a port that somebody else serves, from a process of its own


@pytest.fixture
def bus() -> Iterator[tuple[PtyBus, str]]:
    joints = load_rig("desk").joints
    with PtyBus() as served:
        specs = [ServoSpec(joints[name].id, joints[name].model) for name in JOINTS]
        yield served, served.start(specs)


def status(bus: PtyBus, servo_id: int) -> dict[str, object]:
    found: dict[str, object] = next(
        servo for servo in json.loads(bus.command("status"))["servos"] if servo["id"] == servo_id
    )
    return found


def start(*words: str) -> subprocess.Popen[str]:
    pipe = subprocess.PIPE
    return subprocess.Popen(
        [*COMMAND, *words], stdin=pipe, stdout=pipe, stderr=pipe, text=True, cwd=ROOT
    )


def hear(stream: IO[str] | None, wanted: str, within_s: float = 20.0) -> None:
    """Read until a text has come."""
    assert stream is not None
    end_s, seen = time.monotonic() + within_s, ""
    while wanted not in seen:
        assert select.select([stream], [], [], max(0.0, end_s - time.monotonic()))[0], seen
        data = os.read(stream.fileno(), 4096).decode()
        assert data, seen
        seen += data


def test_by_hand_over_a_port_with_answers_through_a_pipe(
    rig: Path, bus: tuple[PtyBus, str]
) -> None:
    served, path = bus
    process = start("calibrate", str(rig), "--joint", "neck_roll", "--port", path)
    assert process.stdin is not None
    for where, steps in (("RIGHT EAR DOWN", 300), ("LEFT EAR DOWN", -500), ("straight ahead", 240)):
        hear(process.stderr, where)
        for _ in range(5):
            served.command(f"turn 9 {steps // 5}")
            time.sleep(0.05)
        process.stdin.write("\n")
        process.stdin.flush()
    hear(process.stderr, "write these")
    process.stdin.write("y\n")
    process.stdin.flush()
    _, words = process.communicate(timeout=20)
    assert process.returncode == 0, words
    found = load_rig(str(rig)).joints["neck_roll"]
    assert found.sign == 1 and found.zero_step == pytest.approx(2088, abs=8)


def test_ctrl_c_while_calibrating_lets_go_and_writes_nothing(
    rig: Path, bus: tuple[PtyBus, str]
) -> None:
    served, path = bus
    before = rig.read_bytes()
    words = ("--joint", "left_eye_pan", "--by", "motion", "--yes", "--port", path)
    process = start("calibrate", str(rig), *words)
    hear(process.stderr, "torque on")
    process.send_signal(signal.SIGINT)
    _, words_said = process.communicate(timeout=20)
    assert process.returncode == 1 and "stopped by SIGINT" in words_said
    assert not status(served, 1)["torque"] and rig.read_bytes() == before


def test_sigterm_while_jogging_parks_and_lets_go(bus: tuple[PtyBus, str]) -> None:
    served, path = bus
    process = start("jog", "neck_yaw", "60", "--speed", "60", "--port", path)
    hear(process.stderr, "torque on")
    time.sleep(0.3)
    process.send_signal(signal.SIGTERM)
    _, words = process.communicate(timeout=30)
    assert process.returncode == 1 and "SIGTERM" in words
    assert "parked, torque off on all servos" in words
    assert not any(status(served, servo_id)["torque"] for servo_id in range(1, 10))


def test_monitor_changes_nothing(bus: tuple[PtyBus, str]) -> None:
    served, path = bus
    before = served.command("status")
    done = run("monitor", "--once", "--port", path)
    assert done.exit_code == 0, done.stderr
    assert [line.split()[0] for line in done.stdout.splitlines()[1:10]] == list(JOINTS)
    after = json.loads(served.command("status"))
    for servo, was in zip(after["servos"], json.loads(before)["servos"], strict=True):
        assert (servo["torque"], servo["goal"]) == (was["torque"], was["goal"])
    served.command("lose 3")
    lost = run("monitor", "--once", "--port", path)
    assert lost.exit_code == 0 and "no answer" in lost.stdout


# --- moving and watching with --mock


def test_jog_says_what_was_applied() -> None:
    done = run(
        "jog", "left_eye_pan", "-20", "--mock", "--speed", "60", "--seconds", "0", "--no-park"
    )
    assert done.exit_code == 0, done.stderr
    assert re.search(r"left_eye_pan: wished -20\.0, is at -\d+\.\d deg", done.stderr)
    assert "torque on: 9 servos" in done.stderr
    assert "torque off on all servos" in done.stderr


def test_jog_beyond_the_range_is_refused_at_once_with_the_range() -> None:
    done = run("jog", "left_eye_pan", "500", "--mock")
    assert done.exit_code == 2
    assert done.stderr == "left_eye_pan 500.0 deg is outside its range, -35..35 deg\n"


def test_home_goes_to_the_centre() -> None:
    done = run("home", "--mock", "--speed", "60")
    assert done.exit_code == 0, done.stderr
    assert "left_upper_lid: wished 20.0" in done.stderr
    assert "arrived" in done.stderr and "parked" not in done.stderr


def test_look_at_tells_error_and_vergence() -> None:
    done = run("look-at", "1", "-0.2", "0.3", "--mock", "--seconds", "3", "--no-park")
    assert done.exit_code == 0, done.stderr
    errors = re.search(r"gaze error: left eye (\S+), right eye (\S+) deg", done.stderr)
    assert errors is not None and max(map(float, errors.groups())) < 2.0
    assert re.search(r"vergence: 3\.\d+ deg, the point needs 3\.5", done.stderr)


def test_monitor_as_lines_of_json() -> None:
    done = run("monitor", "--mock", "--json", "--seconds", "1.5", "--rate", "10")
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    assert done.exit_code == 0 and 2 <= len(lines) <= 16
    assert set(lines[0]["joints"]) == set(JOINTS)
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
    done = run(*words, "--port", "/dev/ttyNowhere")
    assert done.exit_code == 2
    assert "no serial port /dev/ttyNowhere" in done.stderr


def test_nonsense_is_refused_before_the_torque_is_on() -> None:
    for words in (("jog", "nose", "3"), ("jog", "neck_yaw", "nan"), ("look-at", "nan", "0", "0")):
        done = run(*words, "--mock")
        assert done.exit_code == 2 and "torque on" not in done.stderr
