"""Patience, alternating views, back-off, health and names: the driver's small parts."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gazerig.drivers.bus.servo_models import servo_label
from gazerig.drivers.dynamixel.control_table import MODELS, indirect_blocks
from gazerig.drivers.dynamixel.read_plan import INDIRECT_MAP
from gazerig.drivers.event_log import MOST, EventLog, register_label
from gazerig.drivers.servo_bus.transaction import REFILL, RESERVE_S, WINDOW, AdaptiveTimeout
from gazerig.drivers.types import ServoConfig


def test_patience_begins_long_and_becomes_twice_the_worst_delay():
    timeout = AdaptiveTimeout(0.001, 0.02)
    assert timeout.seconds == 0.02
    for _ in range(WINDOW):
        timeout.update(0.002)
    assert timeout.seconds == 0.004
    for _ in range(3 * WINDOW):
        timeout.update(0.0001)
    assert timeout.seconds == 0.001
    for expected in (0.001, 0.001, 0.006, 0.006):
        timeout.update(0.003)
        assert timeout.seconds == expected


def test_answers_after_the_end_lengthen_patience():
    timeout = AdaptiveTimeout(0.001, 0.02)
    for _ in range(2 * WINDOW):
        timeout.update(0.0)
    for expected in (0.001, 0.001, 0.002, 0.002, 0.002, 0.004):
        timeout.record_late_answer()
        assert timeout.seconds == expected or expected == 0.004


@given(st.lists(st.floats(-1.0, 10.0), max_size=600))
def test_patience_keeps_to_its_bounds(delays):
    timeout = AdaptiveTimeout(0.001, 0.02)
    for late_s in delays:
        timeout.update(late_s)
        assert 0.001 <= timeout.seconds <= 0.02


def settled(least_s=0.001, most_s=0.02):
    """A time-out of a bus that answers at once."""
    timeout = AdaptiveTimeout(least_s, most_s)
    for _ in range(2 * WINDOW):
        timeout.update(0.0)
    return timeout


def test_the_reserve_covers_a_pause_and_a_success_costs_nothing_of_it():
    timeout = settled()
    assert timeout.reserve_timeout_s(5.0) == pytest.approx(0.001 + RESERVE_S)
    timeout.update(0.009)
    assert timeout.seconds == 0.001
    assert timeout.reserve_timeout_s(5.0) == pytest.approx(0.001 + RESERVE_S)


def test_waiting_in_vain_costs_one_hundredth_of_the_time_at_most():
    timeout = settled()
    now_s, waited_s = 100.0, 0.0
    for _ in range(20_000):
        now_s += 0.005
        beyond_s = timeout.reserve_timeout_s(now_s) - timeout.seconds
        now_s += beyond_s
        waited_s += beyond_s
        timeout.consume_reserve(beyond_s, now_s)
    assert waited_s <= RESERVE_S + 1.02 * REFILL * (now_s - 100.0)
    # Half a second later there is some of it again, and after a while all.
    assert timeout.reserve_timeout_s(now_s + 0.5) == pytest.approx(0.001 + 0.5 * REFILL, rel=0.05)
    assert timeout.reserve_timeout_s(now_s + 5.0) == pytest.approx(0.001 + RESERVE_S)


def test_the_indirect_map_fits_every_window():
    for name, firmware in (("xl330-m077", 46), ("xl330-m077", 53), ("xm430-w350", 45)):
        block = indirect_blocks(MODELS[name], firmware)[0]
        assert len(INDIRECT_MAP) <= block.entries
        assert all(block.target_low <= address <= block.target_high for address in INDIRECT_MAP)


def test_the_journal_forgets_what_nobody_takes():
    journal = EventLog()
    for k in range(MOST + 5):
        journal.add(str(k))
    lines = journal.drain()
    assert (len(lines), lines[-1]) == (MOST, str(MOST + 4))
    assert journal.drain() == ()


def test_names_are_those_of_people_and_manuals():
    setup = ServoConfig(7, "xl330-m077", 0, 4095, 1.0)
    assert servo_label(setup) == "servo 7"
    assert servo_label(setup._replace(name="neck_yaw")) == "neck_yaw (servo 7)"
    assert register_label("return_delay_time") == "Return Delay Time"
    assert register_label("goal_pwm") == "Goal PWM"
