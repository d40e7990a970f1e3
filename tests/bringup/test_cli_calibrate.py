"""gazerig calibrate joints, camera, board and face as they are typed, against emulated buses."""

import re
import signal
import time
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path

import pytest
from command_line import Invoked, answers_in, invoked
from commands_started import hear, start, status
from desk import GAZE_JOINTS
from served_rigs import rig_files

from gazerig.config.save import save_rig
from gazerig.config.schema import load_rig
from gazerig.sim_mock.pty.client import PtyBus
from gazerig.sim_mock.smart_servo.physics import ServoSpec

pytestmark = pytest.mark.usefixtures("simulated_wires")


def calibrate(*words: str) -> Invoked:
    return invoked("calibrate", *words)


def calibrated(*words: str) -> Invoked:
    """Run a calibration that succeeds."""
    done = calibrate(*words)
    assert done.code == 0, done.err
    return done


@pytest.fixture
def rigs(tmp_path: Path) -> dict[str, str]:
    """Return the paths of rigs of one's own by kind."""
    return rig_files(tmp_path)


@pytest.fixture
def rig(rigs: dict[str, str]) -> Path:
    """Return a rig file of one's own."""
    return Path(rigs["desk"])


@pytest.fixture
def bus() -> Iterator[tuple[PtyBus, str]]:
    joints = load_rig("desk").joints
    with PtyBus() as served:
        specs = [ServoSpec(joints[name].id, joints[name].model) for name in GAZE_JOINTS]
        yield served, served.start(specs)


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


def test_by_motion_needs_no_answer_with_yes(rig: Path) -> None:
    near = {"joints.left_eye_tilt.min_deg": -2.0, "joints.left_eye_tilt.max_deg": 3.0}
    save_rig(rig, near, datetime(2026, 1, 1))
    words = ("--joint", "left_eye_tilt", "--by", "motion", "--margin", "1", "--yes", "--mock")
    done = calibrated(str(rig), *words)
    # The emulated stops are 4 deg beyond the range: -6..7.
    found = load_rig(str(rig)).joints["left_eye_tilt"]
    assert found.max_deg == pytest.approx(5.5, abs=0.5) and found.sign == 1
    assert found.min_deg == pytest.approx(-5.5, abs=0.5)
    assert len(re.findall(r"stop at step \d+, pushed for [1-4]?\d\d ms", done.err)) == 2


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


def test_a_hobby_joint_is_steered_and_its_places_are_written(
    rigs: dict[str, str], tmp_path: Path
) -> None:
    # Begin at the proposed pulse; straight ahead; left end, read as 9; right end; the rest agreed.
    words = ("", "+10", "-10", "", "1600", "", "9", "-170", "", "-6", "", "", "y")
    answers = answers_in(tmp_path, *words)
    path = rigs["maker"]
    done = calibrated(path, "--mock", "--joint", "eyes_pan", "--answers", answers)
    joint = load_rig(path).joints["eyes_pan"]
    places = dict(joint.transmission_points)
    assert places[0.0] == 1500.0 and places[9.0] == 1600.0 and places[-6.0] == 1430.0
    assert len(places) == 5
    assert (joint.min_deg, joint.max_deg) == (-4.0, 7.0)
    assert "[-6, 1430]" in Path(path).read_text("utf-8")
    assert "-6 deg: 1430" in done.out and "Keep your fingers out" in done.err
    assert list(tmp_path.glob("maker.yaml.bak-*"))


def test_a_lower_lid_s_ends_are_written_for_that_lid_alone(
    rigs: dict[str, str], tmp_path: Path
) -> None:
    before = load_rig(rigs["maker"]).lid_joints
    answers = answers_in(tmp_path, "", "1480", "", "3", "1560", "", "-5", "", "y")
    words = ("--mock", "--joint", "right_lower_lid", "--more", "0", "--pulses", "1400:1600")
    calibrated(rigs["maker"], *words, "--answers", answers)
    lids = load_rig(rigs["maker"]).lid_joints
    assert (lids.right_lower_shut_deg, lids.right_lower_open_deg) == (-5.0, 3.0)
    assert lids.left_lower_shut_deg == before.left_lower_shut_deg
    assert load_rig(rigs["maker"]).park_deg["right_lower_lid"] == -5.0


