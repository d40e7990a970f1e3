"""Saccade profile: eqs 2-6 of Mitake et al."""

from math import degrees, radians

import numpy as np
import pytest

from gazerig.gaze.minimum_jerk import min_jerk
from gazerig.gaze.oculomotor.saccade import (
    MinJerkProfile,
    SaccadeModel,
    SaccadeParams,
)

human_norms = pytest.importorskip("gazerig.features.lab.analysis.human_norms")

SACCADE = SaccadeModel(SaccadeParams(profile="min_jerk")).profile


def at(amplitude_deg: float, *times_ms: float) -> list[float]:
    return [degrees(SACCADE.displacement_rad(radians(amplitude_deg), t / 1e3)) for t in times_ms]


def test_e1_largest_amplitude_below_the_cap():
    assert degrees(MinJerkProfile(8.7266, 0.05).largest_uncapped_rad) == pytest.approx(
        13.333, abs=0.001
    )


def test_e2_small_saccade():
    expected = [0.58, 3.17, 6.83, 9.42, 10.00]
    assert at(10.0, 10, 20, 30, 40, 50) == pytest.approx(expected, abs=0.05)


def test_e3_large_saccade():
    assert SACCADE.duration_s(radians(40.0)) == pytest.approx(0.10333, abs=0.0005)
    assert at(40.0, 20, 60, 100) == pytest.approx([4.23, 24.17, 39.96], abs=0.05)


def test_e6_speed_cap():
    for size in np.linspace(30.0, 100.0, 8):
        times = np.arange(0.0, SACCADE.duration_s(radians(size)) * 1e3 + 1.0, 0.25)
        speeds = np.diff(at(size, *times)) / 0.25e-3
        assert speeds.max() == pytest.approx(500.0, rel=0.01)
        assert speeds.max() <= 500.0 * (1.0 + 1e-9)


def test_min_jerk_is_held_at_its_ends():
    assert [min_jerk(s) for s in (-1.0, 0.0, 0.5, 1.0, 2.0)] == [0.0, 0.0, 0.5, 1.0, 1.0]


HUMAN = SaccadeModel(SaccadeParams()).profile
FRAMES = SaccadeModel(SaccadeParams(profile="literal_frame")).profile


@pytest.mark.parametrize("most", [500.0, 5000.0, 20_000.0])
@pytest.mark.parametrize("size", [0.5, 3.0, 10.0, 30.0])
def test_a_saccade_keeps_the_acceleration_that_the_servos_follow(most: float, size: float):
    saccade = SaccadeModel(SaccadeParams(max_acceleration_deg_s2=most)).profile
    times = np.linspace(0.0, saccade.duration_s(radians(size)), 4001)
    angles = np.degrees([saccade.displacement_rad(radians(size), t) for t in times])
    acceleration = np.diff(angles, 2) / (times[1] - times[0]) ** 2
    assert np.abs(acceleration).max() <= 1.01 * most
    if most == 500.0:  # as fast as it allows
        assert acceleration.max() > 0.95 * most


@pytest.mark.parametrize("cap", [100.0, 500.0])
@pytest.mark.parametrize("size", [0.1, 5.0, 20.0, 90.0])
def test_the_human_profile_is_smooth_capped_and_ends_on_its_amplitude(cap: float, size: float):
    saccade = SaccadeModel(SaccadeParams(max_speed_deg_s=cap)).profile
    duration = saccade.duration_s(radians(size))
    times = np.linspace(-0.1 * duration, 1.1 * duration, 6001)
    angles = np.degrees([saccade.displacement_rad(radians(size), t) for t in times])
    speeds = np.diff(angles) / np.diff(times)
    assert angles[0] == 0.0
    assert angles[-1] == pytest.approx(size, abs=1e-9)
    assert speeds.min() >= -1e-6
    assert speeds.max() <= cap * (1.0 + 1e-9)
    # No step of the speed anywhere.
    assert np.abs(np.diff(speeds)).max() <= 44_500.0 * (times[1] - times[0])


def test_human_peak_comes_earlier_in_large_saccades():
    def peak_at(size: float) -> float:
        times = np.linspace(0.0, HUMAN.duration_s(radians(size)), 4001)
        angles = np.array([HUMAN.displacement_rad(radians(size), t) for t in times])
        speeds = np.diff(angles)
        return float(np.mean(np.nonzero(speeds > speeds.max() * 0.9999)[0])) / 4000

    small, large = peak_at(8.0), peak_at(60.0)
    # The shaft's peak is later than the law's: row 6 of tests/judges/human has that.
    assert human_norms.acceleration_share(8.0) - 0.16 < small < human_norms.acceleration_share(8.0)
    assert large == pytest.approx(human_norms.acceleration_share(60.0), abs=0.05)
    assert peak_at(20.0) < 0.85 * small  # in people .39 against .45, on the shaft


def test_literal_frames_leave_a_fifth_at_each_and_do_not_know_the_tick():
    frame = 0.0111
    for frames in (1, 2, 3):
        done = FRAMES.displacement_rad(radians(10.0), frames * frame)
        assert degrees(done) == pytest.approx(10.0 * (1.0 - 0.2**frames))
    # The time constant at 90 pictures a second.
    assert FRAMES.displacement_rad(1.0, 0.0069) == pytest.approx(0.632, abs=0.002)


def test_literal_saccade_lands_when_a_twentieth_of_a_degree_remains():
    lasts = FRAMES.duration_s(radians(10.0))
    assert degrees(FRAMES.displacement_rad(radians(10.0), lasts - 1e-9)) == pytest.approx(9.95)
    assert FRAMES.displacement_rad(radians(10.0), lasts) == radians(10.0)
    assert FRAMES.duration_s(radians(0.01)) == 0.0111
