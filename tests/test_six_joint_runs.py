"""Runs of a rig of six hobby servos without a neck: recorded, done again, reported, exported."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace
from recorded_rigs import Run, recorded
from recorded_run import exact
from six_joints import SIX

from gazerig.config.schema import load_rig
from gazerig.robot.app.resimulate import rerun
from gazerig.robot.control.loop import Tick
from gazerig.robot.recording.export_csv import columns, write_csv
from gazerig.robot.recording.gaze_angles import collect_gaze_angles, find_intervals, label_samples

pytestmark = pytest.mark.usefixtures("ideal_servos")


@pytest.fixture(scope="module")
def maker(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return recorded(tmp_path_factory.mktemp("six") / "maker.mcap", load_rig("maker"), 4.2)


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return recorded(tmp_path_factory.mktemp("nine") / "desk.mcap", load_rig("desk"), 2.0)


# --- recordings


def test_six_joints_come_back_with_their_names(maker: Run) -> None:
    for tick in maker.recording.ticks():
        assert tick.guard_result.joints == SIX and tick.joints.measured == (False,) * 6
    shut = min(tick.pose.lower_left for tick in maker.ticks)
    assert shut < 0.9  # lower lids move, and are kept


def test_a_run_of_six_joints_is_done_again_to_the_bit(maker: Run) -> None:
    seen: list[Tick] = []
    found = rerun(maker.recording, on_tick=seen.append)
    assert found.is_same and found.sent_bytes_same and found.notes == ()
    assert list(map(exact, seen)) == list(map(exact, maker.ticks))
    assert rerun(maker.recording, joints="emulated").is_same


# --- exports


def test_tables_have_the_columns_of_the_joints_and_say_what_they_rest_on(
    maker: Run, desk: Run, tmp_path: Path
) -> None:
    for name, ticks, lids in (
        ("six", maker.ticks, ["left_lid", "right_lid", "left_lower_lid", "right_lower_lid"]),
        ("nine", desk.ticks, ["left_lid", "right_lid"]),
    ):
        trace = collect_gaze_angles(ticks)
        labels = label_samples(trace)
        samples, *_, beside = write_csv(
            trace, labels, find_intervals(trace, labels), tmp_path / name
        )
        with samples.open(newline="") as file:
            rows = list(csv.DictReader(file))
        assert tuple(rows[0]) == columns(ticks[0].guard_result.joints)
        assert [column for column in rows[0] if column.endswith("lid")] == lids
        assert ("head_yaw_deg" in rows[0]) == (name == "nine")
        assert float(rows[300][lids[-1]]) == pytest.approx(
            (ticks[300].pose.lower_right if name == "six" else ticks[300].pose.lid_right), abs=6e-4
        )
        assert "" not in {row["x_deg"] for row in rows}
        said = json.loads(beside.read_text())
        assert set(said["basis"].values()) == {"estimated" if name == "six" else "measured"}
        expected = list(SIX) if name == "six" else []
        assert said["estimated_joints"] == expected


def test_a_linkage_without_an_answer_loses_both_eyes(maker: Run) -> None:
    silent = [
        replace(tick, joints=replace(tick.joints, missing=missing))
        for tick, missing in zip(
            maker.ticks[100:103], [("eyes_tilt",), ("right_lower_lid",), ()], strict=True
        )
    ]
    trace = collect_gaze_angles(silent)
    for eye in (trace.left_deg, trace.right_deg, trace.cyclopean_deg):
        assert np.isnan(eye[:, 0]).tolist() == [True, False, False]
    assert np.isnan(trace.lower_lids).tolist() == [[False] * 2, [False, True], [False] * 2]
    assert np.isnan(trace.head_deg).all()  # there is no neck