def test_an_sts_joint_is_calibrated_by_hand(rigs: dict[str, str], tmp_path: Path) -> None:
    answers = answers_in(tmp_path, "turn -150", "", "turn 330", "", "turn -160", "", "y")
    calibrated(rigs["feetech"], "--mock", "--joint", "neck_roll", "--answers", answers)
    joint = load_rig(rigs["feetech"]).joints["neck_roll"]
    assert joint.sign == -1 and joint.zero_step == pytest.approx(2068, abs=8)


def test_an_sts_joint_is_calibrated_by_motion(rigs: dict[str, str]) -> None:
    path = Path(rigs["feetech"])
    narrow = re.sub(
        r"(neck_roll:\n.*\n.*\n)    min_deg: -25.0\n    max_deg: 25.0",
        r"\1    min_deg: -3.0\n    max_deg: 4.0",
        path.read_text("utf-8"),
    )
    path.write_text(narrow, encoding="utf-8")
    words = ("--mock", "--joint", "neck_roll", "--by", "motion", "--yes", "--margin", "1")
    done = calibrated(str(path), *words)
    # The emulated stops are 4 deg beyond the range: -7..8.
    joint = load_rig(str(path)).joints["neck_roll"]
    assert joint.sign == 1 and joint.max_deg == pytest.approx(6.5, abs=0.7)
    assert "no watchdog" in done.err


def test_the_middle_of_an_sts_servo_can_be_set(rigs: dict[str, str], tmp_path: Path) -> None:
    words = ("turn 60", "", "turn 150", "", "turn -320", "", "turn 170", "", "n")
    answers = answers_in(tmp_path, *words)
    done = calibrated(rigs["feetech"], "--mock", "--joint", "neck_roll", "--set-middle",
               "--answers", answers)  # fmt: skip
    assert re.search(r"its place is 2048 now \(offset -?\d+\)", done.err)


def test_joints_of_several_buses_are_calibrated_in_one_go(
    rigs: dict[str, str], tmp_path: Path
) -> None:
    hobby = ("", "", "1560", "", "5", "1440", "", "-5")
    yaw = ("turn 150", "", "turn -300", "", "turn 150", "")
    pitch = ("turn -110", "", "turn 220", "", "turn -110", "")
    answers = answers_in(tmp_path, *hobby, *yaw, *pitch, "y")
    words = ["--joint", "eyes_tilt", "--joint", "neck_yaw", "--joint", "neck_pitch", "--more", "0"]
    words += ["--margin", "1", "--mock", "--answers", answers]
    calibrated(rigs["mixed"], *words)
    joints = load_rig(rigs["mixed"]).joints
    assert len(joints["eyes_tilt"].transmission_points) == 3
    assert joints["neck_yaw"].zero_step is not None and joints["neck_pitch"].sign == -1


def test_places_on_several_lines_are_refused_before_anything_moves(rigs: dict[str, str]) -> None:
    path = Path(rigs["maker"])
    text = path.read_text("utf-8")
    line = next(line for line in text.splitlines() if "[-24, 1801]" in line)
    spread = "    transmission_points:\n      - [-24, 1801]\n      - [0, 1510]\n      - [24, 1188]"
    path.write_text(text.replace(line, spread), encoding="utf-8")
    done = calibrate(str(path), "--mock", "--joint", "eyes_tilt")
    assert done.code == 2 and "spread over several lines" in done.err
    assert "gets no pulses" not in done.err


