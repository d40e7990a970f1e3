"""calibrate and what is under it, in every spelling."""

from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from gazerig.robot.cli.calibrate_group import app
from gazerig.robot.cli.main import app as whole


def run(*words: str) -> Any:
    return CliRunner().invoke(whole, ["calibrate", *words])


def test_help_lists_all() -> None:
    for done in (run("--help"), CliRunner().invoke(app, ["--help"])):
        assert done.exit_code == 0
        assert all(name in done.stdout for name in ("joints", "camera", "board", "face"))


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
    done = run(*words)
    assert done.exit_code == 0 and shows in done.stdout


@pytest.mark.parametrize(
    "words",
    [
        ("--joint", "nose"),
        ("desk", "--joint", "nose"),
        ("joints", "--joint", "nose"),
        ("joints", "desk", "--joint", "nose"),
        ("--mock", "desk", "--joint", "nose"),
    ],
)
def test_joints_with_and_without_their_name(words: tuple[str, ...]) -> None:
    done = run(*words)
    assert done.exit_code == 2 and "no such joint; there is left_eye_pan" in done.stderr


def test_nothing_said_is_the_joints_of_the_shipped_rig_which_is_never_written() -> None:
    done = run()
    assert done.exit_code == 2 and "desk.yaml" in done.stderr and "copy it" in done.stderr


def test_a_word_that_is_neither_command_nor_rig_is_said() -> None:
    done = run("nose")
    assert done.exit_code == 2 and "nothing named 'nose' is shipped" in done.stderr


def test_a_rig_file_named_like_a_command_has_a_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("face").write_text("name: 1\n", encoding="utf-8")
    done = run("./face", "--joint", "neck_yaw", "--dry-run")
    assert done.exit_code == 2 and "profile: missing" in done.stderr


def test_board_and_camera_are_reached(tmp_path: Path) -> None:
    out = tmp_path / "board.png"
    assert run("board", str(out)).exit_code == 0 and out.stat().st_size > 4000
    done = run("camera", "desk", "--mock", "--dry-run", "--ruler", "0")
    assert done.exit_code == 2 and "a printer scales by" in done.stderr
