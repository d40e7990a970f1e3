"""Minimum jerk: its curve, quintics from any state, and the sum of moves to newer goals."""

from math import sqrt

import pytest
from numpy.polynomial import Polynomial

from gazerig.gaze.minimum_jerk import (
    PEAK_ACCELERATION,
    PEAK_SPEED,
    MinimumJerkBlend,
    Quintic,
    min_jerk,
)

QUARTER = 53.0 / 512.0  # 6/1024 - 15/256 + 10/64


def test_the_curve_is_eq_2_and_held_at_its_ends():
    found = [min_jerk(s) for s in (-1.0, 0.0, 0.25, 0.5, 0.75, 1.0, 1.2)]
    assert found == [0.0, 0.0, QUARTER, 0.5, 1.0 - QUARTER, 1.0, 1.0]
    eq_2 = Polynomial((0.0, 0.0, 0.0, 10.0, -15.0, 6.0))
    assert eq_2.deriv()(0.5) == PEAK_SPEED
    assert eq_2.deriv(2)(0.5 - sqrt(1.0 / 12.0)) == pytest.approx(PEAK_ACCELERATION, abs=1e-4)


def test_a_quintic_has_the_given_start_and_rests_at_its_goal():
    curve = Quintic((1.0, 2.0, 3.0), 8.0, 2.0)
    path = Polynomial(curve.coefficients)
    speed, acceleration = path.deriv(), path.deriv(2)
    assert [p(0.0) for p in (path, speed, acceleration)] == [1.0, 2.0, 3.0]
    assert [p(2.0) for p in (path, speed, acceleration)] == pytest.approx([8.0, 0.0, 0.0])
    assert curve.state_at(0.7) == pytest.approx([p(0.7) for p in (path, speed, acceleration)])
    assert curve.state_at(-1.0) == (1.0, 2.0, 3.0) and curve.state_at(2.0) == (8.0, 0.0, 0.0)
    times = (-1.0, 0.7, 1.9, 2.0, 3.0)
    assert [curve.position(t) for t in times] == [curve.state_at(t)[0] for t in times]


def test_moves_to_newer_goals_are_added():
    blend = MinimumJerkBlend((0.0, 10.0), 2.0)
    assert blend.step(5.0) == (0.0, 10.0) and blend.is_at_rest
    blend.move_to((4.0, 10.0))
    assert not blend.is_at_rest and blend.step(6.0) == (0.0, 10.0)
    assert blend.step(6.5) == (4.0 * QUARTER, 10.0)
    blend.move_to((4.0, 20.0))
    assert [blend.step(t) for t in (6.5, 7.0, 8.0)] == [
        (4.0 * QUARTER, 10.0), (2.0, 10.0 + 10.0 * QUARTER), (4.0, 20.0 - 10.0 * QUARTER),
    ]  # fmt: skip
    assert not blend.is_at_rest
    arrived = blend.step(8.5)
    assert arrived == (4.0, 20.0) and blend.is_at_rest
    blend.move_to((4.0, 20.0))
    assert blend.is_at_rest and blend.step(9.0) is arrived
    # At most 32 moves at once: a goal waits for a 32nd of the duration after the one before.
    for t, goal in ((10.0, 8.0), (10.06, 12.0), (10.061, 16.0), (10.0625, 16.0)):
        blend.move_to((goal, 20.0))
        blend.step(t)
    assert blend.step(11.0625) == (pytest.approx(8.0 + 4.0 * min_jerk(0.53125)), 20.0)
    blend.reset((1.0, 2.0))
    assert blend.is_at_rest and blend.step(11.0) == (1.0, 2.0)
