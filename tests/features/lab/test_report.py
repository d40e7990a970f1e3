"""The report: human gaze passes, robotic gaze is outside, rare events are reported as too few."""

import json
import re
from base64 import b64decode
from dataclasses import replace
from html import unescape
from math import cos, radians, sin

import cv2
import numpy as np
import pytest
from command_line import invoked
from fakes.runs import play, simulated
from msgspec import structs, yaml
from slow_rigs import slowed

from gazerig.config.schema import Rig, load_walk
from gazerig.features.lab.analysis import human_norms as human
from gazerig.features.lab.analysis.blink_finder import find_blinks
from gazerig.features.lab.analysis.event_detector import (
    SaccadeEvent,
    find_saccades,
)
from gazerig.features.lab.analysis.human_norms import BY_KEY
from gazerig.features.lab.report import face
from gazerig.features.lab.report.gaze_trace import ROW, GazeTrace, GazeTraceBuilder
from gazerig.features.lab.report.measures import judge_run
from gazerig.features.lab.report.statistics import (
    MeasuredValue,
    MeasureResult,
    judge,
    longest,
    mean,
)
from gazerig.gaze.oculomotor.saccade import SaccadeModel as Jumps
from gazerig.gaze.oculomotor.saccade import SaccadeParams
from gazerig.gaze.types import PARTS, Percept, Vec3
from gazerig.robot.loop.tick import Tick

pytestmark = pytest.mark.usefixtures("ideal_servos")
EMPTY = GazeTrace(np.zeros(0, ROW))


def verdicts(run: GazeTrace) -> dict[str, MeasureResult]:
    return {finding.band.key: finding for finding in judge_run(run)}


def run_ticks(rig: Rig, seconds: float) -> list[Tick]:
    seen: list[Tick] = []
    play(simulated(rig, "face-to-face"), seconds, seen.append)
    return seen


def gathered(ticks: list[Tick]) -> GazeTrace:
    gathering = GazeTraceBuilder()
    for tick in ticks:
        gathering.update(tick)
    return gathering.trace()


@pytest.fixture(scope="module")
def walking(desk_rig: Rig) -> GazeTrace:
    """A minute of gaze with half the ticks: it takes longest here."""
    return gathered(run_ticks(slowed(desk_rig, 100.0), 60.0))


@pytest.fixture(scope="module")
def results(walking: GazeTrace) -> dict[str, MeasureResult]:
    return verdicts(walking)


@pytest.fixture(scope="module")
def ticks(desk_rig: Rig) -> list[Tick]:
    return run_ticks(desk_rig, 15.0)


def test_a_gaze_that_wanders_as_people_do_passes_on_the_face(results):
    for key in ("on_parts", "eyes_share", "visit", "never_taken", "heat", "rate",
                "below_15", "peak_small", "rest_error", "in_cone",
                "vergence_ok"):  # fmt: skip
        assert results[key].verdict == "pass", results[key]
        assert results[key].measured.events >= results[key].band.least
        assert results[key].low95 <= results[key].value <= results[key].high95


def test_too_few_events_are_no_pass_and_nothing_is_too_few():
    ones = np.full(BY_KEY["rate"].least - 1, 0.4)
    few = judge(MeasuredValue("rate", ones, mean))
    assert few.verdict == "too few events" and np.isnan(few.low95)
    none = verdicts(EMPTY)
    assert {finding.verdict for finding in none.values()} == {"too few events"}
    assert "blink_rate" in none and "blink_rate_talk" not in none  # nobody has talked


def test_a_figure_outside_by_what_chance_may_do_is_uncertain():
    """Swings may be 10 %: 4 of 34 are no proof of more, 400 of 3400 are."""
    for times, verdict in ((1, "uncertain"), (100, "outside")):
        rows = np.array([1.0] * 4 * times + [0.0] * 30 * times)
        assert judge(MeasuredValue("unasked", rows, mean)).verdict == verdict
    inside = judge(MeasuredValue("unasked", np.zeros(30), mean))
    assert inside.verdict == "pass" and inside.high95 > inside.band.high  # 30 events are few
    one_look = MeasuredValue("longest_look", np.array([3.0, 15.4]), longest)
    look = judge(one_look)
    assert look.verdict == "outside" and np.isnan(look.high95)  # it has happened


