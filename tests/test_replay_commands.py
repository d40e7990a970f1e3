"""The commands replay, rerun, compare and export on one recorded run."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fakes.runs import VISIT, record
from replayed_run import RATE_HZ, ticks_of
from typer.testing import CliRunner

from gazerig.config.schema import load_rig
from gazerig.robot.cli import replay as cli_replay
from gazerig.robot.dashboard.feed.page_process import decode_snapshot
from gazerig.robot.recording.gaze_angles import collect_gaze_angles
from gazerig.robot.recording.playback import SnapshotIndex
from gazerig.robot.recording.read import RunRecording

pytestmark = pytest.mark.usefixtures("branched_children", "ideal_servos")


# --- the commands


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of two seconds."""
    path = tmp_path_factory.mktemp("recorded") / "run.mcap"
    record(path, load_rig("desk"), 2.005, replace(VISIT, seed=0, scene="face-to-face"))
    return path


def said(*arguments: object) -> tuple[int, str]:
    done = CliRunner().invoke(cli_replay.app, [str(a) for a in arguments])
    return done.exit_code, done.output


def test_a_recording_exports_what_the_run_itself_would(recorded: Path) -> None:
    from_file = collect_gaze_angles(RunRecording(recorded).ticks())
    itself = collect_gaze_angles(ticks_of(2.0))
    assert len(from_file.time_s) == len(itself.time_s) > 350
    assert np.array_equal(from_file.cyclopean_deg, itself.cyclopean_deg)
    assert np.array_equal(from_file.movement, itself.movement) and from_file.names == itself.names


def test_a_replay_knows_how_the_recorded_rig_was_built(
    recorded: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    built = cli_replay._recorded_rig(RunRecording(recorded).info.config_yaml)
    recording = RunRecording(recorded)
    frames = SnapshotIndex(recording.ticks(), recording.frames(), RATE_HZ, "shy", built)
    shown = decode_snapshot(frames.message(frames.at(1.5)))
    assert shown.commanded_pose is not None and shown.character == "shy" and shown.trail
    assert cli_replay._recorded_rig("name: desk\n") is None
    assert "no longer valid (recorded.yaml" in capsys.readouterr().err


def test_a_replay_serves_a_page_and_ends(recorded: Path) -> None:
    code, words = said("replay", recorded, "--page", "127.0.0.1:18733", "--seconds", "0")
    assert code == 0 and "the page is starting" in words


def test_a_rerun_says_that_all_is_the_same(recorded: Path) -> None:
    code, words = said("replay", recorded, "--rerun")
    assert code == 0 and "joints recorded: " in words and "run again" in words
    reported = re.search(r"(\d+) of (\d+) ticks are bit-identical", words)
    assert reported is not None and reported[1] == reported[2] and int(reported[1]) > 350


def test_a_rerun_with_another_character_shows_both(recorded: Path) -> None:
    code, words = said("replay", recorded, "--rerun", "--character", "shy")
    assert code == 0 and "joints emulated: " in words and "saccades" in words


def test_figures_of_two_runs_stand_side_by_side() -> None:
    was = {"saccades": 3, "gaze_error_deg": {"median": 0.123456}, "events": [1, 2]}
    now = {"saccades": 4, "gaze_error_deg": {"median": None}, "blinks": 1}
    assert list(cli_replay.compare_figures(was, now)) == [
        ("saccades", "3", "4"), ("gaze error deg median", "0.1235", "-"),
        ("events", "2 of them", "-"), ("blinks", "-", "1"),
    ]  # fmt: skip


def test_export_writes_tables(recorded: Path, tmp_path: Path) -> None:
    code, words = said("export", recorded, "--csv", "--out", tmp_path / "seen")
    assert code == 0 and "saccades" in words
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "seen_events.csv", "seen_fixations.csv", "seen_samples.csv", "seen_samples.json",
    ]  # fmt: skip


def test_export_writes_a_data_set_and_not_twice(recorded: Path, tmp_path: Path) -> None:
    wanted = ("export", recorded, "--bids", "--out", tmp_path / "set")
    assert said(*wanted)[0] == 0
    assert (tmp_path / "set/sub-desk/beh").is_dir()
    code, words = said(*wanted)
    assert code == 2 and "choose another --subject or --task" in words
    assert said(*wanted, "--task", "again")[0] == 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("export", "run.mcap"), "one of --csv and --bids"),
        (("export", "run.mcap", "--csv", "--bids"), "one of --csv and --bids"),
        (("export", "run.mcap", "--csv", "--task", "t"), "name files of --bids"),
        (("replay", "run.mcap", "desk"), "need --rerun"),
        (("replay", "run.mcap", "--page", "8080"), "not HOST:PORT"),
        (("replay", "absent.mcap"), "absent.mcap"),
        (("export", "absent.mcap", "--csv"), "absent.mcap"),
    ],
)
def test_what_cannot_be_done_is_one_line(arguments: tuple[str, ...], words: str) -> None:
    code, output = said(*arguments)
    assert code == 2 and words in output and "Traceback" not in output
    assert len(output.strip().splitlines()) == 1
