"""Exports say what was measured, and tools that others wrote read them and see the same."""

import csv
import gzip
import json
import shutil
import subprocess
from collections import Counter
from collections.abc import Sequence
from math import cos, degrees, radians, sin
from pathlib import Path

import numpy as np
import pytest
from desk import GAZE_JOINTS, LIDS
from present import present

from gazerig.config.schema import load_rig
from gazerig.drivers.errors import SetupError
from gazerig.gaze.angles import rotation
from gazerig.gaze.types import GazeState
from gazerig.robot.analysis.eye_tracker_csv import FixationTable, read_recording
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.loop import Tick, run
from gazerig.robot.model.commands import Jog, Stop
from gazerig.robot.model.kinematics import GeometryParams, Kinematics
from gazerig.robot.model.types import JointState
from gazerig.robot.recording.export_bids import DatasetDescription, label_of, write_bids
from gazerig.robot.recording.export_csv import EVENTS, columns, write_csv
from gazerig.robot.recording.gaze_angles import GazeAngles, in_space, trace_of
from gazerig.robot.recording.gaze_labels import (
    LabelledInterval,
    Labels,
    labels_of,
    lag_of,
    stretches_of,
)

pytestmark = pytest.mark.usefixtures("ideal_servos")

RATE_HZ = 200.0
SETTLED_S = 3.0  # at the start the guard lets the eyes follow the plan only slowly
ABOUT = DatasetDescription(
    "desk", "face-to-face", RATE_HZ, "2026-01-01T00:00:00+00:00", "gazerig 0"
)


def seen(scene: str, seconds: float) -> list[Tick]:
    """Run a simulated head and give its ticks."""
    made = assemble(load_rig("desk"), RunOptions(mock=True, fast=True, seed=0, scene=scene))
    ticks: list[Tick] = []
    made.robot.start(made.clock)
    try:
        run(made.robot, made.clock, made.loop, lambda s: "over" if s > seconds else None,
            ticks.append)  # fmt: skip
    finally:
        made.robot.stop()
        made.close()
    return ticks


class Run:
    """One run with all that is made of it."""

    def __init__(self, ticks: Sequence[Tick]) -> None:
        self.ticks = ticks
        self.trace: GazeAngles = trace_of(ticks)
        self.labels: Labels = labels_of(self.trace)
        self.stretches: tuple[LabelledInterval, ...] = stretches_of(self.trace, self.labels)

    def onsets_s(self, event: str) -> np.ndarray:
        return np.array([s.onset_s for s in self.stretches if s.event == event])


@pytest.fixture(scope="module")
def face() -> Run:
    """Twenty-five seconds in front of somebody."""
    return Run(seen("face-to-face", 25.0))


def pose(left_deg: tuple[float, float], right_deg: tuple[float, float], yaw: float) -> GazeState:
    """Eyes in the head, and the head's yaw."""
    kinematics = Kinematics(GeometryParams(60.0, 40.0, 50.0), GAZE_JOINTS, LIDS)
    degs = (*left_deg, *right_deg, 0.0, 0.0, yaw, 0.0, 0.0)
    return kinematics.forward(JointState(tuple(map(radians, degs)), (0.0,) * 9, (0.0,) * 9, ()))


# --- angles


def test_left_and_up_are_positive_and_the_head_carries_the_eyes() -> None:
    still = in_space(pose((10.0, 5.0), (6.0, 5.0), 0.0))
    assert still.left_deg == pytest.approx((10.0, 5.0))
    assert still.right_deg == pytest.approx((6.0, 5.0))
    assert still.cyclopean_deg == pytest.approx((8.0, 5.0), abs=0.01)
    turned = in_space(pose((10.0, 0.0), (6.0, 0.0), 20.0))
    assert turned.left_deg == pytest.approx((30.0, 0.0))
    assert turned.cyclopean_deg == pytest.approx((28.0, 0.0))


def test_a_rolled_head_turns_what_is_sideways_into_what_is_up() -> None:
    level = pose((0.0, 0.0), (0.0, 0.0), 0.0)
    # Right ear down: what is to its left is now above.
    rolled = level._replace(
        R_world_head=rotation((0.0, 0.0, radians(90.0))),
        eye_left_rad=(radians(7.0), 0.0),
        eye_right_rad=(radians(7.0), 0.0),
    )
    assert in_space(rolled).cyclopean_deg == pytest.approx((0.0, 7.0), abs=1e-9)


