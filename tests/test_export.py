"""Exports contain the measured values, and tools of other projects read the same."""

import csv
from collections import Counter
from collections.abc import Sequence
from math import cos, degrees, radians, sin
from pathlib import Path

import numpy as np
import pytest
from desk import GAZE_JOINTS, LIDS
from fakes.runs import play, simulated
from gaze_targets import joints_at
from msgspec.structs import replace
from present import present

from gazerig.gaze.angles import rotation
from gazerig.gaze.types import GazeState
from gazerig.robot.loop.tick import Tick
from gazerig.robot.model.commands import Jog, Stop
from gazerig.robot.model.kinematics import GeometryParams, Kinematics
from gazerig.robot.recording.export_csv import columns, write_csv
from gazerig.robot.recording.gaze_angles import (
    MOVEMENTS,
    GazeAngles,
    GazeTarget,
    LabelledInterval,
    Labels,
    collect_gaze_angles,
    estimate_lag,
    find_intervals,
    gaze_in_space,
    label_samples,
    speed_deg_s,
)


def seen(scene: str, seconds: float) -> list[Tick]:
    """Run a simulated head and give its ticks."""
    made = simulated(scene=scene)
    ticks: list[Tick] = []
    play(made, seconds, ticks.append)
    return ticks


class Run:
    """One run with all that is made of it."""

    def __init__(self, ticks: Sequence[Tick]) -> None:
        self.ticks = ticks
        self.trace: GazeAngles = collect_gaze_angles(ticks)
        self.labels: Labels = label_samples(self.trace)
        self.stretches: tuple[LabelledInterval, ...] = find_intervals(self.trace, self.labels)


pytestmark = pytest.mark.usefixtures("ideal_servos")
SETTLED_S = 3.0  # at the start the guard lets the eyes follow the plan only slowly


@pytest.fixture(scope="module")
def face() -> Run:
    """Twenty-five seconds in front of a person."""
    return Run(seen("face-to-face", 25.0))


def pose(left_deg: tuple[float, float], right_deg: tuple[float, float], yaw: float) -> GazeState:
    """Eyes in the head, and the head's yaw."""
    kinematics = Kinematics(GeometryParams(60.0, 40.0, 50.0), GAZE_JOINTS, LIDS)
    degs = (*left_deg, *right_deg, 0.0, 0.0, yaw, 0.0, 0.0)
    return kinematics.forward(joints_at([radians(deg) for deg in degs]))


# --- angles


def test_left_and_up_are_positive_and_the_head_carries_the_eyes() -> None:
    still = gaze_in_space(pose((10.0, 5.0), (6.0, 5.0), 0.0))
    assert still.left_deg == pytest.approx((10.0, 5.0))
    assert still.right_deg == pytest.approx((6.0, 5.0))
    assert still.cyclopean_deg == pytest.approx((8.0, 5.0), abs=0.01)
    turned = gaze_in_space(pose((10.0, 0.0), (6.0, 0.0), 20.0))
    assert turned.left_deg == pytest.approx((30.0, 0.0))
    assert turned.cyclopean_deg == pytest.approx((28.0, 0.0))


def test_a_rolled_head_turns_what_is_sideways_into_what_is_up() -> None:
    level = pose((0.0, 0.0), (0.0, 0.0), 0.0)
    # Right ear down: what is to its left is now above.
    rolled = replace(
        level,
        R_world_head=rotation((0.0, 0.0, radians(90.0))),
        eye_left_rad=(radians(7.0), 0.0),
        eye_right_rad=(radians(7.0), 0.0),
    )
    assert gaze_in_space(rolled).cyclopean_deg == pytest.approx((0.0, 7.0), abs=1e-9)


def test_an_eye_whose_servo_is_silent_is_lost_and_only_that(face: Run) -> None:
    tick = face.ticks[1000]
    silent = [
        replace(tick, joints=replace(tick.joints, missing=missing), t_s=tick.t_s + 0.005 * k)
        for k, missing in enumerate([("left_eye_tilt",), ("neck_roll",), ("right_upper_lid",), ()])
    ]
    trace = collect_gaze_angles(silent)
    assert np.isnan(trace.left_deg[:, 0]).tolist() == [True, True, False, False]
    assert np.isnan(trace.right_deg[:, 0]).tolist() == [False, True, False, False]
    assert np.isnan(trace.cyclopean_deg[:, 0]).tolist() == [True, True, False, False]
    assert np.isnan(trace.head_deg[:, 0]).tolist() == [False, True, False, False]
    assert np.isnan(trace.lids[:, :2]).tolist() == [[False] * 2] * 2 + [[False, True], [False] * 2]


