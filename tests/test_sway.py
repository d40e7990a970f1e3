"""The random sway of the head at rest."""

import numpy as np
import pytest

from gazerig.gaze.track.sway import Sway, SwayParams
from gazerig.gaze.types import Floats

DT = 0.005
STEP_DEG = 360.0 / 4096.0


def trace(params: SwayParams, seconds: float, seed: int = 0, dt_s: float = DT) -> Floats:
    """Return yaw, pitch and roll of a sway from rest, (n, 3) degrees."""
    model = Sway(params, np.random.default_rng(seed))
    return np.degrees([model.step(k * dt_s) for k in range(round(seconds / dt_s))])


def test_it_has_the_size_asked_for_and_is_quiet_for_servos() -> None:
    params = SwayParams(yaw_deg=0.6, pitch_deg=0.3, roll_deg=0.0)
    angles = np.concatenate([trace(params, 150.0, seed) for seed in range(8)])
    assert angles.std(axis=0) == pytest.approx([0.6, 0.3, 0.0], rel=0.15)
    assert np.abs(angles).max() < 0.6 * 4.5, "bounded: no octave leaves its size"
    steps = np.abs(np.diff(trace(SwayParams(), 150.0), axis=0)).max()
    assert steps < 0.2 * STEP_DEG


def test_slow_motion_has_more_power_than_fast() -> None:
    hz = np.fft.rfftfreq(round(240.0 / 0.02), 0.02)
    spectra = [
        np.abs(np.fft.rfft(trace(SwayParams(), 240.0, seed, 0.02)[:, 0])) ** 2 for seed in range(6)
    ]
    power = np.mean(spectra, axis=0)
    bands = ((0.02, 0.06), (0.06, 0.2), (0.6, 2.0))
    slow, middle, fast = (power[(hz >= a) & (hz < b)].mean() for a, b in bands)
    assert slow > 1.5 * middle > 20.0 * fast


def test_it_starts_in_the_middle_smoothly_and_whatever_the_rate() -> None:
    angles = trace(SwayParams(), 20.0)
    assert np.abs(angles[:3]).max() < 1e-3
    speed = np.abs(np.diff(angles, axis=0)) / DT
    assert speed.max() < 4.0 and np.abs(np.diff(angles, 2, axis=0)).max() / DT**2 < 40.0
    coarse = trace(SwayParams(), 20.0, dt_s=0.02)
    assert np.abs(coarse - angles[::4]).max() < 0.6, "the same draws"


def test_without_a_generator_or_a_size_it_is_still() -> None:
    assert Sway(SwayParams()).step(5.0) == (0.0, 0.0, 0.0)
    rng = np.random.default_rng(0)
    still = Sway(SwayParams(0.0, 0.0, 0.0), rng)
    assert still.step(5.0) == (0.0, 0.0, 0.0)
    assert rng.random() == np.random.default_rng(0).random(), "it draws nothing"


def test_a_retuned_size_glides() -> None:
    model = Sway(SwayParams(), np.random.default_rng(1))
    before = [model.step(k * DT)[0] for k in range(4000)][-1]
    model.retune(SwayParams(yaw_deg=0.0, pitch_deg=0.0, roll_deg=0.0))
    yaws = [before, *(model.step((4000 + k) * DT)[0] for k in range(400))]
    assert np.degrees(np.abs(np.diff(yaws))).max() < 0.05 and yaws[-1] == 0.0


def test_the_slowest_is_not_faster_than_the_fastest() -> None:
    with pytest.raises(ValueError, match="slowest_s must not be below fastest_s"):
        SwayParams(fastest_s=2.0, slowest_s=1.0)