def test_an_eye_whose_servo_is_silent_is_lost_and_only_that(face: Run) -> None:
    tick = face.ticks[1000]
    silent = [
        tick._replace(joints=tick.joints._replace(missing=missing), t_s=tick.t_s + 0.005 * k)
        for k, missing in enumerate([("left_eye_tilt",), ("neck_roll",), ("right_upper_lid",), ()])
    ]
    trace = trace_of(silent)
    assert np.isnan(trace.left_deg[:, 0]).tolist() == [True, True, False, False]
    assert np.isnan(trace.right_deg[:, 0]).tolist() == [False, True, False, False]
    assert np.isnan(trace.cyclopean_deg[:, 0]).tolist() == [True, True, False, False]
    assert np.isnan(trace.head_deg[:, 0]).tolist() == [False, True, False, False]
    assert np.isnan(trace.lids).tolist() == [[False] * 2] * 2 + [[False, True], [False] * 2]


def test_fewer_than_two_ticks_are_nothing_to_export(face: Run) -> None:
    with pytest.raises(ValueError, match="fewer than two ticks"):
        trace_of(face.ticks[:1])


# --- labels


def test_every_saccade_and_blink_of_the_models_is_a_stretch(face: Run) -> None:
    last = face.ticks[-1].gaze
    found = Counter(s.event for s in face.stretches)
    assert abs(found["saccade"] - last.saccades) <= 1 and found["saccade"] > 50
    assert abs(found["blink"] - last.blinks) <= 1 and found["blink"] > 5
    assert found["fixation"] > 40


def test_movements_leave_no_gap_and_do_not_overlap(face: Run) -> None:
    moves = [s for s in face.stretches if s.event != "blink"]
    ends = np.array([s.onset_s + s.duration_s for s in moves])
    assert np.allclose(ends[:-1], [s.onset_s for s in moves[1:]], atol=1e-9)


def test_the_plan_is_moved_by_the_lag_of_the_eyes(face: Run) -> None:
    assert 0.005 <= lag_of(face.trace) <= 0.03
    seen = face.trace.cyclopean_deg  # what is rolled over the end would be a leap at the start
    later = face.trace._replace(
        cyclopean_deg=np.vstack((np.repeat(seen[:1], 4, axis=0), seen[:-4]))
    )
    assert lag_of(later) == pytest.approx(lag_of(face.trace) + 0.02, abs=0.0021)


def test_amplitudes_are_measured(face: Run) -> None:
    saccades = [s for s in face.stretches if s.event == "saccade" and s.onset_s > SETTLED_S]
    for s in saccades[5:10]:
        at = face.trace.time_s
        ends = np.searchsorted(at, [s.onset_s, s.onset_s + s.duration_s - 0.0051])
        (xa, ya), (xb, yb) = np.radians(face.trace.cyclopean_deg[ends])
        a, b = (np.array((cos(y) * cos(x), cos(y) * sin(x), sin(y))) for x, y in
                ((xa, ya), (xb, yb)))  # fmt: skip
        assert s.amplitude_deg == pytest.approx(degrees(np.arccos(a @ b)), abs=1e-6)
        assert s.peak_deg_s is not None and s.peak_deg_s > present(s.amplitude_deg) / present(
            s.duration_s
        )
    none_deg = [s.amplitude_deg for s in face.stretches if s.event == "blink"]
    assert set(none_deg) == {None}


def test_what_is_looked_at_changes_only_with_the_gaze(face: Run) -> None:
    looked_at, movement = face.labels.looked_at, face.labels.movement
    changes = np.flatnonzero(np.diff(looked_at)) + 1
    assert len(changes) > 40
    assert np.mean(movement[changes] == 2) > 0.9  # with the first sample of a saccade
    parts = {face.trace.names[k].part for k in looked_at}
    assert {"LE", "RE", "N"} <= parts


