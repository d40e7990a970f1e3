"""Figures that fill as the rig runs: timeline, main sequence, rests on face parts, heat map."""

import re
from dataclasses import replace

import numpy as np
import pytest
from desk import GAZE_JOINTS

from gazerig.gaze.types import PARTS
from gazerig.robot.analysis.heatmap import on_canvas
from gazerig.robot.analysis.human_norms import BY_KEY, fastest_peak, slowest_peak
from gazerig.robot.dashboard.panels.dwell_chart import BIN_S, BINS, DwellChart
from gazerig.robot.dashboard.panels.event_timeline import STRIP_S, Timeline
from gazerig.robot.dashboard.panels.gaze_map import HIGH_PX, SHRINK, WIDE_PX, GazeMap, gaze_on_face
from gazerig.robot.dashboard.panels.main_sequence_chart import KEPT, MainSequenceChart
from gazerig.robot.dashboard.panels.run_figures import RunFigure, RunFigures, compare_with_band
from gazerig.robot.dashboard.view.overlays import field_edge
from gazerig.robot.model.types import SeenBlink, SeenFace, SeenFixation, SeenSaccade, Snapshot

AHEAD = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
FACING = ((-1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0))


def looking(t_s: float, name: str = "face 1: nose", part: str | None = "N") -> Snapshot:
    """A head at the origin that looks straight at a face a metre away."""
    face = SeenFace(1, (1.0, 0.0, 0.0), FACING, tuple((1.0, 0.0, 0.0) for _ in PARTS))
    return Snapshot(
        t_s=t_s, measured_rad=(0.0,) * 9, desired_rad=(0.0,) * 9, R_world_head=AHEAD,
        p_world_head_m=(0.0, 0.0, 0.0), p_world_eyes_m=((0.0, 0.03, 0.0), (0.0, -0.03, 0.0)),
        gaze_world=((1.0, 0.0, 0.0), (1.0, 0.0, 0.0)), lids=(0.8, 0.8),
        p_world_target_m=(1.0, 0.0, 0.0), target_name=name, why="", phase="fixate", level="ok",
        reasons=(), faces=(face,), bodies=(), rate_hz=200.0, health="",
        target_kind=name.split()[0], target_id=1, target_part=part, joints=GAZE_JOINTS,
    )  # fmt: skip


# --- the strip of the last half minute --------------------------------------------------


def test_stretches_join_end_to_end_and_are_forgotten() -> None:
    timeline = Timeline()
    for k in range(1000):
        t_s = 0.05 * k
        timeline.update(looking(t_s, "face 1: nose" if t_s < 40.0 else "hand <7>", None))
    (face, hand) = timeline.intervals("target")
    assert face == (0.0, pytest.approx(39.95), "face 1")
    assert hand == (pytest.approx(39.95), pytest.approx(49.95), "hand <7>")
    for k in range(1000, 1700):
        timeline.update(looking(0.05 * k, "hand <7>", None))
    assert [what for _, _, what in timeline.intervals("target")] == ["hand <7>"]


def test_strip_shows_targets_saccades_blinks_and_the_guard_and_runs_no_markup() -> None:
    timeline = Timeline()
    timeline.update(looking(0.0, "hand <7>", None))
    timeline.update(replace(looking(10.0, "hand <7>", None), worst="hold"))
    jump, shut = SeenSaccade(4.0, 0.05, 12.0, 300.0), SeenBlink(6.0, 0.3)
    timeline.update(replace(looking(20.0), events=(jump, shut)))
    drawn = timeline.drawing()
    for said in ("hand &lt;7&gt;", "12.0 deg, 50 ms", "blink, 300 ms", "<title>hold</title>"):
        assert said in drawn
    assert "hand <7>" not in drawn
    assert all(0.0 <= float(x) <= 320.0 for x in re.findall(r"<rect x='([-\d.]+)'", drawn))


def test_what_is_older_than_the_strip_is_not_drawn() -> None:
    timeline = Timeline()
    timeline.update(replace(looking(0.0), events=(SeenBlink(0.0, 0.31),)))
    assert "310 ms" in timeline.drawing()
    timeline.update(looking(STRIP_S + 0.1))
    assert "310 ms" not in timeline.drawing()


