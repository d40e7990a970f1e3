"""Saccade profile: eqs 2-6 of Mitake et al."""

from math import degrees, exp, radians

import numpy as np
import pytest

from gazerig.gaze.minimum_jerk import PEAK_SPEED, min_jerk
from gazerig.gaze.oculomotor.saccade import (
    MinJerkProfile,
    SaccadeModel,
    SaccadeParams,
)

SACCADE = SaccadeModel(SaccadeParams(profile="min_jerk")).profile


def at(amplitude_deg, *times_ms):
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


FRAMES = SaccadeModel(SaccadeParams(profile="literal_frame")).profile


@pytest.mark.parametrize(("size", "share"), [(10.0, 0.25), (24.0, 0.18), (38.0, 0.11)])
def test_a_human_saccade_rises_cruises_and_falls(size, share):
    """Duration and peak as published; rise and fall are such that it ends on its amplitude."""
    D, V = 0.025 + 0.0025 * size, 530.0 * (1.0 - exp(-size / 11.0))
    flanks = (V * D - size) / V / (1.0 - 1.0 / PEAK_SPEED)
    rise, fall = share * flanks, (1.0 - share) * flanks
    fast = SaccadeModel(SaccadeParams("human", 1000.0, 200_000.0)).profile
    assert fast.duration_s(radians(size)) == pytest.approx(D)
    risen, half = V * rise / PEAK_SPEED, 2.0 * V / PEAK_SPEED * min_jerk(0.25)
    for t, done in (
        (-1.0, 0.0), (rise / 2.0, half * rise), (rise, risen), (D - fall, risen + V * (D - flanks)),
        (D - fall / 2.0, size - half * fall), (2.0 * D, size),
    ):  # fmt: skip
        assert degrees(fast.displacement_rad(radians(size), t)) == pytest.approx(done)


@pytest.mark.parametrize(
    ("size", "cap", "most", "lasts_s"),
    [
        (0.0, 500.0, 44_000.0, 0.025),
        # No cruise: A = V D / 1.875 at V = sqrt(1.875 A most share / 1.5396).
        (3.0, 1000.0, 500.0, 0.213495), (40.0, 1000.0, 500.0, 1.284356),
        # A cruise at the cap, and a rise and fall of 1.5396 cap / (most .2).
        (20.0, 100.0, 44_000.0, 0.2 + 0.0174955 * (1.0 - 1.0 / 1.875)),
    ],
)  # fmt: skip
def test_limits_of_speed_and_acceleration_take_time(size, cap, most, lasts_s):
    profile = SaccadeModel(SaccadeParams("human", cap, most)).profile
    assert profile.duration_s(radians(size)) == pytest.approx(lasts_s, rel=1e-4)


@pytest.mark.parametrize("most", [500.0, 5000.0, 20_000.0])
@pytest.mark.parametrize("size", [0.5, 3.0, 10.0, 30.0])
def test_a_saccade_keeps_the_acceleration_that_the_servos_follow(most, size):
    saccade = SaccadeModel(SaccadeParams("human", 100.0, most)).profile
    times = np.linspace(0.0, saccade.duration_s(radians(size)), 4001)
    angles = np.degrees([saccade.displacement_rad(radians(size), t) for t in times])
    acceleration = np.diff(angles, 2) / (times[1] - times[0]) ** 2
    assert np.abs(acceleration).max() <= 1.01 * most
    steps = np.diff(angles)
    assert steps.min() >= 0.0 and steps.max() <= 100.0 * (times[1] - times[0]) * (1.0 + 1e-9)
    if most == 500.0:  # as fast as it allows
        assert acceleration.max() > 0.95 * most


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