def test_what_hands_do_is_no_eye_movement(face: Run) -> None:
    ticks = list(face.ticks[1000:1600])
    ticks[100] = ticks[100]._replace(commands=(Jog((("neck_yaw", 0.1),)),))
    ticks[200] = ticks[200]._replace(commands=(Jog(()),))
    ticks[300] = ticks[300]._replace(commands=(Stop("hand"),))
    ticks[300:400] = [tick._replace(stopped="hand") for tick in ticks[300:400]]
    trace = trace_of(ticks)
    assert (trace.movement[100:200] == 0).all() and (trace.movement[300:400] == 0).all()
    assert (trace.movement[200:300] > 0).all() and (trace.movement[400:] > 0).all()
    assert [words for _, words in trace.messages if words.startswith("asked: ")] == [
        "asked: jog angles_rad=(('neck_yaw', 0.1),)", "asked: jog angles_rad=()",
        "asked: stop why=hand",
    ]  # fmt: skip


# --- tables


@pytest.fixture(scope="module")
def tables(face: Run, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, ...]:
    """The three tables of a run."""
    stem = tmp_path_factory.mktemp("csv") / "seen"
    return write_csv(face.trace, face.labels, face.stretches, stem)


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_a_row_a_sample_with_what_was_measured(face: Run, tables: tuple[Path, ...]) -> None:
    assert [path.name for path in tables] == [
        "seen_samples.csv", "seen_events.csv", "seen_fixations.csv", "seen_samples.json",
    ]  # fmt: skip
    read = rows(tables[0])
    assert tuple(read[0]) == columns(GAZE_JOINTS) and len(read) == len(face.ticks)
    tick, row = face.ticks[2000], read[2000]
    space = in_space(tick.pose)
    assert float(row["left_x_deg"]) == pytest.approx(space.left_deg[0], abs=6e-5)
    assert float(row["right_y_deg"]) == pytest.approx(space.right_deg[1], abs=6e-5)
    assert float(row["x_deg"]) == pytest.approx(space.cyclopean_deg[0], abs=6e-5)
    assert float(row["head_yaw_deg"]) == pytest.approx(degrees(tick.pose.head_rad[0]), abs=6e-5)
    assert float(row["left_lid"]) == pytest.approx(tick.pose.lid_left, abs=6e-4)
    assert {row["event"] for row in read} == {"saccade", "fixation", "pursuit", "blink"}
    assert {row["movement"] for row in read} == {"saccade", "fixation", "pursuit"}


def test_a_lost_eye_is_an_empty_cell(face: Run, tmp_path: Path) -> None:
    tick = face.ticks[500]
    lost = tick._replace(joints=tick.joints._replace(missing=("left_eye_pan",)), t_s=tick.t_s + 0.1)
    blind = Run([tick, lost])
    row = rows(write_csv(blind.trace, blind.labels, blind.stretches, tmp_path / "b")[0])[1]
    assert (row["left_x_deg"], row["x_deg"]) == ("", "") and row["right_x_deg"] != ""


def test_the_events_table_has_each_stretch_once(face: Run, tables: tuple[Path, ...]) -> None:
    read = rows(tables[1])
    assert tuple(read[0]) == EVENTS and len(read) == len(face.stretches)
    assert Counter(row["event"] for row in read) == Counter(s.event for s in face.stretches)


def test_the_fixations_are_what_fit_scanpath_reads(face: Run, tables: tuple[Path, ...]) -> None:
    table = read_recording(tables[2])
    assert isinstance(table, FixationTable) and table.labelled
    stays = [row for row in table.rows if row.part is not None]
    assert len(stays) > 40
    # Stays follow each other: nobody counts one look twice.
    ends = [row.start_s + row.duration_s for row in table.rows]
    assert all(end <= row.start_s + 1e-6 for end, row in zip(ends, table.rows[1:], strict=False))
    # All of the run's time that is no saccade is a stay.
    jumping_s = sum(s.duration_s for s in face.stretches if s.event == "saccade")
    assert sum(row.duration_s for row in table.rows) + jumping_s == pytest.approx(
        face.trace.time_s[-1] + 0.005, abs=0.01
    )


# --- pymovements judges


def judged(path: Path, columns: list[str]):
    """Open the samples as a laboratory would."""
    pymovements = pytest.importorskip("pymovements")
    gaze = pymovements.gaze.from_csv(
        path,
        experiment=pymovements.Experiment(1920, 1080, 60, 34, 65, "center", RATE_HZ),
        time_column="time_s",
        time_unit="s",
        position_columns=columns,
    )
    # A servo's step in one tick is 17.6 deg/s: seven samples smooth that.
    gaze.pos2vel("savitzky_golay", window_length=7, degree=2)
    return gaze