def test_strip_says_when_somebody_stopped_the_rig_and_starts_anew_with_the_clock() -> None:
    timeline = Timeline()
    timeline.update(looking(50.0))
    timeline.update(replace(looking(51.0), stopped="space bar"))
    assert [what for _, _, what in timeline.intervals("guard")] == ["ok", "stopped"]
    timeline.update(looking(0.0))
    assert timeline.intervals("guard") == ((0.0, 0.0, "ok"),)


# --- the main sequence ------------------------------------------------------------------


def circles(drawn: str) -> np.ndarray:
    """Centres (n, 2) of all dots."""
    found = re.findall(r"<circle cx='([\d.]+)' cy='([\d.]+)'", drawn)
    return np.array(found, float).reshape(-1, 2)


def test_a_dot_a_saccade_in_both_pictures_the_newest_marked() -> None:
    sequence = MainSequenceChart()
    for size in (4.0, 8.0):
        sequence.update(SeenSaccade(0.0, 0.04, size, 25.0 * size))
    drawn = sequence.drawing()
    speeds, lengths = circles(drawn)[:2], circles(drawn)[2:]
    assert "2 saccades" in drawn
    assert speeds[1, 0] > speeds[0, 0] and speeds[1, 1] < speeds[0, 1]
    assert lengths[0, 1] == lengths[1, 1]
    assert drawn.count("r='3.4'") == 2


def test_a_saccade_like_peoples_lies_in_their_range() -> None:
    def inside(speed_deg_s: float) -> bool:
        sequence = MainSequenceChart()
        sequence.update(SeenSaccade(0.0, 0.045, 10.0, speed_deg_s))
        drawn = sequence.drawing()
        (outline,) = re.findall(r"<polygon points='([^']+)'", drawn)[:1]
        band = np.array([pair.split(",") for pair in outline.split()], float)
        x, y = circles(drawn)[0]
        column = band[np.abs(band[:, 0] - x).argsort()[:2], 1]
        return bool(column.min() <= y <= column.max())

    low, high = float(slowest_peak(10.0)), float(fastest_peak(10.0))
    assert inside((low + high) / 2)
    assert not inside(0.7 * low) and not inside(1.3 * high)


def test_only_the_newest_saccades_are_drawn_but_all_are_counted() -> None:
    sequence = MainSequenceChart()
    for _ in range(KEPT + 50):
        sequence.update(SeenSaccade(0.0, 0.04, 5.0, 200.0))
    drawn = sequence.drawing()
    assert len(circles(drawn)) == 2 * KEPT
    assert f"{KEPT + 50} saccades" in drawn


# --- rests on face parts ----------------------------------------------------------------


def test_shares_are_of_the_time_on_parts() -> None:
    dwell = DwellChart()
    assert dwell.shares() == {}
    for part, seconds in (("LE", 0.3), ("LE", 0.3), ("M", 0.2), (None, 5.0)):
        dwell.update(SeenFixation(0.0, seconds, part))
    shares = dwell.shares()
    assert shares["LE"] == pytest.approx(0.75) and shares["M"] == pytest.approx(0.25)
    assert sum(shares.values()) == pytest.approx(1.0)
    drawn = dwell.drawing()
    assert "75 %" in drawn and "25 %" in drawn and "3 rests" in drawn


def test_rests_are_counted_by_length_and_the_long_ones_together() -> None:
    dwell = DwellChart()
    for seconds in (0.05, 0.25, 0.27, 99.0):
        dwell.update(SeenFixation(0.0, seconds, "N"))
    drawn = dwell.drawing()
    for said in ("1 of 0 ms", "2 of 200 ms", f"1 of {1e3 * BIN_S * (BINS - 1):.0f} ms"):
        assert said in drawn


# --- the heat map -----------------------------------------------------------------------


def test_gaze_meets_the_face_where_it_points() -> None:
    # The face looks back: its left is the head's right, so a gaze to the left has y below 0.
    left = np.array((1.0, 0.03, 0.02)) / np.linalg.norm((1.0, 0.03, 0.02))
    aside = replace(looking(0.0), gaze_world=(tuple(left), tuple(left)))
    point = gaze_on_face(aside)
    assert point is not None
    assert point == pytest.approx((-0.03 * 1.028, 0.02 * 1.028))
    assert gaze_on_face(replace(aside, phase="saccade")) is None
    assert gaze_on_face(replace(aside, target_kind="hand")) is None
    assert gaze_on_face(replace(aside, target_id=2)) is None


