"""Where pulses and shafts are taken to be, against closed forms, and the board's units."""

from math import sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gazerig.drivers.hobby_board.channel import Ramp
from gazerig.drivers.maestro.commands import accel_units, speed_units


def moved(ramp, goal, seconds, tick_s=0.01):
    for _ in range(round(seconds / tick_s)):
        ramp.advance(goal, tick_s)
    return ramp


def test_units():
    # The manual's example: 140 is 35 us in 10 ms.
    assert speed_units(14_000.0) == 140
    assert speed_units(14_001.0) == 141
    assert speed_units(0.1) == 1
    assert speed_units(2_000_000.0) == 0
    assert accel_units(None) == 0
    assert accel_units(5000.0) == 4
    assert accel_units(5001.0) == 5
    assert accel_units(400_000.0) == 0


@pytest.mark.parametrize("bad", [0.0, float("nan")])
def test_limits_that_are_no_speeds(bad):
    with pytest.raises(ValueError, match="above 0"):
        speed_units(bad)
    with pytest.raises(ValueError, match="above 0"):
        accel_units(bad)


@given(st.floats(1.0, 1.6e6), st.floats(1.0, 318_000.0))
def test_a_limit_is_never_below_what_is_needed_nor_a_whole_unit_above(speed, accel):
    assert speed - 1e-3 <= speed_units(speed) * 100.0 <= max(100.0, speed + 100.0)
    assert accel - 1e-3 <= accel_units(accel) * 1250.0 <= max(1250.0, accel + 1250.0)


def test_without_limits_the_pulse_jumps_and_the_shaft_follows_at_its_own_speed():
    ramp = Ramp(6000.0, 2000.0)
    ramp.advance(7000.0, 0.1)
    assert ramp.pulse_steps == 7000.0
    assert ramp.shaft_steps == pytest.approx(6200.0)
    assert ramp.shaft_steps_s == pytest.approx(2000.0)
    moved(ramp, 7000.0, 1.0)
    assert (ramp.shaft_steps, ramp.shaft_steps_s) == (7000.0, 0.0)


def test_a_speed_limit_is_kept():
    ramp = Ramp(6000.0, 1e6)
    ramp.speed_steps_s = 2000.0
    assert moved(ramp, 8000.0, 0.5).pulse_steps == pytest.approx(7000.0)
    assert moved(ramp, 8000.0, 0.6).pulse_steps == 8000.0


def test_an_acceleration_limit_takes_as_long_as_a_trapezoid():
    ramp = Ramp(4000.0, 1e6)
    ramp.speed_steps_s, ramp.accel_steps_s2 = 4000.0, 5000.0
    seconds = 0.0
    while ramp.pulse_steps < 8000.0:
        ramp.advance(8000.0, 0.01)
        seconds += 0.01
    # 4000 steps are too short to reach 4000 steps/s: a triangle.
    assert seconds == pytest.approx(2.0 * sqrt(4000.0 / 5000.0), rel=0.05)


def test_without_pulses_the_shaft_is_taken_to_stay():
    ramp = Ramp(6000.0, 1000.0)
    ramp.advance(7000.0, 0.2)
    ramp.stop()
    assert (ramp.pulse_steps, ramp.shaft_steps, ramp.shaft_steps_s) == (6200.0, 6200.0, 0.0)


@given(
    st.lists(st.tuples(st.floats(2000, 10_000), st.floats(0.0, 0.3)), max_size=30),
    st.integers(0, 300),
    st.integers(0, 255),
)
def test_it_never_leaves_the_range_of_its_goals(moves, speed, accel):
    ramp = Ramp(6000.0, 5000.0)
    ramp.speed_steps_s, ramp.accel_steps_s2 = 100.0 * speed, 1250.0 * accel
    low = high = 6000.0
    for goal, seconds in moves:
        low, high = min(low, goal), max(high, goal)
        ramp.advance(goal, seconds)
        assert low - 1e-6 <= ramp.pulse_steps <= high + 1e-6
        assert low - 1e-6 <= ramp.shaft_steps <= high + 1e-6
