"""The commands rerun and export on one recorded run."""

import csv
import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest
from fakes.runs import VISIT, play, record, simulated
from mcap.reader import make_reader
from msgspec import structs
from typer.testing import CliRunner

from gazerig.config.schema import load_rig
from gazerig.robot.cli import recordings
from gazerig.robot.loop.loop import Tick
from gazerig.robot.recording.export_csv import GazeExport
from gazerig.robot.run.run import Run
from gazerig.robot.run.session import Session

pytestmark = pytest.mark.usefixtures("ideal_servos")


TALK = replace(VISIT, seed=0, scene="face-to-face")


# --- the commands


@pytest.fixture(scope="module")
def run_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of two seconds."""
    path = tmp_path_factory.mktemp("recorded") / "run.mcap"
    record(path, load_rig("desk"), 2.005, TALK)
    return path


def said(*arguments: object) -> tuple[int, str]:
    done = CliRunner().invoke(recordings.app, [str(a) for a in arguments])
    return done.exit_code, done.output


def test_a_rerun_says_that_all_is_the_same(run_file: Path):
    code, words = said("rerun", run_file)
    assert code == 0
    reported = re.search(r"(\d+) of (\d+) ticks are bit-identical", words)
    assert reported is not None and reported[1] == reported[2] and int(reported[1]) > 350


def test_a_viewer_reads_the_description_of_the_rig(tmp_path: Path):
    """Judged by the package of the file format, as Foxglove reads the file."""
    file = tmp_path / "run.mcap"
    options = replace(VISIT, rig="desk", scene="face-to-face", seconds=0.2, record=file)
    Session(Run(load_rig("desk"), options), lambda: None, lambda line: None).run()
    with file.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        ((schema, _, message),) = reader.iter_messages(["/robot_description"])
        assert schema is not None and schema.encoding == "jsonschema" and schema.name
        assert json.loads(schema.data)["type"] == "object"
        robot = ElementTree.fromstring(json.loads(message.data)["data"])
        (_, _, state), *_ = reader.iter_messages(["/joint_states"])
    joints = {one.get("name") for one in robot.iter("joint")}
    assert {one["name"] for one in json.loads(state.data)["joints"]} <= joints


@pytest.fixture(scope="module")
def maker() -> list[Tick]:
    """Two seconds of a rig of six hobby servos without a neck."""
    ticks: list[Tick] = []
    play(simulated("maker"), 2.2, ticks.append)
    return ticks


# --- exports


def table(ticks: Sequence[Tick], stem: Path) -> list[dict[str, str]]:
    """Return the samples that an export of ticks writes."""
    export = GazeExport()
    for tick in ticks:
        export.update(tick)
    export.write(stem)
    with stem.with_name(f"{stem.name}_samples.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def test_cells_of_joints_that_a_rig_lacks_are_empty(maker: list[Tick], tmp_path: Path):
    rows = table(maker, tmp_path / "six")
    assert {row["head_yaw_deg"] for row in rows} == {""}
    lower_right = maker[300].pose.lower_right
    assert float(rows[300]["right_lower_lid"]) == pytest.approx(lower_right, abs=6e-4)
    assert "" not in {row["x_deg"] for row in rows}


def test_a_linkage_without_an_answer_loses_both_eyes(maker: list[Tick], tmp_path: Path):
    silent = [
        structs.replace(tick, joints=structs.replace(tick.joints, missing=missing))
        for tick, missing in zip(
            maker[100:103], [("eyes_tilt",), ("right_lower_lid",), ()], strict=True
        )
    ]
    rows = table(silent, tmp_path / "silent")
    for column in ("left_x_deg", "right_x_deg", "x_deg"):
        assert [row[column] == "" for row in rows] == [True, False, False]
    assert [row["right_lower_lid"] == "" for row in rows] == [False, True, False]
