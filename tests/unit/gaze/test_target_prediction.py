"""Prediction of targets: along a curve, from a period, and what must not be taken for one."""

from collections.abc import Callable
from math import pi, sin

import numpy as np
import pytest
from msgspec.structs import replace

from gazerig.gaze.oculomotor.target_prediction import TargetPrediction
from gazerig.gaze.types import Target
from gazerig.sim_mock.scenes.scene import min_jerk

EYE = (0.0, 0.0, 0.0)
FRAME_S = 1.0 / 30.0
FAST = 10.0
AGE_S = 0.08
Path = Callable[[float], float]


def at(y, v, t, name=1):
    return Target((1.0, y, 0.2), (0.0, v, 0.0), t, "face", name, 0.5, False, None, 1, "")


def target(path, t, name=1):
    d = 1e-4
    return at(path(t), (path(t + d) - path(t - d)) / (2.0 * d), t, name)


def shown(path, seconds, noise_m=0.0,
          fastest=FAST):  # fmt: skip
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


def swing(hz, size=0.1):
    return lambda t: 0.3 + size * sin(2.0 * pi * hz * t)


def y_of(moved):
    return moved[1]


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
    assert known_s is not None
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
