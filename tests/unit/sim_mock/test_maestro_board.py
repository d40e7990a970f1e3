"""The emulated Maestro against the numbers of its user's guide, byte by byte, and its faults."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from maestro_world import PROTOCOL, World, acceleration, speed, target

from gazerig.sim_mock.hobby_servo import HobbySpec
from gazerig.sim_mock.maestro.board import CRC, SIZES, crc7
from gazerig.sim_mock.maestro.channel import EmulatedChannel, largest_braking_step


@pytest.fixture
def world():
    return World()


# --- bytes


def test_with_a_crc_only_checked_commands_count():
    def check(packet):
        return packet + bytes((crc7(packet),))

    world = World(crc=True)
    assert world.ask(check(target(0, 6000)) + check(b"\x90\x00")) == b"\x70\x17"
    world.ask(target(0, 6100) + b"\x00")
    assert world.ask(check(b"\xa1")) == bytes((1 << CRC, 0))
    assert world.ask(check(b"\x90\x00")) == bytes(2)


@pytest.mark.parametrize(
    "wrong",
    ["84 00 70 90 00", "80", "84 0C 70 2E", "55"],
    ids=["cut short", "unknown", "no channel", "no command"],
)
def test_bytes_without_sense_are_protocol_errors_and_end_all_pulses(world, wrong):
    world.ask(target(3, 6000))
    world.ask(wrong)
    assert world.errors() == PROTOCOL and world.errors() == 0
    assert world.positions() == [0] * 12


# --- motion


def test_the_first_target_after_silence_ignores_the_limits(world):
    world.ask(speed(0, 1) + acceleration(0, 1) + target(0, 8000))
    assert world.position() == 8000
    world.ask(target(0, 0) + target(0, 4000))
    assert world.position() == 4000


def test_targets_are_clipped_to_what_the_channel_is_set_to():
    world = World(servos=[HobbySpec(2, min_steps=5000, max_steps=7000)])
    world.ask(target(0, 16_383) + target(1, 4) + target(2, 8000))
    assert world.positions()[:3] == [8000, 3968, 7000]


_ORDERS = st.one_of(
    st.tuples(st.just("set_target"), st.integers(0, 16_383)),
    st.tuples(st.just("limit_speed"), st.integers(0, 400)),
    st.tuples(st.just("limit_acceleration"), st.integers(0, 255)),
    st.tuples(st.just("step"), st.integers(1, 60)),
)


@given(st.lists(_ORDERS, max_size=25))
def test_a_channel_keeps_its_limits_and_always_arrives(orders):
    channel = EmulatedChannel(3968, 8000)
    for order, count in orders:
        if order != "step":
            getattr(channel, order)(count)
        for _ in range(count if order == "step" else 0):
            before = channel.position
            channel.step()
            # A speed limit that was lowered in motion is reached at the acceleration.
            if channel.speed and not channel.acceleration:
                assert abs(channel.position - before) <= channel.speed
        assert channel.position == 0 or 3968 <= channel.position <= 8000
    channel.limit_speed(0)
    for _ in range(800):
        channel.step()
    assert channel.position == channel.target and not channel.is_moving


def test_the_first_step_of_a_motion_lets_the_others_shrink_by_the_acceleration():
    ways = (10, 1), (9, 1), (20, 2), (5, 10)  # 4+3+2+1, 3+.., 8+6+4+2, 5
    assert [largest_braking_step(*way) for way in ways] == [4, 3, 8, 5]


# --- faults


def test_a_brown_out_is_deafness_then_a_board_as_switched_on(world):
    world.ask(target(0, 7000) + speed(0, 5) + acceleration(0, 3) + b"\x00")
    world.do("brown-out")
    assert world.ask("A1") == b""
    assert world.after(0.1).errors() == 0
    assert world.positions() == [0] * 12
    world.ask(target(0, 7000) + target(0, 4000))
    assert world.position() == 4000


@given(
    st.sampled_from(SIZES),
    st.booleans(),
    st.lists(st.tuples(st.binary(max_size=40), st.integers(0, 500)), max_size=12),
)
def test_no_bytes_break_it_and_no_pulse_leaves_its_limits(channels, crc, talk):
    world = World(channels, setups=(), crc=crc)
    for data, nap_ms in talk:
        world.ask(data)
        world.after(nap_ms / 1000.0)
        for channel in world.board.channels:
            assert channel.position == 0 or 3968 <= channel.position <= 8000
