"""Saccade profile: eqs 2-6 of Mitake et al. Numbered checks are listed in docs/checks.md."""

from math import degrees, radians

import numpy as np
import pytest

from gaze.saccade import Saccade, SaccadeParams, min_jerk

SACCADE = Saccade(SaccadeParams())


def at(amplitude_deg: float, *times_ms: float) -> list[float]:
    return [degrees(SACCADE.displacement_rad(radians(amplitude_deg), t / 1e3)) for t in times_ms]


def test_e1_largest_amplitude_below_the_cap() -> None:
    assert degrees(SACCADE.largest_uncapped_rad) == pytest.approx(13.333, abs=0.001)


def test_e2_small_saccade() -> None:
    expected = [0.58, 3.17, 6.83, 9.42, 10.00]
    assert at(10.0, 10, 20, 30, 40, 50) == pytest.approx(expected, abs=0.05)


def test_e3_large_saccade() -> None:
    assert SACCADE.duration_s(radians(40.0)) == pytest.approx(0.10333, abs=0.0005)
    assert at(40.0, 20, 60, 100) == pytest.approx([4.23, 24.17, 39.96], abs=0.05)


def test_e5_main_sequence_slope() -> None:
    sizes = np.linspace(14.0, 60.0, 10)
    durations = [SACCADE.duration_s(radians(a)) * 1e3 for a in sizes]
    slope, intercept = np.polyfit(sizes, durations, 1)
    assert slope == pytest.approx(2.0, abs=0.02)
    assert intercept == pytest.approx(23.3, abs=1.0)


def test_e6_speed_cap() -> None:
    for size in np.linspace(30.0, 100.0, 8):
        times = np.arange(0.0, SACCADE.duration_s(radians(size)) * 1e3 + 1.0, 0.25)
        speeds = np.diff(at(size, *times)) / 0.25e-3
        assert speeds.max() == pytest.approx(500.0, rel=0.01)
        assert speeds.max() <= 500.0 * (1.0 + 1e-9)
        assert degrees(SACCADE.peak_speed_rad_s(radians(size))) == pytest.approx(500.0)


@pytest.mark.parametrize("size", [0.1, 5.0, 13.33, 13.34, 25.0, 90.0])
def test_profile_is_continuous_and_ends_on_its_amplitude(size: float) -> None:
    times = np.arange(-5.0, SACCADE.duration_s(radians(size)) * 1e3 + 20.0, 0.05)
    positions = np.array(at(size, *times))
    speeds = np.diff(positions) / 0.05e-3
    assert positions[0] == 0.0
    assert positions[-1] == pytest.approx(size, abs=1e-9)
    assert speeds.min() >= -1e-6
    # 30 792 deg/s2 is the profile's own highest acceleration.
    assert np.abs(np.diff(speeds)).max() <= 30_800.0 * 0.05e-3 * 1.01


def test_uneven_ticks_land_on_the_same_curve() -> None:
    expected = [0.77, 4.23, 9.17, 14.17, 18.38, 19.96]
    assert at(20.0, 10, 20, 30, 40, 50, 60) == pytest.approx(expected, abs=0.01)
    assert at(20.0, 7.0, 50.0, 51.0)[1] == at(20.0, 50.0)[0]


def test_min_jerk_is_held_at_its_ends() -> None:
    assert [min_jerk(s) for s in (-1.0, 0.0, 0.5, 1.0, 2.0)] == [0.0, 0.0, 0.5, 1.0, 1.0]
