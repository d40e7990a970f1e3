"""Errors of users, in one line before a run begins; check and schema."""

import os
import re
from pathlib import Path

import pytest
from command_line import gazerig, typed

import gazerig as gazerig_package
from gazerig.config.faults import ConfigError

DESK = Path(__file__).parents[1] / "config" / "rigs" / "desk.yaml"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--mock", "--video", "nowhere.avi"), "nowhere.avi"),
        (("--mock", "--camera", "97"), "97"),
        (("--scene", "visitor"), "/dev/ttyUSB0"),
        (("--mock", "--oak"), "no OAK camera found"),
        (("--mock", "--scene", "visitor", "--video", "x.avi"), "exclude each other"),
        (("--mock", "--fast", "--video", "x.avi"), "--seconds"),
        (("--fast",), "--fast needs --mock"),
        (("--port", "/dev/ttyNOPE"), "no serial port /dev/ttyNOPE"),
        ((), "nothing to look at"),
        (("--mock", "--page", "8080"), "HOST:PORT"),
        (("nosuchrig", "--mock"), "nosuchrig"),
        (("--mock", "--profile", "giant"), "giant"),
    ],
)
def test_what_a_person_can_mend_is_one_line_and_exit_code_2(
    words: tuple[str, ...], message: str, capfd: pytest.CaptureFixture[str]
) -> None:
    code = typed("run", "--no-page", *words)
    one_line_and_exit_code_2(code, capfd.readouterr().err, message)


def test_a_name_that_is_not_shipped_is_refused_at_once() -> None:
    with pytest.raises(ConfigError, match="did you mean 'desk'"):
        gazerig_package.open("dessk")
    with pytest.raises(ConfigError, match="did you mean 'shy'"):
        gazerig_package.open("desk", character="shyy")


def test_an_unknown_key_of_a_joint_is_the_only_error(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path, text = tmp_path / "my.yaml", DESK.read_text(encoding="utf-8")
    path.write_text(text.replace("    zero_step:", "    zero_stepp:", 1), encoding="utf-8")
    assert typed("check", str(path)) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert "left_eye_pan.zero_stepp: unknown key; did you mean 'zero_step'" in line


MINIMAL = DESK.with_name("minimal.yaml")


def test_ranges_in_radians_get_a_hint(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path, text = tmp_path / "my.yaml", MINIMAL.read_text(encoding="utf-8")
    for degrees, radians in (("35", "1.57"), ("30", "0.52")):
        text = text.replace(f"min_deg: -{degrees}, max_deg: {degrees}",
                            f"min_deg: -{radians}, max_deg: {radians}")  # fmt: skip
    path.write_text(text, encoding="utf-8")
    assert typed("check", str(path)) == 0
    hint = "degrees? these look like radians"
    assert f"min_deg and max_deg of all joints: no angle is above 1.57: {hint}" in " ".join(
        capfd.readouterr().err.split()
    )
    # One joint with a usual range shows that they are degrees.
    path.write_text(text.replace("-0.52, max_deg: 0.52", "-30, max_deg: 30"), encoding="utf-8")
    assert typed("check", str(path)) == 0
    assert hint not in capfd.readouterr().err


def test_a_shell_sees_that_line_and_that_exit_code() -> None:
    done = gazerig("run", "--no-page", "--mock", "--scene", "circus", timeout=30)
    one_line_and_exit_code_2(done.returncode, done.stderr, "circus")


def one_line_and_exit_code_2(code: int, said: str, message: str) -> None:
    assert code == 2, said
    assert message in said
    assert len(said.strip().splitlines()) == 1, said
    assert "Traceback" not in said


@pytest.mark.skipif(os.geteuid() == 0, reason="root may open every port")
def test_a_port_without_rights_names_the_cure(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    port = tmp_path / "tty"
    port.touch(mode=0)
    text = DESK.read_text(encoding="utf-8")
    rig = tmp_path / "rig.yaml"
    rig.write_text(text.replace("/dev/ttyUSB0", str(port)), encoding="utf-8")
    assert typed("run", str(rig), "--scene", "visitor", "--no-page") == 2
    assert "dialout" in capfd.readouterr().err


def test_check(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
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


def test_a_track_in_radians_gets_a_hint(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path, track = tmp_path / "my.yaml", tmp_path / "turn.yaml"
    path.write_text(
        DESK.read_text(encoding="utf-8") + "\ntrack_files: [turn.yaml]\n", encoding="utf-8"
    )
    for yaw, hinted in ((0.35, True), (20.0, False)):
        frames = f"[{{time_s: 1, head_yaw_deg: {yaw}, head_pitch_deg: -0.1}}]"
        track.write_text(f"description: a turn\nframes: {frames}\n", encoding="utf-8")
        assert typed("check", str(path)) == 0
        said = capfd.readouterr().err
        assert ("turn.yaml: no angle is above 0.35: degrees?" in said) == hinted, said