# --- labels


def test_every_saccade_and_blink_of_the_models_is_a_stretch(face: Run) -> None:
    last = face.ticks[-1].gaze
    found = Counter(s.event for s in face.stretches)
    assert abs(found["saccade"] - last.saccades) <= 1 and found["saccade"] > 50
    assert abs(found["blink"] - last.blinks) <= 1 and found["blink"] > 5
    assert found["fixation"] > 40


def test_the_plan_is_moved_by_the_lag_of_the_eyes(face: Run) -> None:
    assert 0.005 <= estimate_lag(face.trace) <= 0.03
    seen = face.trace.cyclopean_deg  # what is rolled over the end would be a leap at the start
    later = face.trace._replace(
        cyclopean_deg=np.vstack((np.repeat(seen[:1], 4, axis=0), seen[:-4]))
    )
    assert estimate_lag(later) == pytest.approx(estimate_lag(face.trace) + 0.02, abs=0.0021)


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


LONG, SHORT = 40, 12
"""Ticks, 200 and 60 ms: a pursuit that counts, and one that may be a flicker."""


@pytest.mark.parametrize(
    ("planned", "found"),
    [
        # The interval between two saccades is a fixation, however short.
        ((("fixation", LONG), ("saccade", 8), ("fixation", SHORT), ("saccade", 8),
          ("fixation", LONG)), None),
        # A flicker of the target's velocity is part of what is around it.
        ((("pursuit", LONG), ("fixation", SHORT), ("pursuit", LONG)), (("pursuit", 92),)),
        ((("fixation", LONG), ("pursuit", LONG), ("fixation", LONG)), None),
        ((("pursuit", LONG), ("fixation", SHORT), ("saccade", 8), ("pursuit", LONG)), None),
    ],
)  # fmt: skip
def test_short_movements_are_what_they_are(
    face: Run, planned: tuple[tuple[str, int], ...], found: tuple[tuple[str, int], ...] | None
) -> None:
    """A still gaze has no lag; movements are planned as (kind, ticks)."""
    movement = [code for what, ticks in planned for code in [MOVEMENTS.index(what)] * ticks]
    still = collect_gaze_angles(face.ticks[: len(movement)])
    trace = still._replace(
        movement=np.array(movement), blink=np.zeros(len(movement), bool),
        looked_at=np.zeros(len(movement), int), cyclopean_deg=np.zeros((len(movement), 2)),
    )  # fmt: skip
    stretches = find_intervals(trace, label_samples(trace))
    wanted = found or planned
    assert [s.event for s in stretches] == [what for what, _ in wanted]
    # Each lasts until the next begins, the last one as long as its ticks.
    assert [s.duration_s for s in stretches] == pytest.approx([0.005 * n for _, n in wanted])


def test_a_target_that_changes_under_way_does_not_make_two_saccades(face: Run) -> None:
    still = collect_gaze_angles(face.ticks[:100])
    trace = still._replace(
        movement=np.repeat([1, 2, 1], [40, 10, 50]), blink=np.zeros(100, bool),
        looked_at=np.repeat([0, 1, 2], [40, 5, 55]), cyclopean_deg=np.zeros((100, 2)),
        names=tuple(GazeTarget("face 1", part) for part in ("LE", "RE", "N")),
    )  # fmt: skip
    found = [(s.event, s.looked_at.part) for s in find_intervals(trace, label_samples(trace))]
    assert found == [("fixation", "LE"), ("saccade", "RE"), ("fixation", "N")]


