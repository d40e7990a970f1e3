"""Vestibulo-ocular terms against their closed forms."""

from math import degrees, inf, radians

import pytest
from reference.vestibular import (
    SemicircularCanals,
    distance_m,
    gate,
    near_gain,
    negated,
    translational_rad_s,
)

from gazerig.gaze.angles import angle_between, compose, direction, rotate, rotate_back, rotation


def test_gate_closes_with_the_size_of_the_shift_and_opens_in_40_ms() -> None:
    assert gate(radians(10.0)) == pytest.approx(0.83)
    assert gate(radians(40.0)) == pytest.approx(0.32)
    assert gate(radians(80.0)) == pytest.approx(0.1)
    assert gate(radians(40.0), 0.04) == pytest.approx(1.0 - 0.68 / 2.71828, abs=1e-4)
    assert gate(radians(40.0), inf) == 1.0


@pytest.mark.parametrize(("distance", "gain"), [(0.3, 1.33), (0.5, 1.2), (1.0, 1.1), (2.0, 1.05)])
def test_near_targets_need_a_larger_turn(distance: float, gain: float) -> None:
    assert near_gain(0.10, distance) == pytest.approx(gain, abs=0.005)


@pytest.mark.parametrize(("distance", "rate"), [(0.3, 19.1), (0.5, 11.5), (1.0, 5.7), (2.0, 2.9)])
def test_translation_by_distance(distance: float, rate: float) -> None:
    assert distance_m(0.0619 / distance, 0.0619) == pytest.approx(distance)
    turned = translational_rad_s(0.0, 0.0, 0.1, distance)
    assert -degrees(turned) == pytest.approx(rate, abs=0.05)


def test_parallel_eyes_see_far_but_not_for_ever() -> None:
    assert distance_m(0.0, 0.0619) == pytest.approx(100.0)


def test_canals_delay_and_begin_at_rest() -> None:
    canals = SemicircularCanals(0.010, 0.0)
    assert [canals.step(rate, 0.005) for rate in (1.0, 2.0, 3.0, 4.0)] == [0.0, 0.0, 1.0, 2.0]


def test_e31_negated_angles_err_by_degrees_where_the_inverse_rotation_does_not() -> None:
    head = (radians(40.0), radians(20.0), 0.0)
    eyes = negated((0.0, 0.0), (0.0, 0.0, 0.0), head)
    ahead = (1.0, 0.0, 0.0)
    literal = rotate(rotation(head), direction(eyes))
    assert degrees(angle_between(literal, ahead)) == pytest.approx(5.1, abs=0.3)
    whole = compose(rotation(head), rotation((eyes[0], eyes[1], 0.0)))
    assert degrees(angle_between(rotate(whole, ahead), literal)) < 1e-6
    exact = rotate_back(rotation(head), ahead)
    assert degrees(angle_between(rotate(rotation(head), exact), ahead)) < 1e-6
