"""Prediction of targets: along a curve, from a period, and what must not be taken for one."""

from collections.abc import Callable
from math import cos, pi, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from gazerig.gaze.angles import norm, sub
from gazerig.gaze.oculomotor.target_prediction import TargetPrediction
from gazerig.gaze.types import Target, Vec3
from gazerig.sim_mock.scenes.scene import min_jerk

EYE = (0.0, 0.0, 0.0)
FRAME_S = 1.0 / 30.0
FAST = 10.0
AGE_S = 0.08
Path = Callable[[float], float]


def at(y: float, v: float, t: float, name: int = 1) -> Target:
    return Target((1.0, y, 0.2), (0.0, v, 0.0), t, "face", name, 0.5, False, None, 1, "")


def target(path: Path, t: float, name: int = 1) -> Target:
    d = 1e-4
    return at(path(t), (path(t + d) - path(t - d)) / (2.0 * d), t, name)


def shown(path: Path, seconds: float, noise_m: float = 0.0,
          fastest: float = FAST) -> TargetPrediction:  # fmt: skip
    """Return a prediction that has seen a path for a time."""
    rng = np.random.default_rng(0)
    prediction = TargetPrediction()
    for k in range(round(seconds / FRAME_S) + 1):
        seen = target(path, k * FRAME_S)
        x, y, z = seen.p_world_m
        prediction.record_target(
            replace(seen, p_world_m=(x, y + noise_m * float(rng.normal()), z)), EYE, fastest
        )
    return prediction


def swing(hz: float, size: float = 0.1) -> Path:
    return lambda t: 0.3 + size * sin(2.0 * pi * hz * t)


def y_of(moved: Vec3) -> float:
    return moved[1]


@pytest.mark.parametrize("hz", [0.5, 0.7, 1.0, 1.5, 2.0])
def test_a_swing_is_recognised_after_one_to_two_cycles_and_predicted(hz: float) -> None:
    path, prediction, known_s = swing(hz), TargetPrediction(), None
    off = []
    for k in range(round(5.0 / hz / FRAME_S)):
        t = k * FRAME_S
        prediction.record_target(target(path, t), EYE, FAST)
        if known_s is None and prediction.sine is not None:
            known_s = t
        if t > 2.0 / hz + 0.2:
            off.append(path(t) + y_of(prediction.displacement(t + AGE_S)) - path(t + AGE_S))
    assert known_s is not None
    # A stretch is looked at every other to every sixth frame.
    assert 0.9 / hz < known_s < 2.0 / hz + 0.2
    assert np.abs(off).max() < 0.03 * 0.1


def test_a_steady_motion_is_extrapolated_with_its_velocity_and_fades() -> None:
    prediction = shown(lambda t: 0.2 * t, 2.0)
    end_s = prediction._at_s
    assert y_of(prediction.displacement(end_s + 0.1)) == pytest.approx(0.02, abs=1e-4)
    assert y_of(prediction.motion(end_s + 0.1)[1]) == pytest.approx(0.2, abs=1e-3)
    # 0.12 s with all of it, then with what a time constant of 0.3 s leaves.
    assert y_of(prediction.motion(end_s + 0.42)[1]) == pytest.approx(0.2 / np.e, rel=0.01)
    assert y_of(prediction.displacement(end_s + 9.0)) == pytest.approx(0.2 * 0.42, rel=0.01)


def test_a_motion_that_slows_down_is_extrapolated_along_its_curve() -> None:
    prediction = shown(lambda t: 0.6 * t - 0.15 * t * t, 1.0)
    assert prediction.sine is None
    moved, speed = prediction.motion(prediction._at_s + AGE_S)
    assert y_of(moved) == pytest.approx(0.3 * AGE_S - 0.15 * AGE_S**2, abs=1e-5)
    assert y_of(speed) == pytest.approx(0.3 - 0.3 * AGE_S, abs=1e-4)


def test_nothing_is_extrapolated_where_a_profile_wants_none() -> None:
    prediction = shown(lambda t: 0.2 * t, 2.0)
    prediction.retune(False, 0.0)
    assert prediction.displacement(2.1) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("lasts_s", [0.4, 0.7, 1.0, 1.5, 2.0])
def test_a_step_aside_and_one_back_are_no_swing(lasts_s: float) -> None:
    def path(t: float) -> float:
        s = (t - 2.0) / lasts_s
        back = (t - 4.5) / lasts_s
        return 0.4 * (min_jerk(min(max(s, 0.0), 1.0)) - min_jerk(min(max(back, 0.0), 1.0)))

    prediction = TargetPrediction()
    for k in range(round(7.0 / FRAME_S)):
        prediction.record_target(target(path, k * FRAME_S), EYE, FAST)
        assert prediction.sine is None


def test_a_person_who_sways_by_a_centimetre_is_not_predicted_from_a_period() -> None:
    prediction = shown(lambda t: 0.01 * sin(2 * pi * 0.5 * t), 6.0)
    assert prediction.sine is None


def test_a_swing_that_stops_is_given_up_within_a_quarter_of_its_period() -> None:
    path = swing(1.5)
    prediction = shown(path, 3.0)
    assert prediction.sine is not None
    end_s, there = prediction._at_s, path(prediction._at_s)
    for k in range(1, 7):
        prediction.record_target(at(there, 0.0, end_s + k * FRAME_S), EYE, FAST)
        if prediction.sine is None:
            break
    assert prediction.sine is None
    assert k * FRAME_S <= 0.25 / 1.5 + FRAME_S


