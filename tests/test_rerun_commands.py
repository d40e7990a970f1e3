"""The commands rerun and export on one recorded run."""

import json
import re
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from fakes.runs import VISIT, play, record
from mcap.reader import make_reader
from typer.testing import CliRunner

from gazerig.config.schema import load_rig
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.session import compose
from gazerig.robot.app.session import run as run_composed
from gazerig.robot.cli import recordings
from gazerig.robot.control.loop import Tick
from gazerig.robot.recording.gaze_angles import collect_gaze_angles
from gazerig.robot.recording.read import RunRecording

pytestmark = pytest.mark.usefixtures("ideal_servos")


TALK = replace(VISIT, seed=0, scene="face-to-face")


# --- the commands


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of two seconds."""
    path = tmp_path_factory.mktemp("recorded") / "run.mcap"
    record(path, load_rig("desk"), 2.005, TALK)
    return path


def said(*arguments: object) -> tuple[int, str]:
    done = CliRunner().invoke(recordings.app, [str(a) for a in arguments])
    return done.exit_code, done.output


def test_a_recording_exports_what_the_run_itself_would(recorded: Path) -> None:
    from_file = collect_gaze_angles(RunRecording(recorded).ticks())
    ticks: list[Tick] = []
    play(assemble(load_rig("desk"), TALK), 2.005, ticks.append)
    itself = collect_gaze_angles(ticks)
    assert len(from_file.time_s) == len(itself.time_s) > 350
    assert np.array_equal(from_file.cyclopean_deg, itself.cyclopean_deg)
    assert np.array_equal(from_file.movement, itself.movement) and from_file.names == itself.names


def test_a_rerun_says_that_all_is_the_same(recorded: Path) -> None:
    code, words = said("rerun", recorded)
    assert code == 0 and "joints recorded: " in words and "run again" in words
    reported = re.search(r"(\d+) of (\d+) ticks are bit-identical", words)
    assert reported is not None and reported[1] == reported[2] and int(reported[1]) > 350


def test_a_rerun_with_another_character_shows_both(recorded: Path) -> None:
    code, words = said("rerun", recorded, "--character", "shy")
    assert code == 0 and "joints emulated: " in words and "saccades" in words


def test_a_viewer_reads_the_description_of_the_rig(tmp_path: Path) -> None:
    """Judged by the package of the file format, as Foxglove reads the file."""
    file = tmp_path / "run.mcap"
    options = replace(VISIT, rig="desk", scene="face-to-face", seconds=0.2, record=file)
    run_composed(compose(options), lambda: None, lambda line: None)
    with file.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        ((schema, _, message),) = reader.iter_messages(["/robot_description"])
        assert schema is not None and schema.encoding == "jsonschema" and schema.name
        assert json.loads(schema.data)["type"] == "object"
        robot = ElementTree.fromstring(json.loads(message.data)["data"])
        (_, _, state), *_ = reader.iter_messages(["/joint_states"])
    joints = {one.get("name") for one in robot.iter("joint")}
    assert {one["name"] for one in json.loads(state.data)["joints"]} <= joints


def test_figures_of_two_runs_stand_side_by_side() -> None:
    was = {"saccades": 3, "gaze_error_deg": {"median": 0.123456}, "events": [1, 2]}
    now = {"saccades": 4, "gaze_error_deg": {"median": None}, "blinks": 1}
    assert list(recordings.compare_figures(was, now)) == [
        ("saccades", "3", "4"), ("gaze error deg median", "0.1235", "-"),
        ("events", "2 of them", "-"), ("blinks", "-", "1"),
    ]  # fmt: skip


def test_export_writes_tables(recorded: Path, tmp_path: Path) -> None:
    code, words = said("export", recorded, "--out", tmp_path / "seen")
    assert code == 0 and "saccades" in words
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "seen_events.csv", "seen_fixations.csv", "seen_samples.csv", "seen_samples.json",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("rerun", "absent.mcap"), "absent.mcap"),
        (("export", "absent.mcap"), "absent.mcap"),
    ],
)
def test_what_cannot_be_done_is_one_line(arguments: tuple[str, ...], words: str) -> None:
    code, output = said(*arguments)
    assert code == 2 and words in output and "Traceback" not in output
    assert len(output.strip().splitlines()) == 1
