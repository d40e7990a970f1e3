"""The commands that calibrate a camera."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from gazerig.robot.cli.calibrate_camera import app

run = CliRunner().invoke


@pytest.mark.parametrize("name", ["board.pdf", "board.png"])
def test_the_board_is_written(name: str, tmp_path: Path) -> None:
    out = tmp_path / name
    result = run(app, ["calibrate-board", str(out), "--paper", "letter"])
    assert result.exit_code == 0, result.output
    assert out.stat().st_size > 4000
    assert "print it at 100 % on letter" in result.output


def test_a_board_too_large_is_refused(tmp_path: Path) -> None:
    result = run(app, ["calibrate-board", str(tmp_path / "b.pdf"), "--square", "60"])
    assert result.exit_code == 2
    assert "does not fit on a4" in result.output


def test_a_simulated_lens_is_measured_and_shown() -> None:
    result = run(app, ["calibrate-camera", "--mock", "--what", "lens", "--dry-run"])
    assert result.exit_code == 0, result.output
    assert "camera.lens.fx_px" in result.output
    assert "reprojection error 0." in result.output


def test_a_ruler_that_cannot_be_is_refused() -> None:
    result = run(app, ["calibrate-camera", "--mock", "--dry-run", "--ruler", "0"])
    assert result.exit_code == 2
    assert "a printer scales by 0.2 to 5" in result.output


def test_a_camera_on_the_base_has_no_place_on_the_head(tmp_path: Path) -> None:
    shipped = Path(__file__).parents[1] / "config" / "rigs" / "desk.yaml"
    rig = tmp_path / "rig.yaml"
    text = shipped.read_text(encoding="utf-8")
    rig.write_text(text.replace("mount: head ", "mount: base "), encoding="utf-8")
    result = run(app, ["calibrate-camera", str(rig), "--mock", "--dry-run"])
    assert result.exit_code == 2
    assert "use --what lens" in result.output