@pytest.mark.parametrize(
    ("kind", "words", "says"),
    [
        ("desk", ("--joint", "nose"), "no such joint; there is left_eye_pan"),
        ("desk", ("--port", "/dev/null"), "exclude each other"),
        ("desk", ("--answers", "/nowhere"), "No such file"),
        ("desk", ("--joint", "neck_yaw", "--answers", "EMPTY"), "no answer left to: turn neck_yaw"),
        ("desk", ("--joint", "neck_yaw", "--answers", "/dev/null"), "is a device"),
        ("maker", ("--by", "motion"), "hobby servos do not report their position"),
        ("maker", ("--pulses", "900"), "two pulse widths in us"),
        ("maker", ("--pulses", "400:2000"), "within 500:2500 us"),
        ("maker", ("--set-middle",), "only Feetech STS servos"),
        ("mixed", ("--set-middle", "--joint", "neck_yaw"), "only Feetech STS servos"),
        ("feetech", ("--set-middle", "--dry-run"), "exclude each other"),
        ("maker", ("--joint", "neck_yaw"), "no such joint; there is eyes_pan"),
        ("maker", ("--joint", "eyes_pan", "--answers", "EMPTY"), "no answer left to"),
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


@pytest.mark.pty
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
    assert not status(served.command, 1)["torque"] and rig.read_bytes() == before


# --- what is under calibrate, in every spelling


def test_help_lists_all() -> None:
    done = calibrate("--help")
    assert done.code == 0
    assert all(name in done.out for name in ("joints", "camera", "board", "face"))


@pytest.mark.parametrize(
    ("words", "shows"),
    [
        (("joints", "--help"), "--by"),
        (("my.yaml", "--help"), "--by"),
        (("--joint", "neck_yaw", "--help"), "--by"),
        (("camera", "--help"), "--what"),
        (("board", "--help"), "--paper"),
        (("face", "--help"), "--scene"),
        (("face", "my.yaml", "--help"), "--scene"),
    ],
)
def test_the_first_word_says_what(words: tuple[str, ...], shows: str) -> None:
    done = calibrate(*words)
    assert done.code == 0 and shows in done.out


NO_NOSE = "no such joint; there is left_eye_pan"


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--joint", "nose"), NO_NOSE),
        (("desk", "--joint", "nose"), NO_NOSE),
        (("joints", "--joint", "nose"), NO_NOSE),
        (("joints", "desk", "--joint", "nose"), NO_NOSE),
        (("--mock", "desk", "--joint", "nose"), NO_NOSE),
        # Without arguments: the shipped rig, which is never written.
        ((), "desk.yaml"),
        ((), "copy it"),
        (("nose",), "nothing named 'nose' is shipped"),
        (("board", "b.pdf", "--square", "60"), "does not fit on a4"),
        (
            ("camera", "desk", "--mock", "--dry-run", "--ruler", "0"),
            "the print scale must be 0.2 to 5",
        ),
    ],
)
def test_what_is_refused_is_said_with_and_without_the_word_joints(
    words: tuple[str, ...], says: str
) -> None:
    done = calibrate(*words)
    assert done.code == 2 and says in done.out + done.err


def test_a_rig_file_named_like_a_command_has_a_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("face").write_text("name: 1\n", encoding="utf-8")
    done = calibrate("./face", "--joint", "neck_yaw", "--dry-run")
    assert done.code == 2 and "profile: missing" in done.err


# --- a camera


@pytest.mark.parametrize("name", ["board.pdf", "board.png"])
def test_the_board_is_written(name: str, tmp_path: Path) -> None:
    out = tmp_path / name
    done = calibrated("board", str(out), "--paper", "letter")
    assert out.stat().st_size > 4000
    assert "print it at 100 % on letter" in done.out + done.err


def test_a_simulated_lens_is_measured_and_shown() -> None:
    done = calibrated("camera", "--mock", "--what", "lens", "--dry-run")
    assert "camera.lens.fx_px" in done.out + done.err
    assert "reprojection error 0." in done.out + done.err


def test_a_camera_on_the_base_has_no_place_on_the_head(tmp_path: Path) -> None:
    shipped = Path(__file__).parents[2] / "config" / "rigs" / "desk.yaml"
    rig = tmp_path / "rig.yaml"
    text = shipped.read_text(encoding="utf-8")
    rig.write_text(text.replace("mount: head ", "mount: base "), encoding="utf-8")
    done = calibrate("camera", str(rig), "--mock", "--dry-run")
    assert done.code == 2
    assert "use --what lens" in done.out + done.err
