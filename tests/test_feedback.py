"""Feedback as columns: who is missing, what is kept, and that nothing old passes for new."""

from math import inf, isnan

import pytest
from feedback_rows import Row, feedback_of, rows

from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.servo_bus.feedback import FeedbackColumns
from gazerig.drivers.types import Feedback, ServoConfig


def row(steps, at_s, torque=True, rearmed=False):
    return Row(steps, 1.5, 0.25, at_s, 31.0, 5.1, torque, "", True, rearmed)


def test_nothing_of_a_missing_servo_can_pass_for_an_answer():
    none = Feedback.create_missing(3)
    assert none.missing == (0, 1, 2) and rows(none) == (None,) * 3
    for column in (none.position_steps, none.velocity_steps_s, none.load):
        assert all(isnan(value) for value in column)
    assert none.at_s == (-inf,) * 3
    assert not any(none.rearmed) and not any(none.torque)


def test_a_missing_servo_keeps_its_last_values_of_their_own_age():
    first = feedback_of([row(10, 1.0, torque=False, rearmed=True), row(20, 1.0), row(30, 1.0)])
    now = feedback_of([None, row(21, 2.0, rearmed=True), None])
    kept = now.fill_missing(first)
    assert kept.position_steps == (10, 21, 30)
    assert kept.at_s == (1.0, 2.0, 1.0)
    assert kept.torque == (False, True, True)
    # Rearmed is news of this exchange alone, and who is missing stays so.
    assert kept.rearmed == (False, True, False)
    assert kept.missing == (0, 2)
    assert now.fill_missing(kept) == kept


@pytest.fixture
def columns():
    setups = [ServoConfig(i, "xl330-m077", 0, 4095, 1000.0) for i in (1, 2, 3)]
    return FeedbackColumns(DYNAMIXEL, setups)


def test_an_exchange_begins_with_nobody_and_takes_servo_by_servo(columns):
    assert columns.now.missing == (0, 1, 2)
    columns._apply_one(1, 2048, 3.0, 0.5, 7.0)
    reported = columns.now
    assert (
        reported.missing == (0, 2)
        and reported.position_steps[1] == 2048
        and reported.at_s[1] == 7.0
    )
    assert columns.position(1) == 2048 and columns.position(0) is None
    columns.begin()
    assert columns.now.missing == (0, 1, 2)
    assert isnan(columns.now.position_steps[1])


def test_what_is_read_in_turn_stays_from_one_exchange_to_the_next(columns):
    columns.set_torque(2, True)
    columns.record_fault(0, "overload")
    columns.begin()
    for slot in range(3):
        columns._apply_one(slot, 1 + slot, 0.0, 0.0, 9.0)
    reported = columns.now
    assert reported.torque == (False, False, True) and reported.fault == ("overload", "", "")
    assert reported.missing == () and reported.at_s == (9.0,) * 3


def test_a_mark_of_rearming_lasts_for_one_exchange(columns):
    columns.hold(1, 2000, 3.0, torque=True)
    columns.mark_rearmed(1)
    assert columns.now.rearmed == (False, True, False)
    assert columns.now.torque[1]
    columns.begin()
    assert columns.now.rearmed == (False,) * 3
