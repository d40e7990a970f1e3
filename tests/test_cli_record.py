"""Commands to record a camera, and their output."""

import pytest
from fakes.films import write_film
from typer.testing import CliRunner

from gazerig.drivers.camera.playback import Recording
from gazerig.robot.cli.record import app


@pytest.fixture
def film(tmp_path):
    path = tmp_path / "film.avi"
    return write_film(path, rate_hz=50.0)


def run(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


def test_film_is_recorded_and_can_be_read(film, tmp_path):
    out = tmp_path / "seen.mcap"
    done = run(out, "--video", film, "--seconds", 0.1)
    assert done.exit_code == 0, done.output
    recording = Recording(out)
    assert recording.note == ""
    assert f"{len(recording.times_s)} frames (" in done.output
    assert recording.shot(0).image.shape == (48, 64, 3)


def test_existing_file_is_kept(film, tmp_path):
    out = tmp_path / "seen.mcap"
    out.write_text("precious")
    done = run(out, "--video", film, "--seconds", 0)
    assert (done.exit_code, out.read_text()) == (2, "precious")
    assert "already exists" in done.output
    assert run(out, "--video", film, "--seconds", 0, "--force", "--jpeg", 80).exit_code == 0


@pytest.mark.parametrize(
    "sources", [[], ["--oak", "--camera", "0"], ["--camera", "0", "--video", "x"]]
)
def test_one_source_must_be_named(tmp_path, sources):
    done = run(tmp_path / "seen.mcap", *sources)
    assert done.exit_code == 2
    assert "one of --oak, --camera N and --video FILE" in done.output


def test_absent_camera_leaves_no_file(tmp_path):
    out = tmp_path / "seen.mcap"
    done = run(out, "--camera", 9871)
    assert done.exit_code == 2 and "no camera at /dev/video9871" in done.output
    assert not out.exists()