def test_a_glance_elsewhere_does_not_forget_a_swing() -> None:
    path = swing(1.5)
    prediction = shown(path, 3.0)
    end_s = prediction._at_s
    for k in range(1, 16):
        prediction.record_target(at(0.0, 0.0, end_s + k * FRAME_S, name=2), EYE, FAST)
    assert prediction.sine is None
    t = end_s + 16 * FRAME_S
    prediction.record_target(target(path, t), EYE, FAST)
    assert prediction.sine is not None
    assert path(t) + y_of(prediction.displacement(t + AGE_S)) == pytest.approx(
        path(t + AGE_S), abs=0.01
    )
    prediction.record_target(at(0.0, 0.0, t + 1.0, name=2), EYE, FAST)
    prediction.record_target(target(path, t + 4.0), EYE, FAST)
    assert prediction.sine is None  # that was too long ago


def test_a_swing_that_stopped_while_something_else_was_looked_at_is_not_expected() -> None:
    prediction = shown(swing(1.5), 3.0)
    end_s = prediction._at_s
    prediction.record_target(at(0.0, 0.0, end_s + 0.3, name=2), EYE, FAST)
    resting = at(0.3 + 0.1, 0.0, 0.0)
    kept = 0
    for k in range(12):
        prediction.record_target(replace(resting, at_s=end_s + 0.6 + k * FRAME_S), EYE, FAST)
        kept += prediction.sine is not None
    assert prediction.sine is None
    assert kept <= 5


def test_the_head_is_told_the_middle() -> None:
    path = swing(1.0)
    prediction = shown(path, 3.1)
    middle = prediction.to_middle
    assert middle is not None
    assert path(prediction._at_s) + middle[1] == pytest.approx(0.3, abs=0.005)


def test_a_swing_faster_than_pursuit_is_followed_with_less_of_it() -> None:
    hz, size = 1.5, 0.12
    fastest = 0.6 * 2.0 * pi * hz * size / norm((1.0, 0.3, 0.2))
    prediction = shown(swing(hz, size), 3.0, fastest=fastest)
    end_s = prediction._at_s
    speeds = [norm(prediction.motion(end_s + s)[1]) for s in np.linspace(0.0, 0.1, 30)]
    assert max(speeds) <= 0.6 * 2.0 * pi * hz * size * 1.02
    places = [
        prediction._p[1] + y_of(prediction.displacement(end_s)) - 0.3,
        swing(hz, size)(end_s) - 0.3,
    ]
    assert places[0] == pytest.approx(0.6 * places[1], abs=0.012)


def test_noise_of_the_tracker_does_not_hide_a_swing() -> None:
    path = swing(1.0)
    prediction = shown(path, 4.0, noise_m=0.004)
    sine = prediction.sine
    assert sine is not None
    assert sine.w_rad_s == pytest.approx(2.0 * pi, rel=0.03)
    assert sine.size_m == pytest.approx(0.1, rel=0.05)


@settings(deadline=None, max_examples=10)
@given(
    st.lists(st.tuples(st.floats(-2, 2), st.floats(-5, 5)), min_size=2, max_size=60),
    st.floats(0.001, 0.3),
)
def test_whatever_is_seen_predictions_are_finite_and_bounded(
    seen: list[tuple[float, float]], gap_s: float
) -> None:
    prediction = TargetPrediction()
    for k, (y, v) in enumerate(seen):
        prediction.record_target(at(y, v, k * gap_s), EYE, 1.2)
        for age_s in (0.0, 0.05, 0.3, 5.0):
            moved = prediction.displacement(k * gap_s + age_s)
            assert np.isfinite([*moved, *prediction.motion(k * gap_s + age_s)[1]]).all()
            assert norm(sub(moved, (0.0, 0.0, 0.0))) < 10.0


def test_cos_and_sin_of_an_ellipse_are_both_predicted() -> None:
    prediction = TargetPrediction()
    w = 2.0 * pi

    def place(t: float) -> Vec3:
        return 1.0, 0.1 * cos(w * t), 0.2 + 0.06 * sin(w * t)

    for k in range(90):
        t = k * FRAME_S
        v = (0.0, -0.1 * w * sin(w * t), 0.06 * w * cos(w * t))
        prediction.record_target(
            replace(at(0.0, 0.0, t), p_world_m=place(t), v_world_m_s=v), EYE, FAST
        )
    moved = prediction.displacement(t + AGE_S)
    assert norm(sub(moved, sub(place(t + AGE_S), place(t)))) < 0.003


def to_and_fro(hz: float, size: float = 0.1) -> Path:
    """Return a path at one speed between two turns."""
    return lambda t: 0.3 + size * 2.0 / pi * float(np.arcsin(sin(2.0 * pi * hz * t)))


@pytest.mark.parametrize("hz", [0.4, 0.7, 1.2])
def test_motion_at_one_speed_is_no_sine_and_never_outrun(hz: float) -> None:
    path, prediction = to_and_fro(hz), TargetPrediction()
    speed = 4.0 * hz * 0.1
    for k in range(round(6.0 / FRAME_S)):
        t = k * FRAME_S
        prediction.record_target(target(path, t), EYE, FAST)
        assert prediction.sine is None
        assert norm(prediction.motion(t + AGE_S)[1]) <= 1.001 * speed
