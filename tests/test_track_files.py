"""Files of tracks, and fits of keys to samples."""

from math import pi

import numpy as np

from gazerig.gaze.track.minimum_jerk_curve import MinimumJerkCurve
from gazerig.robot.app.track_file import TOLERANCE_DEG
from gazerig.robot.model.motion_keys import fit_keys, smooth


def test_a_motion_sampled_densely_becomes_few_keys_within_the_tolerance() -> None:
    random = np.random.default_rng(3)
    times = np.cumsum(random.uniform(0.015, 0.025, 200))
    truth = 12.0 * np.sin(2 * pi * 0.6 * times) * np.minimum(1.0, times)
    even, values_deg = smooth(times, truth + random.normal(0.0, 0.15, 200))
    found, values = fit_keys(even, values_deg, TOLERANCE_DEG)
    assert 4 <= len(found) <= 30
    curve = MinimumJerkCurve(float(values_deg[0]), found.tolist(), values.tolist())
    assert np.abs(curve.sample_at(even)[0] - values_deg).max() <= TOLERANCE_DEG
    assert np.abs(curve.sample_at(times - times[0])[0] - truth).max() < TOLERANCE_DEG + 0.6
    held = np.concatenate((values_deg, np.full(50, values_deg[-1]), values_deg[::-1]))
    long = np.tile(np.concatenate((held, np.full(50, values_deg[0]))), 20)
    times = np.arange(len(long)) * (even[1] - even[0])
    many, values = fit_keys(times, long, TOLERANCE_DEG)
    curve = MinimumJerkCurve(float(long[0]), many.tolist(), values.tolist())
    assert np.abs(curve.sample_at(times)[0] - long).max() <= TOLERANCE_DEG
    assert len(many) <= 20 * (2 * len(found) + 4)
    still = fit_keys(even, np.full(len(even), 3.0), TOLERANCE_DEG)
    assert len(still[0]) == 0
