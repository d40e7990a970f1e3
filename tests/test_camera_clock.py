"""Stamps of a device clock become host times, through jitter, drift and jumps."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gazerig.drivers.camera.clock_sync import ClockSync

RATE_HZ = 30.0


def run(bridge, seconds, drift=0.0, offset_s=0.0, seed=1, start_s=0.0):
    """Return errors of the translation (translated less true, s), with exponential jitter."""
    rng = np.random.default_rng(seed)
    true_s = start_s + np.arange(int(seconds * RATE_HZ)) / RATE_HZ
    late_s = 0.02 + rng.exponential(0.008, len(true_s))
    late_s[rng.random(len(true_s)) < 0.02] += 0.3  # now and then one comes very late
    errors = [
        bridge.host_s((t - start_s) * (1.0 + drift) + offset_s, t + late) - t
        for t, late in zip(true_s, late_s, strict=True)
    ]
    return np.array(errors)


def test_offset_is_the_least_delay():
    errors = run(ClockSync(0.02), 20.0, offset_s=-7000.0, start_s=100.0)
    assert np.abs(errors[60:]).max() < 0.001


@pytest.mark.parametrize("drift", [50e-6, -50e-6])
def test_drift_is_followed_for_ten_minutes(drift):
    bridge = ClockSync(0.02)
    errors = run(bridge, 600.0, drift=drift)
    assert bridge.drift_ppm == pytest.approx(-drift * 1e6, abs=8.0)
    assert np.abs(errors[30 * 30 :]).max() < 0.0015  # untouched it would be 30 ms


@pytest.mark.parametrize(("before_s", "after_s"), [(500.0, 0.0), (0.0, 1000.0)])
def test_device_that_starts_anew_or_is_set_ahead_is_noticed_at_once(before_s, after_s):
    bridge = ClockSync(0.02)
    run(bridge, 30.0, offset_s=before_s)
    errors = run(bridge, 10.0, offset_s=after_s, start_s=31.0, seed=2)
    assert bridge.jumps == 1
    assert np.abs(errors[60:]).max() < 0.001


def test_single_late_pictures_are_no_jump():
    bridge = ClockSync()
    run(bridge, 60.0)
    assert bridge.jumps == 0


def test_clock_that_stood_still_a_while_is_noticed_after_a_second():
    bridge = ClockSync(0.02)
    run(bridge, 30.0, offset_s=0.0, start_s=0.0)
    # Device time continues from its last value; the host is 5 s further.
    errors = run(bridge, 20.0, offset_s=30.0, start_s=35.0, seed=3)
    assert bridge.jumps == 1
    assert np.abs(errors[90:]).max() < 0.001


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.floats(0.0, 0.5), st.floats(0.0, 1.0)), min_size=1, max_size=80))
def test_time_never_runs_back_nor_ahead_of_the_arrival(steps):
    bridge = ClockSync()
    device_s, before_s, arrived_s, jumps = 0.0, -np.inf, -np.inf, 0
    for step_s, late_s in steps:
        device_s += step_s
        arrived_s = max(arrived_s, device_s + 3.0 + late_s)
        host_s = bridge.host_s(device_s, arrived_s)
        assert host_s <= arrived_s
        assert host_s >= before_s or bridge.jumps > jumps
        before_s, jumps = host_s, bridge.jumps