def test_people_are_as_published():
    assert load_walk("nakamoto_tsuruno").order == PARTS
    share = [0.0654, 0.1146, 0.0580, 0.1077, 0.2012, 0.1073, 0.2892, 0.0566]
    assert face.human_share() == pytest.approx(share, abs=2e-4)
    visits = [0.244, 0.480, 0.173, 0.261, 0.288, 0.286, 0.286, 0.165]
    assert human.mean_visit_s(human.transition_matrix(), human.DWELL_MEAN_S) == pytest.approx(
        visits, abs=1e-3
    )
    assert human.mean_head_deg([20.0, 40.0, 80.0]) == pytest.approx([1.6, 17.0, 47.8], abs=0.1)


def test_servos_without_bytes_are_not_judged():
    """Their lag makes most small saccades too long; what the models choose is judged."""
    seen = verdicts(replace(EMPTY, ideal_servos=True))
    for key in ("duration_small", "skew", "rest_error", "vor", "pursuit_lag", "blink_close"):
        assert seen[key].verdict == "not judged"
    for key in ("rate", "visit", "on_parts", "blink_rate", "head_roll"):
        assert seen[key].verdict == "too few events"


def test_the_whole_report_is_written(walking, results, tmp_path):
    from gazerig.features.lab.report.figures import DRAWINGS
    from gazerig.features.lab.report.report import ReportedRun, make_report

    styles = frozenset({"saccade min_jerk"})
    one = ReportedRun(
        "a <run>", walking, {"rig": "desk"}, styles, "cut short", tuple(results.values())
    )
    outside = tuple(result._replace(verdict="outside") for result in one.results)
    out = tmp_path / "deep" / "report.html"
    make_report([one, replace(one, results=outside)], out, lambda words, share: None)
    raw = out.read_text()
    page = unescape(raw)
    assert "a &lt;run&gt;" in raw
    pictures = re.findall(r"data:image/png;base64,([^\"]+)", page)
    assert len(pictures) == len(DRAWINGS) == 9
    assert not re.search(r'(src|href)="(?!data:)', page)  # it needs no other file
    assert "by design: Mitake et al. eq 5" in page  # outside, with that style
    for picture in pictures:
        drawn = cv2.imdecode(np.frombuffer(b64decode(picture), np.uint8), cv2.IMREAD_COLOR)
        assert drawn is not None and drawn.std() > 5.0
    numbers = json.loads((tmp_path / "deep" / "report_measures.json").read_text())
    assert len(numbers) == 2 * len(one.results)
    assert {row["key"] for row in numbers} == {result.band.key for result in one.results}
    for result in one.results:
        assert result.band.title in page and result.band.source in " ".join(page.split())


# --- Files that a report reads and writes: nothing of the user's is lost


@pytest.mark.parametrize("name", ["notes.html", "notes_measures.json"])
def test_a_report_writes_over_nothing_unless_forced(tmp_path, name):
    (tmp_path / name).write_text("somebody's own")
    # Refused before any work: the recording is not there.
    done = invoked("report", "a.mcap", "--out", str(tmp_path / "notes.html"))
    assert done.code == 2 and f"{name} already exists" in done.err
    assert (tmp_path / name).read_text() == "somebody's own"


# --- Saccades and blinks found in traces whose truth is known, and before an independent judge


STEP_DEG = 360.0 / 4096.0


def at(yaw_deg: float) -> Vec3:
    return cos(radians(yaw_deg)), sin(radians(yaw_deg)), 0.0


def jumps(yaw_deg: np.ndarray, rate_hz: float) -> list[SaccadeEvent]:
    found, _ = find_saccades(np.arange(len(yaw_deg)) / rate_hz, np.array([*map(at, yaw_deg)]))
    return [saccade for _, saccade in found]


def stepped(yaw_deg: np.ndarray) -> np.ndarray:
    return np.round(yaw_deg / STEP_DEG) * STEP_DEG


def trace(
    amplitudes: tuple[float, ...], rate_hz: float, slow_deg_s: float = 0.0, every_s: float = 0.5
) -> np.ndarray:
    """Jump repeatedly, onto something that moves with ``slow_deg_s``."""
    t = np.arange(0.0, every_s * len(amplitudes) + 0.5, 1.0 / rate_hz)
    jump, yaw = Jumps(SaccadeParams(profile="min_jerk")).profile, slow_deg_s * t
    for n, size in enumerate(amplitudes):
        gone = [jump.displacement_rad(radians(abs(size)), s - 0.25 - every_s * n) for s in t]
        yaw = yaw + np.sign(size) * np.degrees(gone)
    return yaw


