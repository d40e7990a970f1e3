"""Saccades and blinks found in traces whose truth is known, and before an independent judge."""

from math import cos, radians, sin
from statistics import median

import numpy as np
import pytest

from gazerig.config.schema import load_rig
from gazerig.features.lab.report.gaze_trace import GazeTrace, GazeTraceBuilder
from gazerig.features.lab.report.landing import planned_saccades
from gazerig.gaze.lids.lids import LidParams, Lids
from gazerig.gaze.oculomotor.saccade import SaccadeModel as Jumps
from gazerig.gaze.oculomotor.saccade import SaccadeParams
from gazerig.gaze.types import Vec3
from gazerig.robot.analysis.blink_finder import BlinkEvent, BlinkFinder
from gazerig.robot.analysis.event_detector import EventDetector, FixationEvent, SaccadeEvent
from gazerig.robot.analysis.saccade_finder import Jump, SaccadeFinder
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.loop import Tick, run

pytestmark = pytest.mark.usefixtures("ideal_servos")

SECONDS = 40.0
STEP_DEG = 360.0 / 4096.0


@pytest.fixture(scope="module")
def ticks() -> list[Tick]:
    made = assemble(load_rig("desk"), RunOptions(True, True, 0, "face-to-face"))
    seen: list[Tick] = []
    made.robot.start(made.clock)
    run(made.robot, made.clock, made.loop, lambda s: "over" if s > SECONDS else None, seen.append)
    made.robot.stop()
    made.close()
    return seen


@pytest.fixture(scope="module")
def gathered(ticks: list[Tick]) -> GazeTrace:
    gathering = GazeTraceBuilder()
    for tick in ticks:
        gathering.update(tick)
    return gathering.trace()


def at(yaw_deg: float) -> Vec3:
    return cos(radians(yaw_deg)), sin(radians(yaw_deg)), 0.0


def jumps(yaw_deg: np.ndarray, rate_hz: float) -> list[Jump]:
    finder = SaccadeFinder()
    found = (finder.update(k / rate_hz, at(float(yaw))) for k, yaw in enumerate(yaw_deg))
    return [jump for jump in found if jump is not None]


def stepped(yaw_deg: np.ndarray) -> np.ndarray:
    return np.round(yaw_deg / STEP_DEG) * STEP_DEG


def trace(amplitudes: tuple[float, ...], rate_hz: float, slow_deg_s: float = 0.0) -> np.ndarray:
    """Jump every half second, onto something that moves with ``slow_deg_s``."""
    t = np.arange(0.0, 0.5 * len(amplitudes) + 0.5, 1.0 / rate_hz)
    jump, yaw = Jumps(SaccadeParams(profile="min_jerk")), slow_deg_s * t
    for n, size in enumerate(amplitudes):
        gone = [jump.displacement_rad(radians(abs(size)), s - 0.25 - 0.5 * n) for s in t]
        yaw = yaw + np.sign(size) * np.degrees(gone)
    return yaw


SIZES = (2.0, -3.0, 5.0, -8.0, 12.0, -20.0, 30.0, -30.0, 1.5, -10.0)


@pytest.mark.parametrize("rate_hz", [100.0, 200.0, 250.0, 1000.0])
def test_every_jump_is_found_with_its_size_time_and_speed(rate_hz: float) -> None:
    found = jumps(stepped(trace(SIZES, rate_hz)), rate_hz)
    assert len(found) == len(SIZES)
    law = Jumps(SaccadeParams(profile="min_jerk"))
    for n, (jump, size) in enumerate(zip(found, SIZES, strict=True)):
        size = radians(abs(size))
        assert np.radians(jump.amplitude_deg) == pytest.approx(size, rel=0.08, abs=0.002)
        assert jump.onset_s == pytest.approx(0.25 + 0.5 * n, abs=0.012)
        assert jump.duration_s == pytest.approx(law.duration_s(size), abs=0.016)
        low = 0.8 if rate_hz == 100.0 else 0.92
        peak = np.degrees(law.peak_speed_rad_s(size))
        assert low * peak - 5.0 < jump.peak_deg_s < 1.1 * peak + 12.0
        assert jump.peak_at == pytest.approx(0.5, abs=0.12)


