"""The emulated Maestro against the numbers of its user's guide, byte by byte."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from maestro_world import PROTOCOL, World, acceleration, speed, target

from gazerig.sim_mock.hobby_servo import HobbySpec
from gazerig.sim_mock.maestro.body import EmulatedChannel
from gazerig.sim_mock.maestro.commands import ERRORS, crc7

TIMEOUT = 1 << ERRORS.index("timeout")


def check(packet):
    return packet + bytes((crc7(packet),))


@pytest.fixture
def world():
    return World()


# --- bytes


def test_set_target_and_get_position(world):
    assert world.ask("84 00 70 2E") == b""
    assert world.ask("90 00") == (6000).to_bytes(2, "little") == b"\x70\x17"
    # The answer is whole bytes, not seven bits each.
    world.ask(target(0, 4095))
    assert world.ask("90 00") == b"\xff\x0f"
    assert world.errors() == 0


def test_set_multiple_targets_as_in_the_guide(world):
    world.ask(target(3, 6000))
    world.ask("9F 02 03 00 00 70 2E")
    assert world.positions()[2:6] == [0, 0, 6000, 0]
    world.ask("9F 0C 00" + "70 2E" * 12)
    assert world.positions() == [6000] * 12
    assert world.errors() == 0
    world.ask("9F 02 0B 70 2E 70 2E")
    assert world.errors() == PROTOCOL


def test_with_a_crc_only_checked_commands_count():
    world = World(crc=True)
    world.ask(check(target(0, 6000)))
    assert world.ask(check(b"\x90\x00")) == b"\x70\x17"
    world.ask(target(0, 6100) + b"\x00")
    assert world.ask(check(b"\xa1")) == bytes((1 << ERRORS.index("crc"), 0))
    assert world.ask(check(b"\x90\x00")) == bytes(2)


def test_a_command_may_come_in_pieces(world):
    assert [world.ask(bytes((byte,))) for byte in bytes.fromhex("84 00 70 2E 90")] == [b""] * 5
    assert world.ask("00") == b"\x70\x17"


# --- errors


@pytest.mark.parametrize(
    "wrong",
    ["84 00 70 90 00", "80", "84 0C 70 2E", "9F 00 00"],
    ids=["cut short", "unknown", "no channel", "none of the targets"],
)
def test_bytes_without_sense_are_protocol_errors_and_end_all_pulses(world, wrong):
    world.ask(target(3, 6000))
    world.ask(wrong)
    assert world.ask("A1") == bytes((PROTOCOL, 0))
    assert world.ask("A1") == bytes(2)
    assert world.positions() == [0] * 12


@pytest.mark.parametrize(("choice", "steps"), [("off", 0), ("home", 5600), ("ignore", 7000)])
def test_what_channels_do_on_an_error_and_when_sent_home(choice, steps):
    for cause in ("00", "A2"):
        world = World()
        world.do(f"set on-error {choice}")
        world.do("set home-us 1400")
        world.ask(target(0, 7000))
        world.ask(cause)
        assert world.position() == steps


def test_a_host_that_falls_silent_is_an_error_where_that_is_set(world):
    world.ask(target(0, 6000))
    assert world.after(1000.0).position() == 6000
    world.do("set timeout-ms 500")
    world.ask(target(0, 6000))
    assert world.after(0.49).position() == 6000
    assert world.after(0.49).position() == 6000
    assert world.after(0.5).position() == 0
    assert world.errors() == TIMEOUT
    # Bytes that are no command feed nothing.
    world.after(0.3).ask("00")
    world.after(0.3)
    assert world.errors() == PROTOCOL | TIMEOUT


# Motion of the channels of an emulated Maestro, and of its servos


# --- motion


def test_the_speed_of_the_guide_takes_100_ms_from_1000_to_1350_us(world):
    world.ask(target(5, 4000))
    world.ask("87 05 0C 01")
    world.ask(target(5, 5400))
    for period in range(1, 12):
        expected = min(4000 + 140 * period, 5400)
        assert world.after(0.01).position(5) == expected
        assert world.ask("93") == bytes((expected != 5400,))


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


def test_targets_are_clipped_to_what_the_channel_is_set_to(world):
    world.ask(target(0, 16_383) + target(1, 4))
    assert world.positions()[:2] == [8000, 3968]
    world.do("set max-us 2500")
    world.ask(target(0, 16_383))
    assert world.position() == 10_000
    own = World(servos=[HobbySpec(2, min_steps=5000, max_steps=7000)])
    own.ask(target(2, 8000))
    assert own.position(2) == 7000


_ORDERS = st.one_of(
    st.tuples(st.just("set_target"), st.integers(0, 16_383)),
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
            # A speed limit that was lowered in motion is reached at the acceleration.
            if channel.speed and not channel.acceleration:
                assert abs(channel.position - before) <= channel.speed
        assert channel.position == 0 or 3968 <= channel.position <= 8000
    channel.limit_speed(0)
    for _ in range(800):
        channel.step()
    assert channel.position == channel.target
    assert not channel.is_moving


# --- servos, time


def test_servos_follow_the_pulses(world):
    assert world.board.positions_steps() == (6000.0,) * 12
    world.ask(target(0, 8000) + target(1, 4000))
    places = world.after(0.5).board.positions_steps()
    assert places[0] == pytest.approx(8000, abs=20)
    assert places[1] == pytest.approx(4000, abs=20)
    assert places[2:] == (6000.0,) * 10
