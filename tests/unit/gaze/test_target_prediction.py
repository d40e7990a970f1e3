"""Prediction of targets: along a curve, from a period, and what must not be taken for one."""

from math import pi, sin

import numpy as np
import pytest

from gazerig.gaze.angles import add, dot, norm, scale
from gazerig.gaze.oculomotor.target_prediction import TargetPrediction
from gazerig.gaze.types import Target
from gazerig.sim_mock.scenes.scene import min_jerk

EYE = (0.0, 0.0, 0.0)
FRAME_S = 1.0 / 30.0
FAST = 10.0
AGE_S = 0.08
PLACE, WAY = (1.0, 0.0, 0.2), (0.48, 0.64, 0.6)


def at(y, v, t):
    """Return a frame of a target that moves aslant, along all axes."""
    p = add(PLACE, scale(WAY, y))
    return Target(p, scale(WAY, v), t, "face", 1, 0.5, False, None, 1, "")


def target(path, t):
    d = 1e-4
    return at(path(t), (path(t + d) - path(t - d)) / (2.0 * d), t)


def shown(path, seconds, fastest=FAST):
    """Return a prediction that has seen a path for a time."""
    prediction = TargetPrediction()
    for k in range(round(seconds / FRAME_S) + 1):
        prediction.record_target(target(path, k * FRAME_S), EYE, fastest)
    return prediction


def swing(hz, size=0.1):
    return lambda t: 0.3 + size * sin(2.0 * pi * hz * t)


def y_of(moved):
    """Return a motion along the path, which is all of it."""
    along = dot(moved, WAY)
    assert moved == pytest.approx(scale(WAY, along), abs=1e-9)
    return along


@pytest.mark.parametrize("hz", [0.5, 0.7, 1.0, 1.5, 2.0])
def test_a_swing_is_recognised_after_one_to_two_cycles_and_predicted(hz):
    path, prediction, known_s = swing(hz), TargetPrediction(), None
    off = []
    for k in range(round(5.0 / hz / FRAME_S)):
        t = k * FRAME_S
        prediction.record_target(target(path, t), EYE, FAST)
        if known_s is None and prediction.sine is not None:
            known_s = t
        if t > 2.0 / hz + 0.2:
            off.append(path(t) + y_of(prediction.displacement(t + AGE_S)) - path(t + AGE_S))
    assert known_s is not None and prediction.size_m == pytest.approx(0.1, rel=0.02)
    assert prediction.to_middle == pytest.approx(scale(WAY, 0.3 - path(t)), abs=0.003)
    # A stretch is looked at every other to every sixth frame.
    assert 0.9 / hz < known_s < 2.0 / hz + 0.2
    assert np.abs(off).max() < 0.03 * 0.1


def test_a_steady_motion_is_extrapolated_with_its_velocity_and_fades():
    prediction = shown(lambda t: 0.2 * t, 2.0)
    end_s = 2.0
    assert y_of(prediction.displacement(end_s + 0.1)) == pytest.approx(0.02, abs=1e-4)
    assert y_of(prediction.motion(end_s + 0.1)[1]) == pytest.approx(0.2, abs=1e-3)
    # 0.12 s with all of it, then with what a time constant of 0.3 s leaves.
    assert y_of(prediction.motion(end_s + 0.42)[1]) == pytest.approx(0.2 / np.e, rel=0.01)
    assert y_of(prediction.displacement(end_s + 9.0)) == pytest.approx(0.2 * 0.42, rel=0.01)


def test_no_motion_is_extrapolated_faster_than_it_can_be_followed():
    moved, speed = shown(lambda t: 0.2 * t, 2.0, 0.1).motion(2.1)
    most_m_s = 0.1 * norm(add(PLACE, scale(WAY, 0.4)))
    assert (y_of(moved), y_of(speed)) == pytest.approx((0.1 * most_m_s, most_m_s))
    # A faster swing is followed with a smaller amplitude.
    most_m_s = 0.3 * norm(add(PLACE, scale(WAY, 0.3)))
    sways = shown(swing(1.0), 3.0, 0.3)
    assert y_of(sways.motion(3.0)[1]) == pytest.approx(most_m_s, rel=0.01)
    there = most_m_s / (2.0 * pi) * sin(0.2 * pi)
    assert y_of(sways.displacement(3.1)) == pytest.approx(there, rel=0.01)


def test_a_motion_that_slows_down_is_extrapolated_along_its_curve():
    prediction = shown(lambda t: 0.6 * t - 0.15 * t * t, 1.0)
    assert prediction.sine is None
    moved, speed = prediction.motion(1.0 + AGE_S)
    assert y_of(moved) == pytest.approx(0.3 * AGE_S - 0.15 * AGE_S**2, abs=1e-5)
    assert y_of(speed) == pytest.approx(0.3 - 0.3 * AGE_S, abs=1e-4)


def test_nothing_is_extrapolated_where_a_profile_wants_none():
    prediction = shown(lambda t: 0.2 * t, 2.0)
    prediction.retune(False, 0.0)
    assert prediction.displacement(2.1) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("lasts_s", [0.4, 0.7, 1.0, 1.5, 2.0])
def test_a_step_aside_and_one_back_are_no_swing(lasts_s):
    def path(t):
        s = (t - 2.0) / lasts_s
        back = (t - 4.5) / lasts_s
        return 0.4 * (min_jerk(min(max(s, 0.0), 1.0)) - min_jerk(min(max(back, 0.0), 1.0)))

    prediction = TargetPrediction()
    for k in range(round(7.0 / FRAME_S)):
        prediction.record_target(target(path, k * FRAME_S), EYE, FAST)
        assert prediction.sine is None


def test_a_swing_that_stops_is_given_up_within_a_quarter_of_its_period():
    path = swing(1.5)
    prediction = shown(path, 3.0)
    assert prediction.sine is not None
    end_s, there = 3.0, path(3.0)
    for k in range(1, 7):
        prediction.record_target(at(there, 0.0, end_s + k * FRAME_S), EYE, FAST)
        if prediction.sine is None:
            break
    assert prediction.sine is None
    assert k * FRAME_S <= 0.25 / 1.5 + FRAME_S
