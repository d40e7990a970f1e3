"""How channels of an emulated Maestro move, and its servos with them."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from maestro_world import World, acceleration, speed, target

from gazerig.sim_mock.hobby_servo import HobbySpec
from gazerig.sim_mock.maestro.channel import EmulatedChannel, largest_braking_step


@pytest.fixture
def world():
    return World()


# --- motion


def test_without_limits_a_target_counts_at_once(world):
    world.ask(target(0, 4400))
    world.ask(target(0, 7600))
    assert world.position() == 7600
    assert world.ask("93") == b"\x00"


def test_the_speed_of_the_guide_takes_100_ms_from_1000_to_1350_us(world):
    world.ask(target(5, 4000))
    world.ask("87 05 0C 01")
    world.ask(target(5, 5400))
    for period in range(1, 12):
        expected = min(4000 + 140 * period, 5400)
        assert world.after(0.01).position(5) == expected
        assert world.ask("93") == bytes((expected != 5400,))


def test_speed_140_takes_1_ms_of_pulse_in_286_ms(world):
    world.ask(target(0, 4000) + speed(0, 140) + target(0, 8000))
    assert world.after(0.28).position() < 8000
    assert world.after(0.01).position() == 8000


def test_the_slowest_speed_takes_40_s_from_1_to_2_ms(world):
    world.ask(target(0, 4000) + speed(0, 1) + target(0, 8000))
    assert world.after(39.99).position() == 7999
    assert world.after(0.01).position() == 8000


def test_acceleration_1_takes_somewhat_over_3_s_from_1_to_2_ms(world):
    """The guide says about 3 s; at rest on both ends it is 2 sqrt(4000 * 8) periods."""
    world.ask(target(0, 4000) + acceleration(0, 1) + target(0, 8000))
    assert world.after(3.5).position() < 8000
    assert world.after(0.1).position() == 8000


def test_acceleration_4_is_1250_us_a_second_every_second(world):
    world.ask(target(0, 4000) + acceleration(0, 4) + target(0, 8000))
    places = [world.after(0.08).position() for _ in range(6)]
    # 4 quarter us per 10 ms more every 80 ms: half of that times 8 periods, then 1, 3, 5 ...
    growth = [b - a for a, b in zip([4000, *places], places, strict=False)]
    assert [b - a for a, b in zip(growth, growth[1:], strict=False)] == [32] * 5


def test_with_both_limits_it_is_a_trapezoid_that_ends_on_the_target(world):
    world.ask(target(0, 4000) + speed(0, 40) + acceleration(0, 16) + target(0, 6000))
    places = [4000] + [world.after(0.01).position() for _ in range(100)]
    rates = [b - a for a, b in zip(places, places[1:], strict=False)]
    assert rates[:5] == [2, 4, 6, 8, 10]
    assert max(rates) == 40
    assert places[-1] == 6000
    assert all(abs(b - a) <= 3 for a, b in zip(rates, rates[1:], strict=False))
    assert rates.count(40) >= 28


def test_a_new_target_on_the_way_turns_without_a_jolt(world):
    world.ask(target(0, 4000) + speed(0, 60) + acceleration(0, 8) + target(0, 8000))
    before = world.after(0.5).position()
    world.ask(target(0, 4200))
    places = [before] + [world.after(0.01).position() for _ in range(400)]
    rates = [b - a for a, b in zip(places, places[1:], strict=False)]
    assert max(places) > before + 100
    assert all(abs(b - a) <= 2 for a, b in zip(rates, rates[1:], strict=False))
    assert places[-1] == 4200


def test_the_first_target_after_silence_ignores_the_limits(world):
    world.ask(speed(0, 1) + acceleration(0, 1) + target(0, 8000))
    assert world.position() == 8000
    assert world.ask("93") == b"\x00"
    world.ask(target(0, 0) + target(0, 4000))
    assert world.position() == 4000


def test_only_limited_channels_count_as_moving(world):
    world.ask(target(0, 4000) + target(1, 4000) + speed(1, 5) + target(0, 8000))
    assert world.ask("93") == b"\x00"
    world.ask(target(1, 4010))
    assert world.ask("93") == b"\x01"
    assert world.after(0.02).ask("93") == b"\x00"


def test_targets_are_clipped_to_what_the_channel_is_set_to(world):
    world.ask(target(0, 16_383) + target(1, 4))
    assert world.positions()[:2] == [8000, 3968]
    world.do("set max-us 2500")
    world.ask(target(0, 16_383))
    assert world.position() == 10_000
    own = World(servos=[HobbySpec(2, min_steps=5000, max_steps=7000)])
    own.ask(target(2, 8000))
    assert own.position(2) == 7000


@given(st.integers(0, 20_000), st.integers(1, 255))
def test_the_largest_first_step_is_the_largest(way, limit):
    def stops_within(first):
        steps = first // limit
        return first * (steps + 1) - limit * steps * (steps + 1) // 2 <= way

    first = largest_braking_step(way, limit)
    assert stops_within(first)
    assert not stops_within(first + 1)


_ORDERS = st.one_of(
    st.tuples(st.just("aim"), st.integers(0, 16_383)),
    st.tuples(st.just("limit_speed"), st.integers(0, 400)),
    st.tuples(st.just("limit_acceleration"), st.integers(0, 255)),
    st.tuples(st.just("step"), st.integers(1, 60)),
)


@given(st.lists(_ORDERS, max_size=25))
def test_a_channel_keeps_its_limits_and_always_arrives(orders):
    channel = EmulatedChannel(3968, 8000)
    for order, number in orders:
        if order != "step":
            getattr(channel, order)(number)
        for _ in range(number if order == "step" else 0):
            before = channel.position
            channel.step()
            # A speed limit that was lowered on the way is reached at the acceleration.
            if channel.speed and not channel.acceleration:
                assert abs(channel.position - before) <= channel.speed
        assert channel.position == 0 or 3968 <= channel.position <= 8000
    channel.limit_speed(0)
    for _ in range(800):
        channel.step()
    assert channel.position == channel.target
    assert not channel.moving


# --- servos, time


def test_servos_follow_the_pulses(world):
    assert world.board.positions_steps() == (6000.0,) * 12
    world.ask(target(0, 8000) + target(1, 4000))
    places = world.after(0.5).board.positions_steps()
    assert places[0] == pytest.approx(8000, abs=20)
    assert places[1] == pytest.approx(4000, abs=20)
    assert places[2:] == (6000.0,) * 10


def test_a_servo_jumps_at_the_first_pulse_at_its_own_speed(world):
    world.ask(speed(0, 1) + target(0, 8000))
    world.after(0.06)
    assert world.board.positions_steps()[0] >= 6000 + 22_000 * 0.04


def test_a_pulse_comes_every_20_ms(world):
    world.ask(target(0, 4000) + speed(0, 10) + target(0, 6000))
    widths = []
    for _ in range(6):
        world.after(0.01).position()
        widths.append(world.board.body.servos[0].width_steps)
    assert widths == [0, 4020, 4020, 4040, 4040, 4060]


@given(st.lists(st.integers(1, 180), min_size=1, max_size=30))
@settings(max_examples=30)
def test_how_often_it_is_looked_at_changes_nothing(naps_ms):
    often, once = World(), World()
    orders = target(0, 4000) + speed(0, 30) + acceleration(0, 9) + target(0, 7000)
    for world in (often, once):
        world.ask(orders)
    for nap_ms in naps_ms:
        often.now_s += nap_ms / 1000.0
        assert often.position() >= 4000
    once.now_s = often.now_s
    assert once.position() == often.position()
    assert once.board.positions_steps() == often.board.positions_steps()


def test_a_day_of_silence_costs_no_work(world):
    world.ask(target(0, 7000))
    world.do("stick 1")
    world.ask(target(1, 7000))
    world.after(86_400.0)
    steps = 0
    for servo in world.board.body.servos:
        counted = servo.step

        def step(counted=counted):
            nonlocal steps
            steps += 1
            counted()

        servo.step = step
    assert world.position() == 7000
    assert steps < 12 * 200