SIZES = (2.0, -3.0, 5.0, -8.0, 12.0, -20.0, 30.0, -30.0, 1.5, -10.0)


@pytest.mark.parametrize("rate_hz", [100.0, 200.0, 250.0, 1000.0])
def test_every_jump_is_found_with_its_size_time_and_speed(rate_hz):
    found = jumps(stepped(trace(SIZES, rate_hz)), rate_hz)
    assert len(found) == len(SIZES)
    law = Jumps(SaccadeParams(profile="min_jerk")).profile
    for n, (jump, size) in enumerate(zip(found, SIZES, strict=True)):
        size = radians(abs(size))
        assert np.radians(jump.amplitude_deg) == pytest.approx(size, rel=0.08, abs=0.002)
        assert jump.onset_s == pytest.approx(0.25 + 0.5 * n, abs=0.012)
        assert jump.duration_s == pytest.approx(law.duration_s(size), abs=0.016)
        low = 0.8 if rate_hz == 100.0 else 0.92
        moved = [law.displacement_rad(size, t) for t in np.arange(0.0, 0.3, 0.0005)]
        peak = np.degrees(np.diff(moved).max() / 0.0005)
        assert low * peak - 5.0 < jump.peak_deg_s < 1.1 * peak + 12.0
        assert jump.peak_share == pytest.approx(0.5, abs=0.12)


def test_a_jump_that_follows_at_once_is_one_of_its_own():
    found = jumps(stepped(trace((20.0, 10.0), 200.0, every_s=0.06)), 200.0)
    assert [jump.amplitude_deg for jump in found] == pytest.approx([20.0, 10.0], abs=0.5)


@pytest.mark.parametrize("slow_deg_s", [10.0, 25.0, 45.0])
def test_following_is_no_saccade_and_hides_none(slow_deg_s):
    assert len(jumps(stepped(trace((0.0,) * 4, 200.0, slow_deg_s)), 200.0)) <= 1  # its onset
    found = jumps(stepped(trace((0.0, 0.0, 4.0, -6.0, 8.0), 200.0, slow_deg_s)), 200.0)
    sizes = [jump.amplitude_deg for jump in found if jump.onset_s > 1.0]
    moved = 0.05 * slow_deg_s
    assert sizes == pytest.approx([4.0 + moved, 6.0 - moved, 8.0 + moved], abs=0.6)


BLINKS = """
0 1, 1 1, 1.125 0, 1.25 0, 1.5 1, 3 1 : 1 .125 .125 .25 1 8 4
0 1, 1 1, 1.125 .55, 1.25 .55, 1.5 1, 3 1 :
0 1, 1 1, 1.125 .45, 1.25 .45, 1.5 1, 3 1 : 1 .125 .125 .22734375 .517354 4.4 2.2
0 .8, 1 .8, 1.125 0, 1.25 0, 1.5 .8, 3 .8 : 1 .125 .125 .25 1 6.4 3.2
0 .14, 1 .14, 1.125 0, 1.25 0, 1.5 .14, 3 .14 :
0 1, 1 1, 1.125 .3, 6 .3 :
0 1, 1 1, 1.125 .3, 4.5 .3, 4.625 0, 4.75 0, 5 .3, 6 .3 : 4.5 .125 .125 .25 1 2.4 1.2
0 1, 1 1, 1.125 0, 1.25 0, 1.5 .7, 6 .7 :
0 1, 1 1, 1.125 0, 1.25 0, 1.5 1, 1.55 1 :
0 1, 1 1, 1.125 0, 1.25 0, 1.5 1, 1.6 1 : 1 .125 .125 .25 1 8 4
0 1, 1 1, 1.125 0, 1.25 0, 1.5 1, 2 1, 2.125 0, 2.25 0, 2.5 1, 4 1 : 1 .125 .125 .25 1 8 4 \
2 .125 .125 .25 1 8 4
0 1, 1 1, 1.125 0, 2.75 0, 3 1, 4 1 : 1 .125 1.625 .25 1 8 4
0 1, 1 1, 1.125 0, 2.875 0, 3.125 1, 5 1 :
"""
"""Times and openings between straight lines : onset, close, hold, open, depth, peak speeds."""


