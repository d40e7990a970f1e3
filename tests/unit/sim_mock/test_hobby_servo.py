"""A hobby servo behind pulses: how it follows, when it rests, and what hands and stops do."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gazerig.sim_mock.hobby_servo import HobbyServo, HobbySpec


def run(servo, width, steps):
    """Send a pulse width for n steps of 10 ms; return the places after each."""
    servo.width_steps = width
    places = []
    for _ in range(steps):
        servo.step()
        places.append(servo.place_steps)
    return places


def test_it_goes_at_its_top_speed_and_settles_within_its_dead_band():
    servo = HobbyServo(HobbySpec(0, 4000, 20_000.0, 0.03, 20.0))
    places = run(servo, 8000, 60)
    assert places[:5] == [4200, 4400, 4600, 4800, 5000]
    assert 0 < 8000 - places[-1] <= 20 and places[-1] == places[-2]


def test_without_pulses_it_is_limp_and_a_hand_turns_it():
    servo = HobbyServo(HobbySpec(0, 6000))
    servo.turn(-500)
    assert run(servo, 0, 50)[-1] == 5500
    servo.turn(1e5)
    assert servo.place_steps == 10_000


def test_a_stuck_one_goes_on_when_freed():
    servo = HobbyServo(HobbySpec(0, 6000))
    servo.jam()
    servo.turn(10)
    assert run(servo, 7000, 50)[-1] == 6000
    servo.jam(False)
    assert run(servo, 7000, 100)[-1] == pytest.approx(7000, abs=20)


@given(
    st.lists(st.tuples(st.sampled_from([0, 256, 4000, 6000, 13_120]), st.integers(1, 40))),
    st.floats(0.0, 16_383.0),
    st.floats(0.001, 0.2),
)
def test_it_stays_between_its_stops_and_below_its_speed(pulses, start, lag_s):
    servo = HobbyServo(HobbySpec(0, start, 22_000.0, lag_s))
    before = servo.place_steps
    for width, steps in pulses:
        for place in run(servo, width, steps):
            assert 2000 <= place <= 10_000
            assert abs(place - before) <= 220.0 + 1e-9
            before = place
