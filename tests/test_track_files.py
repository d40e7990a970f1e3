"""Tracks from tables of animation programs."""

from math import pi
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from gazerig.config.allowed_folder import AllowedFolder
from gazerig.config.load import ConfigError
from gazerig.config.schema import load_rig
from gazerig.config.tracks import load_track
from gazerig.drivers.errors import SetupError
from gazerig.gaze.track.minimum_jerk_curve import MinimumJerkCurve
from gazerig.robot.app.track_file import TOLERANCE_DEG, read_table, track_text, write_track
from gazerig.robot.cli.tracks import app
from gazerig.robot.model.track_fit import fit_keys, smooth

DESK = load_rig("desk")


def table(folder: Path, text: str) -> Path:
    path = folder / "table.csv"
    path.write_text(text, encoding="utf-8")
    return path


WIDE = "time,neck_pitch,neck_yaw\n0,0,5\n0.5,-8,\n1.0,0,9\n"
LONG = "joint;time_s;angle\nneck_pitch;0;0\nneck_yaw;0;5\nneck_pitch;.5;-8\nneck_yaw;1;9\nneck_pitch;1;0\n"
FRAMES = "frame\tneck_pitch\tneck_yaw\n0\t0\t5\n12\t-8\t\n24\t0\t9\n"


@pytest.mark.parametrize("text", [WIDE, LONG, FRAMES])
def test_wide_and_long_tables_and_frame_numbers_are_the_same_track(
    text: str, tmp_path: Path
) -> None:
    found = track_text(DESK, read_table(table(tmp_path, text), 24.0), "x")
    path, fitted = write_track(DESK, "mine", found, tmp_path, False)
    assert [(f.time_s, f.head_pitch_deg, f.head_yaw_deg) for f in load_track(path).frames] == [
        (0.5, -8.0, None),
        (1.0, 0.0, 4.0),
    ]
    assert fitted.slowed_by == 1.0 and fitted.track.duration_s == pytest.approx(1.4)


BAD = {
    "": ":1: no column of times",
    "when,neck_yaw\n0,1\n": ":1: no column of times",
    "frame,neck_yaw\n0,1\n": "give --fps",
    "time,neck_yaw\n0,1\n0.5\n": ":3: has 1 columns, but the first row has 2",
    "time,neck_yaw\n0,1\n0.5,left\n": ":3: neck_yaw: 'left' is not a number",
    "time,neck_yaw\n0,1\n0.5,nan\n": ":3: neck_yaw: 'nan' is not a number",
    "time,neck_yaw\n0,1\n0.5,2\n0.4,3\n": ":4: neck_yaw: 0.4 s is not after 0.5 s",
    "time,neck_yaw\n-1,1\n": ":2: time -1 is before 0",
    "time,neck_yaw\n": "no rows",
    "time,tail\n0,1\n1,5\n": "no joint 'tail'; available: left_eye_pan",
    "time,neck_yaw\n0,1\n1,1\n": "nothing moves",
    "time,neck_yaw\n0,1\n99,5\n": "a track takes at most 60 s",
}


@pytest.mark.parametrize("text", BAD)
def test_bad_rows_are_named_with_their_line(text: str, tmp_path: Path) -> None:
    with pytest.raises(SetupError) as caught:
        track_text(DESK, read_table(table(tmp_path, text), None), "x")
    assert BAD[text] in str(caught.value)


def test_all_bad_rows_are_named_at_once(tmp_path: Path) -> None:
    rows = "\n".join(f"{t},x" for t in range(15))
    with pytest.raises(SetupError) as caught:
        read_table(table(tmp_path, f"time,neck_yaw\n{rows}\n"), None)
    assert str(caught.value).count("is not a number") == 10 and "and 5 more" in str(caught.value)


def test_the_command_imports_a_table_for_a_rig(tmp_path: Path) -> None:
    path = table(tmp_path, WIDE)
    words = ["desk", str(path), "greet", "--folder", str(tmp_path)]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0 and "greet.yaml: 1.4 s on desk" in done.stderr
    again = CliRunner().invoke(app, words)
    assert again.exit_code != 0 and "--force" in again.stderr
    wrong = CliRunner().invoke(app, [*words[:2], "Greet!", "--folder", str(tmp_path)])
    assert wrong.exit_code != 0 and "lower-case letters" in wrong.stderr


def test_a_motion_sampled_densely_becomes_few_keys_within_the_tolerance() -> None:
    random = np.random.default_rng(3)
    times = np.cumsum(random.uniform(0.015, 0.025, 200))
    truth = 12.0 * np.sin(2 * pi * 0.6 * times) * np.minimum(1.0, times)
    even, values_deg = smooth(times, truth + random.normal(0.0, 0.15, 200))
    found, values = fit_keys(even, values_deg, TOLERANCE_DEG)
    assert 4 <= len(found) <= 30
    curve = MinimumJerkCurve(float(values_deg[0]), found.tolist(), values.tolist())
    assert np.abs(curve.sample_at(even)[0] - values_deg).max() <= TOLERANCE_DEG
    assert np.abs(curve.sample_at(times - times[0])[0] - truth).max() < TOLERANCE_DEG + 0.6
    still = fit_keys(even, np.full(len(even), 3.0), TOLERANCE_DEG)
    assert len(still[0]) == 0


def test_a_page_names_track_files_in_its_folder_alone(tmp_path: Path) -> None:
    folder = AllowedFolder(tmp_path)
    folder.check_changes({"track_files": [str(tmp_path / "mine.yaml")]})
    with pytest.raises(ConfigError, match="track_files"):
        folder.check_changes({"track_files": [str(tmp_path / "mine.yaml"), "/etc/passwd.yaml"]})