@pytest.mark.parametrize("slow_deg_s", [10.0, 25.0, 45.0])
def test_following_is_no_saccade_and_hides_none(slow_deg_s: float) -> None:
    assert len(jumps(stepped(trace((0.0,) * 4, 200.0, slow_deg_s)), 200.0)) <= 1  # its onset
    found = jumps(stepped(trace((0.0, 0.0, 4.0, -6.0, 8.0), 200.0, slow_deg_s)), 200.0)
    sizes = [jump.amplitude_deg for jump in found if jump.onset_s > 1.0]
    moved = 0.05 * slow_deg_s
    assert sizes == pytest.approx([4.0 + moved, 6.0 - moved, 8.0 + moved], abs=0.6)


def test_an_early_peak_is_told_from_a_symmetric_one() -> None:
    law = Jumps(SaccadeParams(profile="human"))
    t = np.arange(0.0, 0.6, 0.005)
    yaw = np.degrees([law.displacement_rad(radians(40.0), s - 0.25) for s in t])
    (jump,) = jumps(yaw, 200.0)
    assert jump.peak_at < 0.46


def test_noise_and_a_gap_make_no_saccade() -> None:
    noise = np.random.default_rng(1).normal(0.0, 0.03, 2000)
    assert jumps(noise, 200.0) == []
    finder = SaccadeFinder()
    times = [*np.arange(0.0, 1.0, 0.005), *np.arange(1.2, 2.0, 0.005)]
    assert not any(finder.update(t, at(0.0 if t < 1.1 else 15.0)) for t in times)


def test_an_eye_that_swings_back_has_landed_where_it_turned() -> None:
    t = np.arange(0.0, 1.0, 0.005)
    law = Jumps(SaccadeParams(profile="min_jerk"))
    yaw = np.degrees([law.displacement_rad(radians(10.0), s - 0.25) for s in t])
    since = np.maximum(0.0, t - 0.30)
    yaw = yaw + 2.0 * np.sin(2 * np.pi * since / 0.09) * np.exp(-since / 0.03) * (t > 0.30)
    first = jumps(yaw, 200.0)[0]
    assert first.amplitude_deg == pytest.approx(11.0, abs=1.2)
    assert first.duration_s < 0.085


def blinks(openings: list[tuple[float, float, float]]) -> list[BlinkEvent]:
    finder = BlinkFinder()
    return [blink for row in openings if (blink := finder.update(*row)) is not None]


def test_a_blink_is_found_with_its_phases() -> None:
    lids = Lids(LidParams(), np.random.default_rng(0))
    t = np.arange(0.0, 3.0, 0.005)
    rows = [(s, o := 0.8 * (1.0 - lids.closure(s - 1.0)), o) for s in t]
    (blink,) = blinks(rows)
    assert blink.onset_s == pytest.approx(1.0, abs=0.01)
    assert blink.depth == pytest.approx(1.0, abs=0.01)
    # a phase is what is faster than a twentieth of its peak: the very ends are not
    assert 0.060 < blink.close_s < 0.076
    assert 0.120 < blink.open_s < 0.176
    assert 0.035 <= blink.hold_s < 0.060
    assert blink.close_peak_1_s / blink.open_peak_1_s == pytest.approx(2.0, abs=0.3)


def test_a_wink_a_droop_and_a_glance_down_are_no_blinks() -> None:
    t = np.arange(0.0, 4.0, 0.005)
    lids = Lids(LidParams(), np.random.default_rng(0))
    assert blinks([(s, 0.8 * (1.0 - lids.closure(s - 1.0)), 0.8) for s in t]) == []
    down = [(s, o := 0.8 if s < 1.0 else 0.3, o) for s in t]
    assert blinks(down) == []
    shallow = [(s, o := 0.8 * (1.0 - 0.4 * lids.closure(s - 1.0)), o) for s in t]
    assert blinks(shallow) == []