def test_pymovements_finds_the_same_saccades(face: Run, tables: tuple[Path, ...]) -> None:
    gaze = judged(tables[0], ["x_deg", "y_deg"])
    gaze.detect("microsaccades", threshold=(30.0, 30.0), threshold_factor=1, minimum_duration=15)
    theirs = gaze.events.frame.select("onset", "offset").to_numpy()[:, 0] / 1e3
    ours = face.onsets_s("saccade")
    theirs, ours = theirs[theirs > SETTLED_S], ours[ours > SETTLED_S]
    assert len(ours) > 40
    apart = np.abs(theirs[None, :] - ours[:, None])
    assert np.mean(apart.min(axis=1) <= 0.015) >= 0.97
    assert np.mean(apart.min(axis=0) <= 0.015) >= 0.97
    # And it is the onsets that agree: 40 ms later there is none.
    assert np.mean(np.abs(theirs[None, :] - ours[:, None] - 0.04).min(axis=1) <= 0.01) < 0.1


def test_pymovements_ivt_fixates_where_we_do(face: Run, tables: tuple[Path, ...]) -> None:
    gaze = judged(tables[0], ["x_deg", "y_deg"])
    gaze.detect("ivt", velocity_threshold=40.0, minimum_duration=100)
    inside = np.zeros(len(face.ticks), bool)
    for onset, offset in gaze.events.frame.select("onset", "offset").iter_rows():
        inside[round(onset / 5) : round(offset / 5) + 1] = True
    settled = face.trace.time_s > SETTLED_S
    assert np.mean(inside[settled & (face.labels.movement != 2)]) > 0.97
    jumping = settled & (face.labels.movement == 2)
    assert np.mean(inside[jumping]) < 0.5  # its slow beginning and end are below the threshold


def test_pymovements_takes_both_eyes_and_the_cyclopean(tables: tuple[Path, ...]) -> None:
    eyes = [f"{eye}_{axis}_deg" for eye in ("left", "right") for axis in "xy"]
    gaze = judged(tables[0], [*eyes, "x_deg", "y_deg"])
    assert gaze.n_components == 6
    position = np.array(gaze.samples["position"].to_list())
    # Eyes converge on somebody in front: the left one looks further to the right.
    assert np.median(position[:, 2] - position[:, 0]) > 1.0
    assert np.allclose(position[:, 4], (position[:, 0] + position[:, 2]) / 2, atol=0.1)


# --- BIDS