def test_a_blink_has_its_phases_and_a_droop_or_a_half_shut_lid_is_none():
    """A phase begins .9 rows before its line, where a speed over two rows is .05 of its peak.

    The opening before sinks by 1/64 a row towards the lid, also while it shuts. A blink of half of
    it is measured until .12 s after three quarters are back.
    """
    for row in BLINKS.strip().splitlines():
        way, _, due = row.partition(":")
        t_s, opening = np.array([point.split() for point in way.split(",")], float).T
        t = np.arange(0.0, t_s[-1], 1.0 / 128.0)
        found = np.array([*find_blinks(t, np.interp(t, t_s, opening))]).reshape(-1, 7)
        expected = np.array(due.split(), float).reshape(-1, 7)
        expected[:, :4] += np.array((-0.9, 1.8, -1.8, 1.8)) / 128.0
        assert found == pytest.approx(expected, abs=1e-5), row


TICK = """
pose: {head_rad: [1.570796, 0.2, -0.1], eye_left_rad: [-0.02, 0.1], eye_right_rad: [0.04, 0.1],
  R_world_head: [[0, -1, 0], [1, 0, 0], [0, 0, 1]], p_world_head_m: [0, 0, 1],
  p_world_eye_left_m: [-0.03, 0, 1], p_world_eye_right_m: [0.03, 0, 1], lid_left: 0.3,
  lid_right: 0.7}
target: {p_world_m: [0.3, 1.6, 1.0], v_world_m_s: [0.5, 0, 0.25], at_s: 9.8, kind: face, id: 5,
  shift: 7}
gaze: {lid_left: 0.9, lid_right: 0.4, eye_left_rad: [0, 0.1], eye_right_rad: [0, 0.3],
  phase: pursue, gaze_point_world_m: [0.6, 0.8, 1.0], limited: []}
conversation: {state: speaking, number: 11, partner: 5}
"""
"""At 10 s: the head looks along y from 1 m up, with its eyes .06 m apart."""
FACE = """{id: 5, p_world_m: [-0.05, 1.5, 1.1], v_world_m_s: [0.1, 0, 0],
  R_world_face: [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]}"""
ROW_DUE = """gaze 90.573 5.7321; head 90 11.4592 -5.7296; eye_pitch 5.7296
target 75.9638 1.7365; target_rate -16.8517 8.5496; vergence 3.4377; vergence_due 2.022
off 14.4302 15.7881; face .0247 .0534; face_off 4.2627; on_face 1; lid .7; asked_lid .9
asked_pitch 11.4592; phase 2; is_face 1; idle 0; eye_limited 0; shift 7; mode 4; turn 3
turn_number 11; off_partner -1.3362 1.9202; face_edge 4.0475; measured 1; part 3; on_any_face 1
way -.0099 .9949 .0999; plan .6 .8 0"""


def test_a_row_says_where_eyes_head_and_faces_are(ticks):
    tick = structs.replace(ticks[-1], t_s=10.0)
    assert tick.percept is not None
    seen = structs.replace(tick.percept.faces[0], **yaml.decode(FACE))
    parts = [(0.0, 2.0, 2.0)] * 8
    parts[3] = -0.03, 1.5, 1.15  # the mouth, .005 m from the line of sight after .1 s
    seen = structs.replace(seen, parts_world_m=tuple(parts))
    beside = structs.replace(seen, id=99, p_world_m=(1.0, 1.0, 1.0))
    for name, values in yaml.decode(TICK).items():
        tick = structs.replace(tick, **{name: structs.replace(getattr(tick, name), **values)})
    percept = Percept(9.9, faces=(beside, seen))
    (row,) = gathered([structs.replace(tick, percept=percept)]).rows
    for name, *due in map(str.split, ROW_DUE.replace("\n", ";").split(";")):
        assert np.atleast_1d(row[name]) == pytest.approx(np.array(due, float), abs=2e-4), name


def test_what_is_not_measured_or_stopped_and_a_gap_make_no_events(ticks):
    builder = GazeTraceBuilder()
    for tick in ticks[:2000]:
        joints = structs.replace(tick.joints, missing=("left_eye_pan",))
        builder.update(structs.replace(tick, joints=joints))
    for tick in ticks[2000:2010]:  # a gap is no saccade
        builder.update(structs.replace(tick, t_s=tick.t_s + 9.0, pose=ticks[0].pose))
    for tick in ticks[2010:]:
        builder.update(structs.replace(tick, stopped="somebody did"))
    run = builder.trace()
    assert len(run.rows) == 2010 and not run.saccades and not run.fixations
