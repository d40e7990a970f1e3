"""gazerig calibrate joints, camera, board and face as they are typed, against emulated buses."""

import signal
from pathlib import Path

import pytest
from command_line import Invoked, answers_in, invoked
from commands_started import hear, start, status
from served_rigs import served

from gazerig.config.schema import load_rig

pytestmark = pytest.mark.usefixtures("simulated_wires")


def calibrate(*words: str) -> Invoked:
    return invoked("calibrate", *words)


def calibrated(*words: str) -> Invoked:
    """Run a calibration that succeeds."""
    done = calibrate(*words)
    assert done.code == 0, done.err
    return done


# --- joints


def test_by_hand_a_joint_is_written_into_the_rig_with_a_backup(rig: Path, tmp_path: Path) -> None:
    before = rig.read_text("utf-8")
    answers = answers_in(tmp_path, "turn -400", "", "turn 700", "", "turn -290", "", "y")
    done = calibrated(str(rig), "--mock", "--joint", "left_eye_pan", "--answers", answers)
    found = load_rig(str(rig)).joints["left_eye_pan"]
    # The emulated stops are at 1604 and 2492, the hand starts at 2116.
    assert found.sign == -1 and found.zero_step == pytest.approx(2126, abs=12)
    assert found.min_deg < -20.0 < 20.0 < found.max_deg
    (backup,) = tmp_path.glob("desk.yaml.bak-*")
    assert backup.read_text("utf-8") == before
    assert "# The desk rig" in rig.read_text("utf-8")
    assert "joints.left_eye_pan.sign: 1 -> -1" in done.err
    assert "left_eye_pan (servo 1): torque off" in done.err
    assert "joints.left_eye_pan.zero_step" in done.out


def test_a_no_writes_nothing(rig: Path, tmp_path: Path) -> None:
    before = rig.read_bytes()
    answers = answers_in(tmp_path, "", "turn -400", "", "turn 200", "", "n")
    words = ("--joint", "left_eye_tilt", "--mock", "--answers", answers)
    done = calibrate(str(rig), *words)
    assert done.code == 0 and "nothing written" in done.err
    assert rig.read_bytes() == before and not list(tmp_path.glob("*.bak-*"))


def test_what_makes_no_calibration_is_refused_and_the_rest_is_kept(
    rig: Path, tmp_path: Path
) -> None:
    answers = answers_in(tmp_path, "", "", "", "turn 300", "", "turn -600", "", "turn 300", "", "y")
    words = ("--joint", "left_eye_pan", "--joint", "neck_yaw", "--mock", "--answers", answers)
    done = calibrate(str(rig), *words)
    assert done.code == 1
    assert "refused: left_eye_pan: only 0.0 deg are between the two ends" in done.err
    assert "not calibrated: left_eye_pan" in done.err
    assert load_rig(str(rig)).joints["neck_yaw"].zero_step == pytest.approx(1911, abs=8)


def test_a_shipped_rig_is_copied_not_written(tmp_path: Path) -> None:
    refused = calibrate("desk", "--mock")
    assert refused.code == 2 and "desk.yaml" in refused.err
    out = tmp_path / "copy.yaml"
    answers = answers_in(tmp_path, "turn 300", "", "turn -600", "", "turn 300", "")
    words = ("--joint", "neck_roll", "--answers", answers, "--yes", "--mock", "--out", str(out))
    calibrated("desk", *words)
    assert load_rig(str(out)).joints["neck_roll"].max_deg > 10.0


@pytest.mark.parametrize(
    ("kind", "words", "says"),
    [
        ("desk", ("--joint", "nose"), "no such joint; there is left_eye_pan"),
        ("desk", ("--joint", "neck_yaw", "--answers", "EMPTY"), "no answer left to: turn neck_yaw"),
        ("maker", ("--by", "motion"), "hobby servos do not report their position"),
        ("maker", ("--pulses", "400:2000"), "within 500:2500 us"),
        ("maker", ("--set-middle",), "only Feetech STS servos"),
    ],
)
def test_what_cannot_be_is_said(
    rigs: dict[str, str], tmp_path: Path, kind: str, words: tuple[str, ...], says: str
) -> None:
    before = Path(rigs[kind]).read_bytes()
    words = tuple(answers_in(tmp_path) if word == "EMPTY" else word for word in words)
    done = calibrate(rigs[kind], "--mock", *words)
    assert done.code == 2 and says in done.err, done.err
    assert Path(rigs[kind]).read_bytes() == before


# --- on a port that another program serves, from a process of its own


@pytest.mark.pty
def test_ctrl_c_while_calibrating_lets_go_and_writes_nothing(rig: Path) -> None:
    before = rig.read_bytes()
    with served(str(rig)) as buses:
        words = ("--joint", "left_eye_pan", "--by", "motion", "--yes", "--port", buses.ports)
        process = start("calibrate", str(rig), *words)
        hear(process.stderr, "torque on")
        process.send_signal(signal.SIGINT)
        _, words_said = process.communicate(timeout=20)
        assert process.returncode == 1 and "stopped by SIGINT" in words_said
        assert not status(buses.command, 1)["torque"] and rig.read_bytes() == before


# --- a camera


def test_a_simulated_lens_is_measured_and_shown() -> None:
    done = calibrated("camera", "--mock", "--what", "lens", "--dry-run")
    assert "camera.lens.focal_px" in done.out + done.err
    assert "reprojection error 0." in done.out + done.err
