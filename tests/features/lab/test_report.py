"""The report: human gaze passes, robotic gaze is outside, rare events are reported as too few."""

import json
import re
from base64 import b64decode
from dataclasses import replace
from html import unescape
from math import cos, radians, sin
from pathlib import Path

import cv2
import numpy as np
import pytest
from command_line import invoked
from fakes.runs import play, simulated
from msgspec import structs
from slow_rigs import slowed

from gazerig.config.schema import Rig, load_walk
from gazerig.features.lab.analysis import human_norms as human
from gazerig.features.lab.analysis.blink_finder import BlinkEvent, find_blinks
from gazerig.features.lab.analysis.event_detector import (
    CommandedSaccade,
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
from gazerig.gaze.lids.blink import closure
from gazerig.gaze.oculomotor.saccade import SaccadeModel as Jumps
from gazerig.gaze.oculomotor.saccade import SaccadeParams
from gazerig.gaze.types import PARTS, Vec3
from gazerig.robot.loop.tick import Tick

pytestmark = pytest.mark.usefixtures("ideal_servos")
EMPTY = GazeTrace(np.zeros(0, ROW))


def verdicts(run: GazeTrace) -> dict[str, MeasureResult]:
    return {finding.band.key: finding for finding in judge_run(run)}


def run_of(saccades: list[tuple[float, float, float, float]], blinks: int = 0) -> GazeTrace:
    """Make a run of saccades: amplitude, duration in ms, peak, time of the peak."""
    every = tuple(
        SaccadeEvent(0.4 * n, d / 1e3, a, v, at, CommandedSaccade(0.4 * n, d / 1e3, a, v))
        for n, (a, d, v, at) in enumerate(saccades)
    )
    shuts = tuple(BlinkEvent(3.0 * n, 0.08, 0.04, 0.19, 1.0, 20.0, 10.0) for n in range(blinks))
    rows = np.zeros(600, ROW)
    rows["t"], rows["gaze"] = np.arange(600) * 0.05, np.nan
    return GazeTrace(rows, every, (), shuts, shuts)


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


def test_a_gaze_that_wanders_as_people_do_passes_on_the_face(results: dict[str, MeasureResult]):
    for key in ("on_parts", "eyes_share", "visit", "never_taken", "heat", "rate",
                "below_15", "peak_small", "rest_error", "in_cone",
                "vergence_ok"):  # fmt: skip
        assert results[key].verdict == "pass", results[key]
        assert results[key].measured.events >= results[key].band.least
        assert results[key].low95 <= results[key].value <= results[key].high95


def human_saccades(faster: float = 1.0, longer: float = 1.0) -> list[tuple[float, ...]]:
    """Return saccades as people make them, or faster or longer ones."""
    dice = np.random.default_rng(3)
    sizes = np.concatenate([dice.uniform(1.5, 7.9, 40), dice.uniform(13.0, 40.0, 40)])
    peak = faster * 0.5 * (human.lowest_peak_deg_s(sizes) + human.highest_peak_deg_s(sizes))
    duration = longer * 0.5 * (human.shortest_duration_ms(sizes) + human.longest_duration_ms(sizes))
    return list(zip(sizes, duration, peak, human.acceleration_share(sizes), strict=True))


def test_the_bands_of_the_main_sequence_cut_on_both_sides():
    keys = ("peak_small", "peak_large", "duration_small", "duration_large", "skew")
    right = verdicts(run_of(human_saccades()))  # type: ignore[arg-type]
    assert [right[key].verdict for key in keys] == ["pass"] * 5
    for faster, longer in ((0.6, 0.6), (1.7, 1.7)):
        wrong = verdicts(run_of(human_saccades(faster, longer)))  # type: ignore[arg-type]
        assert [wrong[key].verdict for key in keys[:4]] == ["outside"] * 4


def test_blinks_of_a_human_shape_pass_and_are_counted_by_the_minute():
    seen = verdicts(run_of([], blinks=10))
    for key in ("blink_close", "blink_hold", "blink_open", "blink_ratio", "blink_rate"):
        assert seen[key].verdict == "pass", seen[key]
    assert seen["blink_rate"].value == pytest.approx(20.0, rel=0.02)
    assert "blink_rate_talk" not in seen
    assert verdicts(run_of([], blinks=3))["blink_rate"].verdict == "too few events"


def test_too_few_events_are_no_pass_and_nothing_is_too_few():
    ones = np.full(BY_KEY["rate"].least - 1, 0.4)
    few = judge(MeasuredValue("rate", ones, mean))
    assert few.verdict == "too few events" and np.isnan(few.low95)
    assert {finding.verdict for finding in judge_run(EMPTY)} == {"too few events"}


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


def test_servos_without_bytes_are_not_judged(walking: GazeTrace, results: dict[str, MeasureResult]):
    """Their lag makes most small saccades too long; what the models choose is judged."""
    seen = verdicts(replace(walking, ideal_servos=True))
    for key in ("duration_small", "skew", "rest_error", "vor", "pursuit_lag", "blink_close"):
        assert seen[key].verdict == "not judged" and np.isfinite(seen[key].value), key
    for key in ("rate", "visit", "on_parts", "blink_rate", "head_roll"):
        assert seen[key].verdict == results[key].verdict == "pass", key


def test_the_whole_report_is_written(
    walking: GazeTrace, results: dict[str, MeasureResult], tmp_path: Path
):
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
def test_a_report_writes_over_nothing_unless_forced(tmp_path: Path, name: str):
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
def test_every_jump_is_found_with_its_size_time_and_speed(rate_hz: float):
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
def test_following_is_no_saccade_and_hides_none(slow_deg_s: float):
    assert len(jumps(stepped(trace((0.0,) * 4, 200.0, slow_deg_s)), 200.0)) <= 1  # its onset
    found = jumps(stepped(trace((0.0, 0.0, 4.0, -6.0, 8.0), 200.0, slow_deg_s)), 200.0)
    sizes = [jump.amplitude_deg for jump in found if jump.onset_s > 1.0]
    moved = 0.05 * slow_deg_s
    assert sizes == pytest.approx([4.0 + moved, 6.0 - moved, 8.0 + moved], abs=0.6)


BLINK_S = 0.075, 0.035, 0.175


def blinks(openings: list[tuple[float, float, float]]) -> list[BlinkEvent]:
    t_s, left, right = np.array(openings).T
    return list(find_blinks(t_s, np.maximum(left, right)))


def test_a_blink_is_found_with_its_phases():
    t = np.arange(0.0, 3.0, 0.005)
    rows = [(s, o := 0.8 * (1.0 - closure(s - 1.0, *BLINK_S)), o) for s in t]
    (blink,) = blinks(rows)
    assert blink.onset_s == pytest.approx(1.0, abs=0.01)
    assert blink.depth == pytest.approx(1.0, abs=0.01)
    # a phase is what is faster than a twentieth of its peak: the very ends are not
    assert 0.060 < blink.close_s < 0.076
    assert 0.120 < blink.open_s < 0.176
    assert 0.035 <= blink.hold_s < 0.060
    assert blink.close_peak_1_s / blink.open_peak_1_s == pytest.approx(2.0, abs=0.3)


def test_a_wink_a_droop_and_a_glance_down_are_no_blinks():
    t = np.arange(0.0, 4.0, 0.005)
    assert blinks([(s, 0.8 * (1.0 - closure(s - 1.0, *BLINK_S)), 0.8) for s in t]) == []
    down = [(s, o := 0.8 if s < 1.0 else 0.3, o) for s in t]
    assert blinks(down) == []
    shallow = [(s, o := 0.8 * (1.0 - 0.4 * closure(s - 1.0, *BLINK_S)), o) for s in t]
    assert blinks(shallow) == []


def test_the_run_is_told_as_the_models_know_it(ticks: list[Tick]):
    asked, trace = ticks[-1].gaze, gathered(ticks)
    found = [s for s in trace.saccades if s.commanded is not None]
    # Corrections and small shifts within a part are hardly faster than what is no saccade.
    assert len(found) == pytest.approx(asked.saccades, rel=0.15)
    assert len(trace.fixations) == pytest.approx(asked.fixations, rel=0.06)
    assert abs(len(trace.blinks) - asked.blinks) <= 2
    late_s = [s.onset_s - s.commanded.onset_s for s in found if s.commanded]
    assert 0.0 < np.median(late_s) < 0.03  # the servos' lag


def test_the_gaze_is_compared_with_the_partner_and_no_one_beside(ticks: list[Tick]):
    tick = ticks[-1]
    assert tick.percept is not None
    (face,) = tick.percept.faces
    talk = structs.replace(tick.conversation, state="listening", partner=face.id)
    beside = structs.replace(face, id=99, p_world_m=(0.0, 1.0, 0.0))
    percept = structs.replace(tick.percept, faces=(beside, face))
    (row,) = gathered([structs.replace(tick, conversation=talk, percept=percept)]).rows
    assert abs(row["off_partner"]).max() < 10.0


def test_what_is_not_measured_or_stopped_and_a_gap_make_no_events(ticks: list[Tick]):
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