@pytest.fixture(scope="module")
def bids(face: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same run as a data set."""
    root = tmp_path_factory.mktemp("bids")
    write_bids(face.trace, face.labels, face.stretches, ABOUT, root)
    return root


def table(path: Path) -> list[list[str]]:
    """Lines of a compressed table."""
    with gzip.open(path, "rt", encoding="utf-8") as file:
        return [line.rstrip("\n").split("\t") for line in file]


def test_a_data_set_has_its_files(bids: Path) -> None:
    files = {str(path.relative_to(bids)) for path in bids.rglob("*") if path.is_file()}
    stem = "sub-desk/beh/sub-desk_task-facetoface_recording-eye"
    assert files == {
        "dataset_description.json", "README.md", "participants.tsv", "participants.json",
        *(f"{stem}{k}_{kind}" for k in (1, 2, 3) for kind in
          ("physio.tsv.gz", "physio.json", "physioevents.tsv.gz", "physioevents.json")),
    }  # fmt: skip
    assert json.loads((bids / "dataset_description.json").read_text())["BIDSVersion"] == "1.11.1"
    assert (bids / "participants.tsv").read_text() == "participant_id\tspecies\nsub-desk\trobot\n"


@pytest.mark.parametrize(("eye", "recorded"), [(1, "left"), (2, "right"), (3, "cyclopean")])
def test_a_recording_is_headerless_and_even(face: Run, bids: Path, eye: int, recorded: str) -> None:
    stem = bids / f"sub-desk/beh/sub-desk_task-facetoface_recording-eye{eye}_physio"
    sidecar = json.loads(stem.with_suffix(".json").read_text())
    assert sidecar["PhysioType"] == "eyetrack" and sidecar["RecordedEye"] == recorded
    assert sidecar["SamplingFrequency"] == RATE_HZ and sidecar["StartTime"] == 0.0
    assert sidecar["SampleCoordinateSystem"] == "gaze-in-world"
    columns = sidecar["Columns"]
    assert columns[:3] == ["timestamp", "x_coordinate", "y_coordinate"]
    assert {sidecar[name]["Units"] for name in columns[1:3]} == {"deg"}
    lines = table(stem.with_suffix(".tsv.gz"))
    assert {len(line) for line in lines} == {len(columns)} and len(lines) == len(face.ticks)
    space = in_space(face.ticks[700].pose)
    assert float(lines[700][1]) == pytest.approx(space[eye - 1][0], abs=6e-5)


def test_events_are_indexed_by_the_timestamps(face: Run, bids: Path) -> None:
    stem = bids / "sub-desk/beh/sub-desk_task-facetoface_recording-eye3_physioevents"
    sidecar = json.loads(stem.with_suffix(".json").read_text())
    assert sidecar["OnsetSource"] == "timestamp" and sidecar["Columns"][0] == "onset"
    lines = table(stem.with_suffix(".tsv.gz"))
    assert {len(line) for line in lines} == {len(sidecar["Columns"])}
    kinds = Counter(line[2] for line in lines)
    assert kinds["saccade"] == len(face.onsets_s("saccade"))
    assert kinds["n/a"] == len(face.trace.messages) > 0
    onsets = [float(line[0]) for line in lines]
    assert onsets == sorted(onsets)
    assert {"LE", "RE"} <= {line[sidecar["Columns"].index("part")] for line in lines}


def test_a_missed_slot_is_a_row_without_values(face: Run, tmp_path: Path) -> None:
    ticks = [*face.ticks[1000:1010], *face.ticks[1013:1020]]
    gap = Run(ticks)
    write_bids(gap.trace, gap.labels, gap.stretches, ABOUT, tmp_path)
    (path,) = tmp_path.rglob("*eye1_physio.tsv.gz")
    lines = table(path)
    assert len(lines) == 20
    assert [line[1] == "n/a" for line in lines] == [10 <= k < 13 for k in range(20)]
    assert np.diff([float(line[0]) for line in lines]) == pytest.approx(0.005, abs=2e-6)


def test_a_second_run_joins_the_data_set_and_none_is_written_over(
    face: Run, tmp_path: Path
) -> None:
    short = Run(face.ticks[:50])
    write_bids(short.trace, short.labels, short.stretches, ABOUT, tmp_path)
    with pytest.raises(SetupError, match="another --subject or --task"):
        write_bids(short.trace, short.labels, short.stretches, ABOUT, tmp_path)
    other = ABOUT._replace(subject="stage rig")
    write_bids(short.trace, short.labels, short.stretches, other, tmp_path)
    participants = (tmp_path / "participants.tsv").read_text().splitlines()
    assert participants[1:] == ["sub-desk\trobot", "sub-stagerig\trobot"]


def test_the_same_run_gives_the_same_bytes(face: Run, tmp_path: Path) -> None:
    short = Run(face.ticks[:50])
    for name in "ab":
        write_bids(short.trace, short.labels, short.stretches, ABOUT, tmp_path / name)
    for path in (tmp_path / "a").rglob("*.gz"):
        twin = tmp_path / "b" / path.relative_to(tmp_path / "a")
        assert path.read_bytes() == twin.read_bytes()


def test_labels_are_letters_and_digits() -> None:
    assert label_of("face-to-face 2") == "facetoface2" and label_of("--") == "unnamed"


def test_the_official_validator_has_nothing_to_say_against_it(bids: Path) -> None:
    program = shutil.which("bids-validator-deno")
    if program is None:
        pytest.skip("no bids-validator-deno in the path: pip install bids-validator-deno")
    done = subprocess.run(
        [program, "--format", "json", "--max-rows", "-1", str(bids)],
        capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    issues = json.loads(done.stdout)["issues"]["issues"]
    assert [issue for issue in issues if issue.get("severity") == "error"] == []
    assert any(issue["severity"] == "warning" for issue in issues)  # it did look


def test_numbers_that_are_none_are_not_written() -> None:
    from gazerig.robot.recording.export_csv import number

    assert number(None) == "" and number(float("nan")) == "" and number(1.25, 1) == "1.2"
