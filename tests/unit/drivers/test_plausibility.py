"""Accepted positions, by the distance that a joint can have moved."""

from copy import deepcopy

from hypothesis import given, settings
from hypothesis import strategies as st

from gazerig.drivers.bus.plausibility import AGREEING, DISTURBED_S, Plausibility

SPEED = 4000.0
STEP = 47_835 * 4096 // 360
"""What damaged bytes that passed a CRC once said, in steps."""


def known(*places):
    plausible = Plausibility([SPEED] * len(places))
    for slot, place in enumerate(places):
        assert plausible.is_plausible(slot, place, 1.0)
    return plausible


def test_a_place_out_of_reach_is_not_believed_and_changes_nothing():
    plausible = known(1000, 2000)
    assert not plausible.are_plausible((1010, STEP), (1.005,) * 2)
    assert plausible.are_plausible((1010, 2010), (1.005,) * 2)
    assert not plausible.is_plausible(0, STEP, 1.01)
    assert plausible.is_plausible(0, 1020, 1.015)


def test_who_says_so_again_and_again_is_believed():
    plausible = known(1000, 2000)
    said = [plausible.is_plausible(1, 3500 + k, 1.0 + 0.005 * k) for k in range(1, AGREEING + 1)]
    assert said == [False] * (AGREEING - 1) + [True]
    assert plausible.is_plausible(1, 3500, 1.1)


def test_values_that_disagree_with_each_other_are_never_believed():
    plausible = known(1000)
    assert not any(
        plausible.is_plausible(0, 3000 + 900 * (k % 2), 1.0 + 0.005 * k) for k in range(1, 40)
    )


def test_reach_grows_with_time_and_all_is_believed_after_a_port_was_gone():
    plausible = known(1000)
    assert not plausible.is_plausible(0, 3000, 1.1)
    assert plausible.is_plausible(0, 3000, 1.6)
    plausible.forget()
    assert plausible.is_plausible(0, -40_000, 1.61)


@settings(deadline=None, max_examples=60)
@given(st.lists(st.floats(-SPEED, SPEED), min_size=1, max_size=40), st.data())
def test_no_motion_that_the_motor_can_make_is_refused(speeds, data):
    plausible, at_s, place = known(2000, 2000), 1.0, 2000.0
    for speed in speeds:
        dt_s = data.draw(st.floats(0.001, 0.05))
        at_s, place = at_s + dt_s, place + speed * dt_s
        place_steps = round(place), 2000
        if not plausible.are_plausible(place_steps, (at_s,) * 2):
            assert all(plausible.is_plausible(i, one, at_s) for i, one in enumerate(place_steps))


@settings(deadline=None, max_examples=60)
@given(st.lists(st.floats(-600.0, 600.0), min_size=1, max_size=40))
def test_on_a_disturbed_line_a_joint_continues_at_its_speed(changes):
    """No motion of a motor is refused, and no place farther away is taken."""
    plausible, at_s, place, speed = known(2000), 1.0, 2000.0, 0.0
    plausible.record_damaged(at_s)
    for change in changes:
        speed = min(max(speed + change, -SPEED), SPEED)
        at_s, place = at_s + 0.005, place + 0.005 * speed
        for beyond in (-100, 100):
            probe = deepcopy(plausible)
            assert not probe.is_plausible(0, round(place) + beyond, at_s)
        assert plausible.is_plausible(0, round(place), at_s)


def test_a_line_is_disturbed_for_a_while_after_a_damaged_answer():
    for later_s, believed in ((DISTURBED_S - 0.1, False), (DISTURBED_S + 0.1, True)):
        plausible = known(1000)
        plausible.record_damaged(1.0)
        plausible.record(0, 1000, 0.995 + later_s)
        assert plausible.is_plausible(0, 1060, 1.0 + later_s) == believed