def test_a_face_that_moves_is_met_where_it_is_by_now() -> None:
    shot = looking(0.0)
    walking = replace(shot.faces[0], v_world_m_s=(0.0, 0.5, 0.0))
    point = gaze_on_face(replace(shot, faces=(walking,), frame_age_s=0.1))
    assert point == pytest.approx((0.05, 0.0))


def test_the_map_is_brightest_where_the_gaze_was() -> None:
    heat = GazeMap()
    for k in range(51):
        heat.update(looking(0.04 * k))
    assert heat.seconds == pytest.approx(2.0)
    picture = heat.image().astype(int)
    assert picture.shape == (HIGH_PX, WIDE_PX, 3)
    yellow = picture[..., 0] + picture[..., 1] - 2 * picture[..., 2]
    row, column = np.unravel_index(yellow.argmax(), yellow.shape)
    expected = on_canvas(np.zeros((1, 2)))[0] / SHRINK
    assert (column, row) == pytest.approx(tuple(expected), abs=6.0)


def test_a_pause_adds_no_time() -> None:
    heat = GazeMap()
    for t_s in (0.0, 5.0, 1.0):
        heat.update(looking(t_s))
    assert heat.seconds == 0.0


# --- the eyes' field --------------------------------------------------------------------


def test_the_edge_of_the_field_lies_at_its_limits() -> None:
    edge = field_edge((100.0, 60.0, 60.0, 75.0), left=True)
    away = np.degrees(np.arccos(edge[:, 0] / np.linalg.norm(edge, axis=1)))
    left, above, right, below = (away[i] for i in (0, 18, 36, 54))
    assert (left, above, right, below) == pytest.approx((100.0, 60.0, 60.0, 75.0))
    mirrored = field_edge((100.0, 60.0, 60.0, 75.0), left=False)
    assert np.allclose(mirrored[[0, 18, 36]], edge[[36, 18, 0]] * (1.0, -1.0, 1.0))


# --- the figures of the run -------------------------------------------------------------------


def told(count: int, speed: float, seconds: float = 60.0) -> dict[str, RunFigure]:
    """Figures of a minute with so many saccades of 5 deg, of so much of people's speed."""
    figures, dwell = RunFigures(), DwellChart()
    for k in range(count):
        t_s = seconds * k / count
        peak = speed * float(fastest_peak(5.0))
        event = SeenSaccade(t_s, 0.035, 5.0, peak)
        figures.update(replace(looking(t_s), events=(event,)))
        dwell.update(SeenFixation(t_s, 0.3, "LE" if k % 2 else "M"))
    figures.update(looking(seconds))
    return {figure.key: figure for figure in figures.figures(dwell)}


def test_figures_are_those_of_the_report() -> None:
    found = told(150, 0.9)
    assert found["rate"].value == pytest.approx(2.5) and found["rate"].events == 150
    assert found["peak_small"] == RunFigure("peak_small", 1.0, 150)
    assert found["below_15"].value == 1.0 and found["duration_small"].value == 1.0
    assert found["eyes_share"].value == pytest.approx(0.5)
    assert found["too_soon"] == RunFigure("too_soon", 0.0, 149)
    assert found["blink_rate"].value == 0.0
    assert "peak_large" not in found
    assert told(150, 1.2)["peak_small"].value == 0.0


def test_few_events_never_judge_and_chance_is_called_so() -> None:
    band = BY_KEY["duration_small"]  # a share of .75 and more, of at least 30
    assert compare_with_band(RunFigure(band.key, 0.0, 29), band) == "too few: 29 of 30"
    assert compare_with_band(RunFigure(band.key, 0.8, 30), band) == "inside"
    assert compare_with_band(RunFigure(band.key, 0.7, 40), band) == "may be chance"
    assert compare_with_band(RunFigure(band.key, 0.7, 4000), band) == "outside"
    assert compare_with_band(RunFigure(band.key, 0.0, 30), band) == "outside"
    rate = BY_KEY["rate"]
    assert compare_with_band(RunFigure("rate", 4.2, 100), rate) == "may be chance"
    assert compare_with_band(RunFigure("rate", 6.0, 100), rate) == "outside"


def test_the_table_shows_the_range_of_people_and_its_source() -> None:
    figures = RunFigures()
    assert "no eye movement" in figures.table(DwellChart())
    for k in range(40):
        figures.update(replace(looking(0.5 * k), events=(SeenSaccade(0.5 * k, 0.5, 5.0, 9.0),)))
    table = figures.table(DwellChart())
    assert "75 to 100" in table and "Bahill" in table and "outside" in table
