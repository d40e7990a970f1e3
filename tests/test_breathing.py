"""The sway of a breathing neck."""

from math import degrees

import numpy as np
import pytest

from gazerig.gaze.track.breathing import Breathing, BreathingParams


def sway(model: Breathing, t: np.ndarray) -> np.ndarray:
    return np.degrees([model.step(float(s)) for s in t])


def test_pitch_has_the_depth_and_pace_asked_for() -> None:
    t = np.arange(4.0, 64.0, 0.01)
    angles = sway(Breathing(BreathingParams(pitch_deg=1.2, rate_hz=0.25)), t)
    assert angles[:, 1].max() == pytest.approx(1.2, abs=0.01)
    assert angles[:, 1].min() == pytest.approx(-1.2, abs=0.01)
    rising = ((angles[:-1, 1] < 0.0) & (angles[1:, 1] >= 0.0)).sum()
    assert abs(rising - 15) <= 1
    assert not angles[:, [0, 2]].any()


def test_default_is_within_what_reads_as_calm() -> None:
    par = BreathingParams()
    assert 0.5 <= par.pitch_deg <= 1.5 and 0.2 <= par.rate_hz <= 0.3


def test_it_begins_from_nothing_without_a_jerk() -> None:
    model = Breathing(BreathingParams(pitch_deg=1.5, roll_deg=1.0, rate_hz=0.3))
    model.reset(10.0)
    assert model.step(9.0) == model.step(10.0) == (0.0, 0.0, 0.0)
    t = np.arange(10.0, 20.0, 0.005)
    angles = sway(model, t)
    speed = np.diff(angles, axis=0) / 0.005
    assert np.abs(speed[:20]).max() < 0.05  # the first 100 ms
    assert np.abs(speed).max() <= 1.5 * 2.0 * np.pi * 0.3 * 1.3
    assert np.abs(np.diff(speed, axis=0) / 0.005).max() < 15.0


def test_roll_is_an_option_and_0_is_off() -> None:
    t = np.arange(0.0, 20.0, 0.01)
    rolling = sway(Breathing(BreathingParams(pitch_deg=0.0, roll_deg=0.5)), t)
    assert rolling[:, 2].max() == pytest.approx(0.5, abs=0.01) and not rolling[:, :2].any()
    assert not sway(Breathing(BreathingParams(pitch_deg=0.0)), t).any()


def test_it_is_a_function_of_the_time_alone() -> None:
    one, other = Breathing(BreathingParams()), Breathing(BreathingParams())
    for k in range(1000):
        one.step(k * 0.005)
    assert one.step(5.0) == other.step(5.0)
    assert degrees(abs(one.step(5.0)[1])) > 0.1
