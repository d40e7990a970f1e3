"""The drift of a head at rest: breathing, and random sway."""

import numpy as np
import pytest

from gazerig.gaze.oculomotor.drift import Drift

DT = 0.005
STEP_DEG = 360.0 / 4096.0


def trace(seconds, seed=0, dt_s=DT, loudness=None):
    """Return yaw, pitch and roll of a drift from rest, (n, 3) degrees."""
    model = Drift("people", np.random.default_rng(seed))
    model.speak(loudness)
    return np.degrees([model.step(k * dt_s) for k in range(round(seconds / dt_s))])


def test_it_has_the_size_of_people_and_is_quiet_for_servos():
    angles = np.concatenate([trace(150.0, seed, 0.05) for seed in range(8)])
    breath = 0.6 / np.sqrt(2.0)
    assert angles.std(axis=0) == pytest.approx([0.6, np.hypot(0.4, breath), 0.6], rel=0.15)
    assert np.abs(angles).max() < 0.6 * 4.5, "bounded: no octave leaves its size"
    assert np.abs(np.diff(trace(40.0), axis=0)).max() < 0.2 * STEP_DEG


def test_a_breath_takes_four_seconds_and_slow_motion_has_more_power_than_fast():
    hz = np.fft.rfftfreq(round(240.0 / 0.1), 0.1)
    spectra = [np.abs(np.fft.rfft(trace(240.0, seed, 0.1), axis=0)) ** 2 for seed in range(6)]
    yaw, pitch, _ = np.mean(spectra, axis=0).T
    assert hz[5 + pitch[5:].argmax()] == pytest.approx(0.25, abs=0.01)
    bands = ((0.02, 0.06), (0.06, 0.2), (0.6, 2.0))
    slow, middle, fast = (yaw[(hz >= a) & (hz < b)].mean() for a, b in bands)
    assert slow > 1.5 * middle > 20.0 * fast


def test_it_starts_in_the_middle_smoothly_and_whatever_the_rate():
    angles = trace(20.0)
    assert np.abs(angles[:3]).max() < 1e-3
    speed = np.abs(np.diff(angles, axis=0)) / DT
    assert speed.max() < 4.0 and np.abs(np.diff(angles, 2, axis=0)).max() / DT**2 < 40.0
    coarse = trace(20.0, dt_s=0.02)
    assert np.abs(coarse - angles[::4]).max() < 0.6, "the same draws"


def test_a_speaker_moves_faster_but_quietly_for_servos():
    silent, low, loud = (
        np.abs(np.diff(trace(60.0, loudness=one), axis=0)) for one in (None, 0.05, 1.0)
    )
    assert loud.mean() > 1.5 * low.mean() > 2.0 * silent.mean() and loud.max() < 2.0 * STEP_DEG


def test_it_begins_and_ends_gradually_and_none_draws_nothing():
    rng = np.random.default_rng(1)
    model = Drift("none", rng)
    assert model.step(0.0) == (0.0, 0.0, 0.0)
    assert rng.random() == np.random.default_rng(1).random()
    model.retune("people")
    there = np.degrees([model.step(k * DT) for k in range(4000)])
    model.retune("none")
    back = np.degrees([model.step((4000 + k) * DT) for k in range(400)])
    assert np.abs(np.diff(np.concatenate((there, back)), axis=0)).max() < 0.05
    assert np.abs(there).max() > 0.3 and not back[-1].any()