def test_the_run_is_told_as_the_models_know_it(ticks: list[Tick], gathered: GazeTrace) -> None:
    asked = ticks[-1].gaze
    found = [s for s in gathered.saccades if s.commanded is not None]
    # Corrections and small shifts within a part are hardly faster than what is no saccade.
    assert len(found) == pytest.approx(asked.saccades, rel=0.15)
    large = np.count_nonzero(planned_saccades(gathered)[:, 2] >= 1.0)
    assert np.count_nonzero([s.amplitude_deg >= 1.0 for s in found]) == pytest.approx(
        large, rel=0.04
    )
    assert len(gathered.fixations) == pytest.approx(asked.fixations, rel=0.06)
    assert abs(len(gathered.blinks) - asked.blinks) <= 2
    late_s = [s.onset_s - s.commanded.onset_s for s in found if s.commanded]
    assert 0.0 < median(late_s) < 0.03  # the servos' lag
    ratio = [s.amplitude_deg / s.commanded.amplitude_deg for s in found if s.commanded]
    assert median(ratio) == pytest.approx(1.0, abs=0.08)
    parts = [f.part == f.wanted for f in gathered.fixations if f.wanted is not None]
    assert np.mean(parts) > 0.95
    assert all(f.duration_s > 0.03 for f in gathered.fixations)


def test_an_independent_judge_finds_the_same_saccades(gathered: GazeTrace) -> None:
    pymovements = pytest.importorskip("pymovements")
    t = 1e3 * gathered.column("t")
    ms = np.arange(int(t[0]) + 1, int(t[-1]))
    gaze = [np.interp(ms, t, gathered.column(name)) for name in ("gaze_yaw", "gaze_pitch")]
    screen = pymovements.Experiment(1920, 1080, 60, 34, 65, "center", 1000)
    recording = pymovements.gaze.from_numpy(time=ms, position=np.stack(gaze), experiment=screen)
    recording.pos2vel("savitzky_golay", window_length=21, degree=2)
    recording.detect(
        "microsaccades", minimum_duration=15, threshold=(30.0, 30.0), threshold_factor=1.0
    )
    theirs = recording.events.frame["onset"].to_numpy()
    ours = np.array([1e3 * s.onset_s for s in gathered.saccades if s.amplitude_deg >= 1.0])
    assert len(ours) > 80
    apart = np.abs(theirs[None] - ours[:, None])
    assert np.mean(apart.min(axis=1) <= 15.0) >= 0.95
    assert np.mean(apart.min(axis=0) <= 15.0) >= 0.93
    # and it is the onsets that agree
    assert np.mean(np.abs(apart - 60.0).min(axis=1) <= 5.0) < 0.4


def test_what_is_not_measured_or_stopped_makes_no_events(ticks: list[Tick]) -> None:
    missing = [
        tick._replace(joints=tick.joints._replace(missing=("left_eye_pan",))) for tick in ticks
    ]
    events = EventDetector()
    found = [event for tick in missing[:4000] for event in events.update(tick)]
    assert not any(isinstance(event, SaccadeEvent | FixationEvent) for event in found)
    events = EventDetector()
    stopped = [tick._replace(stopped="somebody did") for tick in ticks[:4000]]
    assert [event for tick in stopped for event in events.update(tick)] == []


def test_events_come_soon(ticks: list[Tick]) -> None:
    events = EventDetector()
    late_s = []
    for tick in ticks:
        late_s += [tick.t_s - e.end_s for e in events.update(tick) if isinstance(e, SaccadeEvent)]
    assert len(late_s) > 80
    assert max(late_s) < 0.2 and median(late_s) < 0.03
