"""Exports contain the measured values, and tools of other projects read the same."""

import csv
from collections import Counter
from collections.abc import Sequence
from math import acos, cos, degrees, radians, sin
from pathlib import Path

import numpy as np
import pytest
from desk import GAZE_JOINTS, LIDS
from fakes.runs import play, simulated
from gaze_targets import joints_at
from msgspec.structs import replace

from gazerig.drivers.errors import SetupError
from gazerig.gaze.angles import rotation
from gazerig.robot.loop.tick import Tick
from gazerig.robot.model.kinematics import GeometryParams, Kinematics
from gazerig.robot.recording.export_csv import EVENTS, SAMPLES, GazeExport

pytestmark = pytest.mark.usefixtures("ideal_servos")
SETTLED_S = 3.0  # at the start the guard lets the eyes follow the plan only slowly

Rows = list[dict[str, str]]


@pytest.fixture(scope="module")
def face() -> list[Tick]:
    """Twenty seconds in front of a person."""
    ticks: list[Tick] = []
    play(simulated(scene="face-to-face"), 20.0, ticks.append)
    return ticks


def export(ticks: Sequence[Tick], folder: Path) -> tuple[Rows, Rows, str]:
    """Return the samples, the events and the summary of an export."""
    made = GazeExport()
    for tick in ticks:
        made.update(tick)
    said = made.write(folder / "seen")
    samples, events = (
        list(csv.DictReader((folder / f"seen_{kind}.csv").open(newline="")))
        for kind in ("samples", "events")
    )
    return samples, events, said


def posed(
    tick: Tick, left_deg: tuple[float, float], right_deg: tuple[float, float], yaw: float
) -> Tick:
    """Return a tick with the eyes in the head, and the head's yaw."""
    kinematics = Kinematics(GeometryParams(60.0, 40.0, 50.0), GAZE_JOINTS, LIDS)
    degs = (*left_deg, *right_deg, 0.0, 0.0, yaw, 0.0, 0.0)
    return replace(tick, pose=kinematics.forward(joints_at([radians(deg) for deg in degs])))


def numbers(row: dict[str, str], *names: str) -> list[float]:
    return [float(row[name]) for name in names]


def test_left_and_up_are_positive_and_the_head_carries_the_eyes(face: list[Tick], tmp_path: Path):
    still = posed(face[0], (10.0, 5.0), (6.0, 5.0), 0.0)
    turned = posed(face[1], (10.0, 0.0), (6.0, 0.0), 20.0)
    # Right ear down: what is to its left is now above.
    pose = replace(
        still.pose, R_world_head=rotation((0.0, 0.0, radians(90.0))),
        eye_left_rad=(radians(7.0), 0.0), eye_right_rad=(radians(7.0), 0.0),
    )  # fmt: skip
    rows, _, _ = export((still, turned, replace(face[2], pose=pose)), tmp_path)
    assert numbers(rows[0], "left_x_deg", "left_y_deg") == pytest.approx([10.0, 5.0], abs=1e-5)
    assert numbers(rows[0], "right_x_deg", "right_y_deg") == pytest.approx([6.0, 5.0], abs=1e-5)
    assert numbers(rows[0], "x_deg", "y_deg") == pytest.approx([8.0, 5.0], abs=0.01)
    assert numbers(rows[1], "left_x_deg", "x_deg") == pytest.approx([30.0, 28.0], abs=1e-5)
    assert numbers(rows[2], "x_deg", "y_deg") == pytest.approx([0.0, 7.0], abs=1e-5)


def test_an_eye_whose_servo_is_silent_is_lost_and_only_that(face: list[Tick], tmp_path: Path):
    silent = ("left_eye_tilt",), ("neck_roll",), ("right_upper_lid",), ()
    ticks = [
        replace(tick, joints=replace(tick.joints, missing=missing))
        for tick, missing in zip(face[1000:], silent, strict=False)
    ]
    rows, _, _ = export(ticks, tmp_path)
    lost = {name: [row[name] == "" for row in rows] for name in SAMPLES}
    assert lost["left_x_deg"] == lost["x_deg"] == [True, True, False, False]
    assert lost["right_x_deg"] == lost["head_roll_deg"] == [False, True, False, False]
    assert lost["right_lid"] == [False, False, True, False] and not any(lost["left_lid"])


@pytest.fixture(scope="module")
def maker() -> list[Tick]:
    """Two seconds of a rig of six hobby servos without a neck."""
    ticks: list[Tick] = []
    play(simulated("maker"), 2.2, ticks.append)
    return ticks


def test_cells_of_joints_that_a_rig_lacks_are_empty(maker: list[Tick], tmp_path: Path):
    rows, _, _ = export(maker, tmp_path)
    assert {row["head_yaw_deg"] for row in rows} == {""}
    lower_right = maker[300].pose.lower_right
    assert float(rows[300]["right_lower_lid"]) == pytest.approx(lower_right, abs=6e-4)
    assert "" not in {row["x_deg"] for row in rows}


