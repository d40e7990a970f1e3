"""Accepted positions, by the distance that a joint can have moved."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gazerig.drivers.bus.plausibility import (
    AGREEING,
    DISTURBED_S,
    LATE_S,
    PAIR_LATE_S,
    PAIR_STEPS,
    Plausibility,
)
from gazerig.drivers.feetech.family import FEETECH
from gazerig.drivers.servo_bus.feedback import FeedbackColumns
from gazerig.drivers.servo_bus.read_plan import Sample
from gazerig.drivers.servo_bus.sync_read import ServoReply
from gazerig.drivers.types import ServoConfig

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
    assert not plausible.are_plausible((1010, STEP), 1.005)
    assert plausible.are_plausible((1010, 2010), 1.005)
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
        assert plausible.are_plausible((round(place), 2000), at_s)


def test_on_a_disturbed_line_a_joint_comes_no_farther_than_its_motor_can_turn_it():
    """Two servos with one id answer at the same time: the mixture passes the sum twice."""
    within, beyond = SPEED * (0.019 + LATE_S), SPEED * (0.019 + LATE_S) + PAIR_STEPS + 1
    assert known(1000).is_plausible(0, round(1000 + beyond), 1.019)
    for way, believed in ((within, True), (beyond, False), (-beyond, False)):
        plausible = known(1000)
        plausible.record_damaged(1.0)
        assert plausible.is_plausible(0, round(1000 + way), 1.019) == believed


def test_a_line_is_disturbed_for_a_while_after_a_damaged_answer():
    plausible = known(1000)
    assert not plausible.is_disturbed(1.0)
    plausible.record_damaged(1.0)
    assert plausible.is_disturbed(1.0 + DISTURBED_S)
    assert not plausible.is_disturbed(1.1 + DISTURBED_S)


def test_two_answers_right_after_one_another_agree_within_the_way_of_their_speeds():
    plausible, room = known(1000), PAIR_LATE_S + 0.02
    for speeds, low, high in (
        ((0.0, 0.0), 0.0, 0.0),
        ((1000.0, 400.0), 0.0, 1000.0 * room),
        ((-1000.0, 400.0), -1000.0 * room, 400.0 * room),
        ((2.0 * SPEED, 0.0), 0.0, SPEED * room),
    ):
        low, high = low - PAIR_STEPS, high + PAIR_STEPS
        for way, agree in ((low, True), (high, True), (low - 1, False), (high + 1, False)):
            assert plausible.agree(0, way, 0.02, speeds) == agree


@pytest.mark.parametrize(
    ("second", "kept"),
    [((30, 74), (30, 74)), ((31, 73), (30, 74)), ((32, 74), (None, 74)), ((30, 71), (30, None))],
)
def test_a_temperature_or_voltage_that_two_answers_differ_on_is_not_taken(
    second: tuple[int, int], kept: tuple[int | None, int | None]
) -> None:
    columns = FeedbackColumns(FEETECH, [ServoConfig(1, "sts3215", 1000, 3000, 3000.0)])
    answers = [
        ServoReply(Sample(0, 2000, temperature=warm, voltage=tenths), at_s)
        for (warm, tenths), at_s in (((30, 74), 1.0), (second, 1.002))
    ]
    both = columns.confirm(0, *answers)
    assert both is not None and (both.sample.temperature, both.sample.voltage) == kept
