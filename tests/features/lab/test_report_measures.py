"""Rows of the report's measures, from traces whose every number is known by hand."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gazerig.features.lab.analysis import human_norms as human
from gazerig.features.lab.analysis.event_detector import (
    CommandedSaccade,
    FixationEvent,
    SaccadeEvent,
    find_events,
)
from gazerig.features.lab.report import eye_head, face, saccades, turns
from gazerig.features.lab.report.gaze_trace import ROW, STATES, GazeTrace, JointBasis
from gazerig.features.lab.report.statistics import MeasuredValue
from gazerig.gaze.types import PARTS, Floats

RATE_HZ = 128.0
"""Its times are exact numbers."""


def trace(seconds: float, **events: Any) -> GazeTrace:
    """Return a trace of rows whose columns are all 0 but the time."""
    rows = np.zeros(round(seconds * RATE_HZ), ROW)
    rows["t"] = np.arange(len(rows)) / RATE_HZ
    return GazeTrace(rows, **events)


def table(text: str) -> Floats:
    """Return the rows of numbers that semicolons separate."""
    return np.array([row.split() for row in text.split(";")], float)


def same(found: NDArray[Any], text: str) -> None:
    assert found == pytest.approx(table(text), nan_ok=True)


def fixations(text: str) -> tuple[FixationEvent, ...]:
    """Return fixations by begin, end, part or -, and if on a face and with one as target."""
    rows = (row.split() for row in text.split(";"))
    return tuple(
        FixationEvent(float(a), float(b) - float(a), part.strip("-") or None, on == "1", to == "1")
        for a, b, part, on, to in rows
    )


def values(found: list[MeasuredValue]) -> dict[str, float]:
    return {one.key: one.value_of(one.rows) for one in found}


def saccade(onset_s: float, deg: float, ms: float = 50.0, peak: float = 300.0) -> SaccadeEvent:
    asked = CommandedSaccade(onset_s, 0.04, deg, 200.0)
    return SaccadeEvent(onset_s, 1e-3 * ms, deg, peak, 0.5, asked)


# --- Traces


def test_a_trace_has_its_times_stretches_and_joints():
    run = trace(4.0, saccades=(saccade(1.0, 9.0), saccade(3.0, 9.0)))
    assert (run.seconds, run.rate_hz, run.mode) == (511 / 128, 128.0, "none")
    run.rows["mode"][:300] = 2.0
    assert run.mode == "listen"
    # From .015 s before a saccade to .04 s after it
    assert np.flatnonzero(~run.slow()).tolist() == [*range(127, 140), *range(383, 396)]
    row = np.arange(512)
    mask = (row < 10) | (row == 20) | (row >= 30) & (row < 60) | (row >= 500)
    run.rows["shift"] = row >= 40  # another target ends a stretch of a least length
    found = [*run.slices(mask), *run.slices(mask, 0.08)]
    same(
        np.array([(one.start, one.stop) for one in found]).T,
        """
        0 20 30 500 40 500; 10 21 60 512 60 512""",
    )
    linked = JointBasis(("eyes_pan", "left_upper_lid"), ("left_upper_lid",))
    assert linked.has_measured_eye
    assert not replace(linked, estimated=linked.names).has_measured_eye
    assert (linked.basis("Lids"), linked.basis("Face")) == ("estimated", "measured")
    assert linked.has_any(("eyes_pan", "jaw")) and not linked.has_any(("jaw",))


# --- Saccades


def test_planned_saccades_and_landings_are_measured_in_their_windows():
    """The gaze moves by an eighth of a degree a row, so a row more or less shows.

    Measured from .02 s after the first row at rest until .06 s after the last one in flight, and
    for the landing .02 to .04 s after that one.
    """
    run = trace(12.0)
    rows, number = run.rows, np.arange(len(run.rows))
    rows["gaze"][:, 0] = number / 8.0
    # First row; its target from the gaze there; whether the target stays, and an eye is limited
    flights = table(
        "128 12 5 1 0; 158 12 5 1 0;"  # .2 s later: the one before was corrected
        "260 9.9 0 1 0; 384 -16 0 1 0;"  # a near target; away from it
        "394 16 0 0 0; 640 0 10 1 1; 768 0 10 1 0"  # .039 s are too soon for a correction
    )
    for shift, (first, yaw, pitch, stays, limited) in enumerate(flights.tolist()):
        at = int(first)
        rows["phase"][at : at + 5], rows["is_face"][at : at + 5] = 1.0, at > 200
        rows["target"][at:] = at / 8.0 + yaw, pitch
        rows["shift"][128 if shift == 1 else at :] = shift
        rows["shift"][at if stays else at + 5 :] += 1.0 - stays
        rows["eye_limited"][at + 6] = limited
    found = saccades.planned_saccades(run)
    same(found[:, :2].T * RATE_HZ, "128 158 260 384 394 640 768; 132 162 264 388 398 644 772")
    # Rows 8 to 11 after the first
    same(found[:, 2:].T, "1.1875 1.1875 1.1875 1.1875 1.1875 1.1875 1.1875; 0 0 1 1 1 1 1")
    # Rows 7 to 9 after the first, a degree on
    same(saccades.landing_errors(run).T * 169.0, "12 12 -10.5625 0; 169 0 0 0")
    rows["on_face"], rows["idle"] = number < 768, number >= 640
    by_key = {one.key: one for one in saccades.measures(run)}
    # Pieces of 5 s; the shifts on a face, and the seconds of it
    same(by_key["refixations"].rows, "3 5; 2 1")
    same(by_key["idle_rate"].rows, "2 5; 0 2")
    assert (by_key["refixations"].events, by_key["idle_rate"].events) == (6, 7)  # seconds


def test_the_limits_of_people_are_those_of_the_papers():
    """Baloh 420, Bahill 551 (1 - exp(-A/14)), Collewijn 502 (1 - exp(-A/11)); at 5, 20, 60 deg."""
    curves = (human.lowest_peak_deg_s, human.highest_peak_deg_s, human.shortest_duration_ms,
              human.longest_duration_ms, human.acceleration_share)  # fmt: skip
    found = np.array([curve([5.0, 20.0, 60.0]) for curve in curves])
    same(
        found.round(4),
        """
        107.2169 271.4446 352.0863; 210.8667 483.5923 624.9285;
        24 48.75 114.75; 50.5 91.25 211.25; .45 .3875 .2""",
    )


def test_saccades_are_counted_by_size_pause_and_human_limits():
    """Peaks of 225.7 to 415 deg/s at 14 deg are human; durations of 42.2 to 80.2 ms at 16 deg."""
    large = saccade(0.0, 14.0, 39.0, 225.0), saccade(0.1, 16.0, 81.0)
    small = saccade(0.5, 1.0, 39.6, 49.9), saccade(3.0, 0.9)
    unasked = large[0]._replace(onset_s=3.2, commanded=None)
    run = trace(4.0, saccades=(*large, *small, unasked))
    same(saccades.saccade_table(run), "14 39 225 .5; 16 81 300 .5; 1 39.6 49.9 .5")
    same(saccades.commanded_saccade_table(run), "14 40 200; 16 40 200; 1 40 200")
    found = values(saccades.measures(run))
    shares = ("peak_small", "peak_large", "duration_small", "duration_large", "skew", "below_15")
    same(np.array([[found[key] for key in shares]]).round(4), "1 .5 1 .5 .075 .6667")
    # Three gaps in three seconds; pauses of .06 and .32 s, and none of 2.46 s
    assert (found["rate"], found["too_soon"], found["unasked"]) == (1.0, 0.5, 0.25)


def test_a_rest_lasts_over_short_gaps_until_another_target():
    events = "0 .5 N 1 1; .6 1 N 1 1; 1.25 1.5 N 1 1; 1.5 1.75 N 1 1; 2 2.5 N 0 1; 3 3.125 N 1 1"
    run = trace(4.0, fixations=fixations(events))
    run.rows["shift"] = run.column("t") >= 1.5
    run.rows["off"] = np.arange(512)[:, None] * (1.0, 3.0)
    same(saccades.face_rests(run)[None], "1 .25 .25 .125")
    # Mean of both eyes, and the median from .04 s on: rows 6 to 63
    assert saccades.rest_errors(run)[[0, -1]].tolist() == [69.0, 789.0]
    assert values(saccades.measures(run))["short_rests"] == 0.25


# --- Saccades and fixations with their commands


def test_a_saccade_has_the_command_that_it_follows_at_once():
    """10 deg in 8 rows, 4 rows after its command; without one; and 18 rows after, too late."""
    rows, row = trace(4.0).rows, np.arange(512)
    for name, begins in (("way", (128, 256, 384)), ("plan", (124, 366))):
        yaw = np.radians(sum(np.clip((row - begin) / 0.8, 0.0, 10.0) for begin in begins))
        rows[name] = np.column_stack([np.cos(yaw), np.sin(yaw), 0.0 * yaw])
    flies = np.isin(row, [*range(124, 132), *range(366, 374)])
    rows["measured"], rows["is_face"], rows["on_any_face"] = 1.0, row >= 256, row < 256
    # Most of the time counts: the left eye; off the parts; the mouth
    rows["part"] = np.select([row < 40, row < 150, row < 270], [6.0, 2.0, -1.0], 3.0)
    found, rests = find_events(rows, flies)
    same(np.array([found[0].commanded], float), ".96875 .0625 10 160")
    assert [one.commanded for one in found[1:]] == [None, None]
    # The speed over five rows is above a tenth of its peak from 1.4 rows before to 1.4 after
    assert np.array([one[:5] for one in found]) == pytest.approx(
        table(".989 .084 10 160 .5; 1.989 .084 10 160 .5; 2.989 .084 10 160 .5"), abs=0.02
    )
    assert [one[2:] for one in rests] == [
        ("LE", True, False), (None, True, False), ("M", False, True)
    ]  # fmt: skip
    ends = np.array([(one.start_s, one.end_s) for one in rests])
    assert ends == pytest.approx(table("0 .989; 1.073 1.989; 2.073 2.989"), abs=0.002)


# --- A face and its parts


def test_visits_shifts_and_times_of_parts():
    looks = (
        "0 .25 LE 1 1; .5 .75 LE 1 1; 1 1.5 RE 1 1; 2 2.25 M 1 1; 2.25 2.5 - 1 1; 2.5 2.75 M 1 0;"
        "2.75 3 N 0 1; 3.25 3.5 M 1 1; 3.5 4 LE 1 1"
    )
    run = trace(4.0, fixations=fixations(looks))
    assert PARTS == ("DN", "FL", "LE", "M", "N", "FR", "RE", "UP")
    visits = np.array(face.part_visits(run), float)
    same(visits, "2 0 .75; 6 1 1.5; 3 2 2.75; 3 3.25 3.5; 2 3.5 4")
    same(face.part_shifts(run), "2 6; 3 2")
    shares, _ = face.shift_shares(np.array([(2, 6), (2, 6), (2, 3), (2, 4)]))
    same(shares[2:3], "0 0 0 .25 .25 0 .5 0")
    same(face.part_shares(face.fixations_on_parts(run))[None], "0 0 .4 .3 .1 0 .2 0")
    rows = run.rows
    rows["face_off"][:128], rows["is_face"], rows["off"] = np.nan, 1.0, (2.6, 2.5)
    rows["off"][256:288], rows["vergence"], rows["vergence"][256:288] = (1.0, 2.7), 4.0, -3.0
    rows["vergence_due"][448:], rows["vergence"][448:] = 0.5, 5.25
    same(face.map_axes(run)[:2], "2.6 2.5 4; 1 2.7 -3")
    found = values(face.measures(run))
    assert found["eyes_share"] == pytest.approx(1.5 / 2.5)
    assert found["visit"] == pytest.approx(2.75 / 5.0)
    assert found["on_parts"] == pytest.approx(2.25 / 2.5)
    assert found["in_cone"] == pytest.approx(6.0 / 7.0)
    assert found["vergence_ok"] == pytest.approx(5.0 / 7.0)


def test_a_look_bridges_short_gaps_and_is_mutual_if_the_face_looks_back():
    run = trace(4.0)
    rows = run.rows
    rows["face"], rows["face_off"] = (0.07, 0.08), 13.0  # outside the oval in both together
    for first, end in ((0, 64), (76, 128), (192, 204), (256, 320), (448, 512)):
        rows["face"][first:end] = (0.06, 0.08)
    rows["face_off"][256:320] = 11.0
    same(face.face_looks(run), "0 1 1; 2 2.5 0; 3.5 3.9921875 1")
    same(face.face_looks(run, mutual=True), "2 2.5 0")
    found = values(face.measures(run))
    assert (found["bout_none"], found["longest_look"], found["mutual"]) == (0.5, 1.0, 0.5)


# --- Eyes and head


def test_a_shift_has_the_turn_delay_and_speed_of_its_head():
    """The head turns by 40 deg/s: over 8 samples, it is faster than 8 deg/s 2 rows before."""
    large = table("1 3 5 5.75 6 6.3125 8 10; 30 30 30 30 7.9 8 5 4.9").T.tolist()
    run = trace(12.0, saccades=tuple(saccade(onset_s, deg) for onset_s, deg in large))
    t, goal = run.column("t"), run.rows["target"][:, 0]
    for begin_s, lasts_s, way in table("1.125 .5 1; 3.1875 .625 -1; 5.0625 .1 1").tolist():
        run.rows["head"][:, 0] += way * 40.0 * np.clip(t - begin_s, 0.0, lasts_s)
    for onset_s, at in table("0 30; 3 -20; 5 10; 5.75 -26; 8 -6").tolist():
        goal[t >= onset_s] = at
    run.rows["target_rate"][t >= 7.5, 0] = 11.0
    # The target from the head; its turn; its delay of 14 and 22 rows; its peak
    same(
        eye_head.gaze_shifts(run),
        "30 20 .109375 40; 40 25 .171875 40; 15 4 nan 40; 25 0 nan 0; 25 0 nan 0",
    )
    got = values(eye_head.measures(run))
    # Beyond 17.9 deg; the usual peak of a turn of 20 and 25 deg is 56 and 64 deg/s
    slope = (12.1 * 20.0 + 22.1 * 25.0) / (12.1**2 + 22.1**2 + 2.0 * 7.1**2)
    assert got["head_slope"] == pytest.approx(slope)
    assert got["head_after"] == pytest.approx(18e3 / RATE_HZ)
    assert got["head_peak"] == pytest.approx(0.5 * (40.0 / 56.0 + 40.0 / 64.0))


def test_gains_and_lag_are_those_of_the_ways_that_are_due():
    run = trace(8.0, fixations=fixations("0 1 - 0 0"))
    t, rows = run.column("t"), run.rows
    turned = np.clip(t - 1.0, 0.0, 1.0)
    rows["head"][:, 0] = 20.0 * turned
    rows["gaze"][:, :1] = 2.0 * turned[:, None]  # the eyes turn back by 18 deg/s
    followed = np.clip(t - 4.0, 0.0, 1.0)[:, None] * (6.0, 8.0)
    rows["gaze"] += 0.9 * followed
    rows["target"] = (0.3, 0.4) + rows["gaze"]
    rows["target"][t < 3.0] = (11.0, 0.0)
    rows["target_rate"][(t >= 4.0) & (t < 5.0)] = (6.0, 8.0)
    rows["head"][:, 2] = np.where(t < 0.6, -1.5, 9.0)
    same(eye_head.vor_gains(run)[None], ".9")
    assert eye_head.head_rolls(run).tolist() == [1.5]
    # Rows near the ends have 4, 5, 6, 7 and 7, 6, 5 eighths of the speed
    same(eye_head.pursuit_stretches(run), "10 .8859375 50")
    rows["off"] = 3.1
    assert not len(eye_head.vor_gains(run))


# --- Turns


def test_looks_away_are_timed_by_role():
    """A look away of 1 s begins in each role; 10 rows a second."""
    # States by their places, and tenths of seconds
    assert STATES == ("idle", "listening", "thinking", "speaking", "interrupted")
    script = table("0 50; 1 400; 2 20; 3 120; 1 30; 2 10; 3 40; 4 10; 3 30; 1 120").astype(int)
    rows = np.zeros(830, ROW)
    rows["t"], off = np.arange(830) / 10.0, rows["off_partner"]
    rows["turn"] = np.repeat(script[:, 0], script[:, 1])
    rows["turn_number"] = np.repeat(range(10), script[:, 1])
    # From row, to row, yaw, pitch, in the order of the turns
    away = table(
        "20 30 7 0; 60 70 7 0; 160 170 0 -7; 200 201 50 0; 452 462 7 0; 470 480 4 5;"
        "615 625 -9 8; 627 630 0 9; 665 675 7 6; 750 755 11 0"
    ).astype(int)
    for begin, end, *way in away.tolist():
        off[begin:end] = way
    off[100:110], off[300:310], off[740:755] = np.nan, (5.9, 0.0), (10.9, 0.0)
    off[750:755] = 11.1, 0.0
    rows["face_edge"][720:] = 10.0  # of a near face: a degree beyond it is away
    looks = turns.TurnLooks(GazeTrace(rows))
    assert (looks.looks == away[:, :2]).all()
    # Seconds away, seconds and looks: 40 s of listening in two blocks, one second unseen
    same(looks.blocks("listening"), "2.1 19 3; 0 20 0; .5 11.9 1")
    same(looks.blocks("speaking"), "1 12 1")
    same(looks.blocks("dialogue"), ".5 3 1; .8 1 1; .5 4 1; .5 1 0; 0 3 0")
    assert looks.aside("listening").tolist() == [1.0, 0.0, 1.0, 1.0]
    assert looks.aside("speaking").tolist() == [0.0]
    assert looks.aside("dialogue").tolist() == [1.0, 1.0]  # not the one of a thought
    assert looks.begins().tolist() == [1.0, 0.0]
    assert looks.ends().tolist() == [1.0]