def test_a_linkage_without_an_answer_loses_both_eyes(maker: list[Tick], tmp_path: Path):
    silent = [
        replace(tick, joints=replace(tick.joints, missing=missing))
        for tick, missing in zip(
            maker[100:103], [("eyes_tilt",), ("right_lower_lid",), ()], strict=True
        )
    ]
    rows, _, _ = export(silent, tmp_path)
    for column in ("left_x_deg", "right_x_deg", "x_deg"):
        assert [row[column] == "" for row in rows] == [True, False, False]
    assert [row["right_lower_lid"] == "" for row in rows] == [False, True, False]


def test_a_row_a_sample_with_what_was_measured(face: list[Tick], tmp_path: Path):
    rows, events, _ = export(face, tmp_path)
    assert tuple(rows[0]) == SAMPLES and tuple(events[0]) == EVENTS and len(rows) == len(face)
    assert float(rows[2000]["time_s"]) == pytest.approx(face[2000].t_s - face[0].t_s, abs=1e-6)
    assert float(rows[2000]["left_lid"]) == pytest.approx(face[2000].pose.lid_left, abs=1e-6)
    assert {row["event"] for row in rows} == {"saccade", "fixation", "pursuit", "blink"}
    assert {row["target"] for row in rows} >= {face[2000].target.kind + f" {face[2000].target.id}"}


def test_every_saccade_and_blink_of_the_models_is_an_event(face: list[Tick], tmp_path: Path):
    rows, events, _ = export(face, tmp_path)
    last, found = face[-1].gaze, Counter(row["event"] for row in events)
    assert abs(found["saccade"] - last.saccades) <= 1 and found["saccade"] > 50
    assert abs(found["blink"] - last.blinks) <= 1 and found["blink"] > 5
    assert found["fixation"] > 40
    onsets = [float(row["onset_s"]) for row in events]
    assert onsets == sorted(onsets)
    times = [float(row["time_s"]) for row in rows]
    saccades = [row for row in events if row["event"] == "saccade"]
    for row in [one for one in saccades if float(one["onset_s"]) > SETTLED_S][5:10]:
        onset, lasts, size, peak = numbers(
            row, "onset_s", "duration_s", "amplitude_deg", "peak_deg_s"
        )
        first, last_row = np.searchsorted(times, [onset - 1e-5, onset + lasts - 0.0051])
        ends = [np.radians(numbers(rows[k], "x_deg", "y_deg")) for k in (first, last_row)]
        a, b = (np.array((cos(y) * cos(x), cos(y) * sin(x), sin(y))) for x, y in ends)
        assert size == pytest.approx(degrees(acos(a @ b)), abs=1e-4)
        assert peak > size / lasts
    assert {row["amplitude_deg"] for row in events if row["event"] == "blink"} == {""}


def test_the_plan_is_moved_by_the_lag_of_the_eyes(face: list[Tick], tmp_path: Path):
    later = [replace(b, pose=a.pose) for a, b in zip(face, face[4:], strict=False)]
    lags_ms = []
    for name, ticks in (("own", face), ("later", later)):
        (tmp_path / name).mkdir()
        *_, said = export(ticks, tmp_path / name)
        lags_ms.append(float(said.split("plan's, ")[1].split(" ms")[0]))
    assert 5.0 <= lags_ms[0] <= 30.0 and lags_ms[1] == pytest.approx(lags_ms[0] + 20.0)


@pytest.mark.parametrize("pitch_deg", [0.0, 60.0])
def test_a_gaze_that_is_up_turns_about_the_upright_axis_by_less(
    face: list[Tick], tmp_path: Path, pitch_deg: float
):
    """At 60 deg of pitch a degree of yaw is half a degree of gaze."""
    ticks = [
        posed(tick, (80.0 * (tick.t_s - face[0].t_s), pitch_deg),
              (80.0 * (tick.t_s - face[0].t_s), pitch_deg), 0.0)
        for tick in face[:60]
    ]  # fmt: skip
    events = export(ticks, tmp_path)[1]
    peak = max(float(row["peak_deg_s"]) for row in events if row["peak_deg_s"])
    assert peak == pytest.approx(80.0 * cos(radians(pitch_deg)), rel=1e-3)


def test_a_stopped_head_has_no_movement_and_one_tick_is_no_run(face: list[Tick], tmp_path: Path):
    rows, events, _ = export([replace(tick, stopped="hand") for tick in face[:20]], tmp_path)
    assert {row["event"] for row in rows} == {""} and not events
    with pytest.raises(SetupError, match="fewer than two ticks"):
        export(face[:1], tmp_path)