def test_what_is_near_is_looked_at_without_a_saccade_and_what_is_far_is_not(face: Run) -> None:
    """The gaze is on a target that is nearer to it than half a degree."""
    from scipy.spatial.transform import Rotation

    tick = face.ticks[1000]
    head = np.array(tick.pose.p_world_head_m)
    way = np.array(tick.gaze.gaze_point_world_m) - head

    def at(off_deg: float, shift: int, part: str, saccades: int = 0) -> Tick:
        turned = Rotation.from_euler("z", off_deg, degrees=True).apply(way)
        x, y, z = (head + turned).tolist()
        target = replace(tick.target, p_world_m=(x, y, z), shift=shift, part=part)
        gaze = replace(tick.gaze, phase="fixate", saccades=saccades)
        return replace(tick, target=target, gaze=gaze, t_s=tick.t_s + 0.005 * shift)

    ticks = [at(0.0, 1, "LE"), at(0.4, 2, "RE"), at(5.0, 3, "N"), at(5.0, 4, "N", saccades=1)]
    trace = collect_gaze_angles(ticks)
    assert [trace.names[k].part for k in trace.looked_at] == ["LE", "RE", "RE", "N"]


@pytest.mark.parametrize(("pitch_deg", "share"), [(0.0, 1.0), (60.0, 0.5), (-60.0, 0.5)])
def test_a_gaze_that_is_up_turns_about_the_upright_axis_by_less(
    pitch_deg: float, share: float
) -> None:
    """Angles of Fick: at 60 deg of pitch a degree of yaw is half a degree of gaze."""
    t = np.arange(0.0, 1.0, 0.005)
    gaze = np.column_stack([80.0 * t, np.full(len(t), pitch_deg)])
    assert speed_deg_s(t, gaze) == pytest.approx(np.full(len(t), 80.0 * share))


def test_what_hands_do_is_no_eye_movement(face: Run) -> None:
    ticks = list(face.ticks[1000:1600])
    ticks[100] = replace(ticks[100], commands=(Jog((("neck_yaw", 0.1),)),))
    ticks[200] = replace(ticks[200], commands=(Jog(()),))
    ticks[300] = replace(ticks[300], commands=(Stop("hand"),))
    ticks[300:400] = [replace(tick, stopped="hand") for tick in ticks[300:400]]
    trace = collect_gaze_angles(ticks)
    assert (trace.movement[100:200] == 0).all() and (trace.movement[300:400] == 0).all()
    assert (trace.movement[200:300] > 0).all() and (trace.movement[400:] > 0).all()


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
        "seen_samples.csv", "seen_events.csv", "seen_fixations.csv",
    ]  # fmt: skip
    read = rows(tables[0])
    assert tuple(read[0]) == columns(GAZE_JOINTS) and len(read) == len(face.ticks)
    tick, row = face.ticks[2000], read[2000]
    space = gaze_in_space(tick.pose)
    assert float(row["left_x_deg"]) == pytest.approx(space.left_deg[0], abs=6e-5)
    assert float(row["right_y_deg"]) == pytest.approx(space.right_deg[1], abs=6e-5)
    assert float(row["x_deg"]) == pytest.approx(space.cyclopean_deg[0], abs=6e-5)
    assert float(row["head_yaw_deg"]) == pytest.approx(degrees(tick.pose.head_rad[0]), abs=6e-5)
    assert float(row["left_lid"]) == pytest.approx(tick.pose.lid_left, abs=6e-4)
    assert {row["event"] for row in read} == {"saccade", "fixation", "pursuit", "blink"}
    assert {row["movement"] for row in read} == {"saccade", "fixation", "pursuit"}


def test_a_blink_ends_no_stay_and_a_saccade_does(face: Run, tmp_path: Path) -> None:
    eye, nose = GazeTarget("face 1", "LE"), GazeTarget("face 1", "N")
    stretches = [
        LabelledInterval(0.0, 1.0, "fixation", 0.1, 3.0, eye),
        LabelledInterval(0.4, 0.2, "blink", None, None, eye),
        LabelledInterval(1.0, 0.5, "pursuit", 2.0, 6.0, eye),
        LabelledInterval(1.5, 0.05, "saccade", 8.0, 200.0, nose),
        LabelledInterval(1.55, 0.4, "fixation", 0.1, 3.0, nose),
        LabelledInterval(1.95, 0.05, "saccade", 0.5, 30.0, nose),
        LabelledInterval(2.0, 0.3, "fixation", 0.1, 3.0, nose),
    ]
    read = rows(write_csv(face.trace, face.labels, stretches, tmp_path / "b")[2])
    found = [(float(row["start_s"]), float(row["duration_s"]), row["part"]) for row in read]
    assert found == [(0.0, 1.5, "LE"), (1.55, 0.4, "N"), (2.0, 0.3, "N")]
