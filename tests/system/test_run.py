"""The command run in simulated time, end to end: from picture to servo bytes."""

import json
import os
import re
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import branch
import cv2
import numpy as np
import pytest
from command_line import figures, gazerig, typed
from slow_rigs import at_rate

import gazerig as gazerig_package
from gazerig.config.faults import ConfigError
from gazerig.config.schema import load_rig
from gazerig.features.lab.report.gaze_trace import PHASES
from gazerig.features.lab.simulated_run import SimulatedRun, simulate
from gazerig.robot.run.options import RunOptions


@pytest.fixture(scope="module")
def slow(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The desk rig at half its rate, for tests that do not concern the rate."""
    return at_rate(tmp_path_factory.mktemp("rigs"), "desk", 100.0)


@pytest.fixture(scope="module")
def visitor(slow: str) -> SimulatedRun:
    """One round of the visitor: comes, moves, waves, leaves and comes back."""
    asked = RunOptions(True, True, seed=1, scene="visitor", rig=slow, seconds=44.0)
    return simulate(load_rig(slow), asked)


@pytest.mark.slow
def test_summary_tells_all_it_promises(visitor: SimulatedRun):
    figures: dict[str, Any] = visitor.figures
    promised = {
        "seconds", "wall_seconds", "ticks", "overruns", "faces_seen", "pictures", "fixations",
        "saccades", "blinks", "target_share", "bus", "stopped_by",
    }  # fmt: skip
    assert promised <= set(figures)
    assert {"tx_bytes", "rx_bytes", "errors"} <= set(figures["bus"])
    assert figures["stopped_by"] == "seconds" and figures["overruns"] == 0
    assert figures["ticks"] == pytest.approx(44 * 100, abs=2)


def test_the_head_looks_at_the_visitor(visitor: SimulatedRun):
    figures: dict[str, Any] = visitor.figures
    share = figures["target_share"]
    nobody = sum(share.get(kind, 0.0) for kind in ("rest", "search", "glance"))
    assert share["face"] > 0.6 and share["hand"] > 0.02 and nobody > 0.02
    assert figures["bus"]["errors"] == {}
    assert 1.5 < figures["saccades"] / figures["seconds"] < 5.5
    assert 5 <= figures["blinks"] <= 40


def test_the_eyes_rest_on_what_the_head_looks_at(visitor: SimulatedRun):
    trace = visitor.trace
    resting = trace.slow() & (trace.column("phase") != PHASES.index("saccade"))
    off_deg = trace.column("off").mean(axis=1)[resting]
    assert np.median(off_deg) < 0.3
    # A new target waits a reaction time and the gap after a saccade.
    assert np.percentile(off_deg, 95.0) < 6.5


def photo(path: Path) -> Path:
    data = pytest.importorskip("skimage.data", reason="scikit-image ships the photo")
    cv2.imwrite(str(path), np.ascontiguousarray(data.astronaut()[:, :, ::-1]))
    return path


@pytest.mark.slow
def test_e59_before_a_photo_same_seed_same_bytes_in_another_process(slow: str, tmp_path: Path):
    words = (slow, "--video", str(photo(tmp_path / "photo.png")), "--seconds", "2", "--seed")
    done = gazerig("run", "--mock", "--fast", "--summary", "-", *words, "1")
    assert done.returncode == 0, done.stderr
    one: dict[str, Any] = json.loads(done.stdout)
    again = figures(*words, "1")
    assert one.pop("wall_seconds") > 0.0 and again.pop("wall_seconds") > 0.0
    assert again == one
    assert again["faces_seen"] == again["pictures"] >= 17
    assert again["target_share"]["face"] > 0.8  # after a reaction time
    assert re.fullmatch(r"[0-9a-f]{64}", again["bus"]["tx_sha256"])


def test_another_seed_gives_other_bytes(slow: str):
    one, two = (figures(slow, "--seconds", "1", "--seed", seed)["bus"] for seed in "12")
    assert one["tx_sha256"] != two["tx_sha256"]


# --- Ends of the command run in real time: by a signal


def begun(*words: str) -> "subprocess.Popen[str]":
    """Start a run in a process of its own; give it once torque is on."""
    process = branch.Branch(
        branch.gazerig("run", *words, "--mock", "--no-page", "--summary", "-"),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    # The first line comes with the first tick.
    assert process.stderr is not None
    assert any("Ctrl-C parks the head" in line for line in iter(process.stderr.readline, ""))
    return process


@pytest.mark.slow
def test_signals_park_and_switch_torque_off(tmp_path: Path):
    rig = at_rate(tmp_path, "desk", 50.0)
    numbers = (signal.SIGINT, signal.SIGTERM)
    processes = [begun(rig) for _ in numbers]
    time.sleep(1.5)
    for number, process in zip(numbers, processes, strict=True):
        process.send_signal(number)
    for number, process in zip(numbers, processes, strict=True):
        out, err = process.communicate(timeout=30)
        assert process.returncode == 0, err
        name = signal.Signals(number).name
        assert f"stopped by {name}: parked, torque off" in err
        run = json.loads(out)
        assert run["stopped_by"] == name
        assert run["target_share"].get("face", 0.0) > 0.0


# --- Errors of users, in one line before a run begins; check and schema


DESK = Path(__file__).parents[2] / "config" / "rigs" / "desk.yaml"


FAULTS = (
    (("--mock", "--video", "nowhere.avi"), "nowhere.avi"),
    (("--mock", "--camera", "97"), "97"),
    (("--scene", "visitor"), "/dev/ttyUSB0"),
    (("--mock", "--scene", "visitor", "--video", "x.avi"), "exclude each other"),
    (("--mock", "--fast", "--video", "x.avi"), "--seconds"),
    (("--fast",), "--fast needs --mock"),
    (("--port", "/dev/ttyNOPE"), "no serial port /dev/ttyNOPE"),
    ((), "nothing to look at"),
    (("--mock", "--page", "8080"), "HOST:PORT"),
    (("nosuchrig", "--mock"), "nosuchrig"),
    (("--mock", "--profile", "giant"), "giant"),
)


def test_what_a_person_can_mend_is_one_line_and_exit_code_2(capfd: pytest.CaptureFixture[str]):
    for words, message in FAULTS:
        code = typed("run", "--no-page", *words)
        one_line_and_exit_code_2(code, capfd.readouterr().err, message)


def test_a_name_that_is_not_shipped_is_refused_at_once():
    with pytest.raises(ConfigError, match="did you mean 'desk'"):
        gazerig_package.open("dessk")
    with pytest.raises(ConfigError, match="did you mean 'shy'"):
        gazerig_package.open("desk", character="shyy")


def test_an_unknown_key_of_a_joint_is_the_only_error(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
):
    path, text = tmp_path / "my.yaml", DESK.read_text(encoding="utf-8")
    path.write_text(text.replace("    zero_step:", "    zero_stepp:", 1), encoding="utf-8")
    assert typed("check", str(path)) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert "left_eye_pan.zero_stepp: unknown key; did you mean 'zero_step'" in line


def test_a_shell_sees_that_line_and_that_exit_code():
    done = gazerig("run", "--no-page", "--mock", "--scene", "circus", timeout=30)
    one_line_and_exit_code_2(done.returncode, done.stderr, "circus")


def one_line_and_exit_code_2(code: int, said: str, message: str) -> None:
    assert code == 2, said
    assert message in said
    assert len(said.strip().splitlines()) == 1, said
    assert "Traceback" not in said


@pytest.mark.skipif(os.geteuid() == 0, reason="root may open every port")
def test_a_port_without_rights_names_the_cure(tmp_path: Path, capfd: pytest.CaptureFixture[str]):
    port = tmp_path / "tty"
    port.touch(mode=0)
    text = DESK.read_text(encoding="utf-8")
    rig = tmp_path / "rig.yaml"
    rig.write_text(text.replace("/dev/ttyUSB0", str(port)), encoding="utf-8")
    assert typed("run", str(rig), "--scene", "visitor", "--no-page") == 2
    assert "dialout" in capfd.readouterr().err


def test_check(tmp_path: Path, capfd: pytest.CaptureFixture[str]):
    assert typed("check") == 0
    capfd.readouterr()
    rig = tmp_path / "bad.yaml"
    text = DESK.read_text(encoding="utf-8")
    text = text.replace("max_speed_deg_s: 200.0", "max_speed_deg_s: 9000.0", 1)
    text = text.replace("id: 9\n", "id: 8\n").replace("name: desk", "nmae: desk")
    rig.write_text(text, encoding="utf-8")
    assert typed("check", str(rig)) == 2
    said = capfd.readouterr().err
    for part in (
        "max_speed_deg_s",
        "id 8 on bus is already used by joints.neck_pitch.id",
        "nmae",
        "name",
    ):
        assert part in said
    lines = [line for line in said.splitlines() if line.startswith(f"{rig}:")]
    assert len(lines) >= 4 and all(re.match(rf"{re.escape(str(rig))}:\d+: ", s) for s in lines)
