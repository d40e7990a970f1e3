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
    assert all(b - a <= 200 for a, b in zip(places, places[1:], strict=False))
    assert 0 < 8000 - places[-1] <= 20
    assert servo.is_resting and not servo.is_straining


def test_a_change_within_the_dead_band_does_not_move_it():
    servo = HobbyServo(HobbySpec(0, 6000, dead_steps=20.0))
    assert run(servo, 6020, 5) == [6000.0] * 5
    assert run(servo, 6021, 1)[0] > 6000.0


def test_without_pulses_it_is_limp_and_a_hand_turns_it():
    servo = HobbyServo(HobbySpec(0, 6000))
    servo.turn(-500)
    assert servo.is_unpowered
    assert run(servo, 0, 50)[-1] == 5500
    servo.turn(1e5)
    assert servo.place_steps == 10_000


def test_a_stuck_one_strains_and_goes_on_when_freed():
    servo = HobbyServo(HobbySpec(0, 6000))
    servo.stuck = True
    assert run(servo, 7000, 50)[-1] == 6000
    assert servo.is_straining and servo.is_resting
    with pytest.raises(ValueError, match="channel 0 is stuck"):
        servo.turn(10)
    servo.stuck = False
    assert run(servo, 7000, 100)[-1] == pytest.approx(7000, abs=20)
    assert not servo.is_straining


def test_it_strains_at_a_hard_stop():
    servo = HobbyServo(HobbySpec(0, 6000, stop_high_steps=6500))
    assert run(servo, 8000, 1)[-1] == 6220
    assert not servo.is_straining
    assert run(servo, 8000, 100)[-1] == 6500
    assert servo.is_straining
    run(servo, 0, 1)
    assert not servo.is_straining


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"speed_steps_s": 0.0}, "speed_steps_s is not in 100"),
        ({"lag_s": float("nan")}, "lag_s is not in"),
        ({"stop_low_steps": 9000, "stop_high_steps": 8000}, "stop_low_steps is above"),
    ],
)
def test_what_cannot_exist_is_named(wrong, says):
    with pytest.raises(ValueError, match=says):
        HobbyServo(HobbySpec(0)._replace(**wrong))


@given(
    st.lists(st.tuples(st.sampled_from([0, 256, 4000, 6000, 13_120]), st.integers(1, 40))),
    st.floats(0.0, 16_383.0),
    st.floats(0.0, 0.2),
)
def test_it_stays_between_its_stops_and_below_its_speed(pulses, start, lag_s):
    servo = HobbyServo(HobbySpec(0, start, 22_000.0, lag_s))
    before = servo.place_steps
    for width, steps in pulses:
        for place in run(servo, width, steps):
            assert 2000 <= place <= 10_000
            assert abs(place - before) <= 220.0 + 1e-9
            before = place
