"""Faults of an emulated Maestro, on its line and inside."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st
from maestro_world import PROTOCOL, World, acceleration, speed, target

from gazerig.sim_mock.hobby_servo import HobbySpec
from gazerig.sim_mock.maestro.board import SIZES, build_board
from gazerig.sim_mock.maestro.commands import ERRORS


@pytest.fixture
def world():
    return World()


# --- who hears


def test_a_mute_port_says_nothing(world):
    world.do("set mode mute")
    assert world.ask("A1") == b""
    world.do("set mode usb-dual-port")
    assert world.ask("A1") == bytes(2)


# --- faults


def test_a_brown_out_is_deafness_then_a_board_as_switched_on(world):
    world.ask(target(0, 7000) + speed(0, 5) + acceleration(0, 3) + b"\x00")
    world.ask(target(0, 7000))
    world.after(1.0)
    world.do("brown-out")
    assert world.ask("A1") == b""
    assert world.after(0.1).errors() == 0
    assert world.positions() == [0] * 12
    world.ask(target(0, 7000) + target(0, 4000))
    assert world.position() == 4000
    report = json.loads(world.do("status"))["servos"][0]
    assert (report["speed"], report["acceleration"]) == (0, 0)


def test_after_a_brown_out_channels_may_be_set_to_go_home(world):
    world.do("set startup home")
    world.do("brown-out")
    assert world.after(0.05).board.body.channels[0].position == 0
    assert world.after(0.05).positions() == [6000] * 12


@pytest.mark.parametrize("name", ERRORS)
def test_errors_at_will(world, name):
    world.ask(target(0, 6000))
    world.do(f"error {name}")
    assert world.errors() == 1 << ERRORS.index(name)
    assert world.position() == 0


def test_servos_without_their_supply_are_limp_and_the_board_notices_nothing(world):
    world.ask(target(0, 7000))
    world.after(1.0)
    world.do("power off")
    world.after(0.1).do("turn 0 -500")
    fallen = world.after(1.0).board.positions_steps()[0]
    assert fallen == pytest.approx(6490, abs=20)
    assert (world.position(), world.errors()) == (7000, 0)
    world.do("power on")
    assert world.after(1.0).board.positions_steps()[0] == pytest.approx(7000, abs=20)


def test_commands_and_bytes_are_lost_on_their_way(world):
    world.do("lose-writes 1")
    assert world.ask("A1") == bytes(2)
    world.ask(target(0, 6000))
    assert world.position() == 0
    world.ask(target(0, 6000))
    assert world.position() == 6000
    world.do("lose-bytes 1")
    world.ask(target(0, 6000))
    assert world.errors() == PROTOCOL
    assert not world.board.faults.wire.has_any


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("error heat", "'heat' is none of signal, overrun"),
        ("set mode loud", "expected usb-dual-port, mute"),
        ("set timeout-ms nan", "not a number of milliseconds from 0"),
        ("set min-us 2400", "min-us 2400 would be above max-us 2000"),
    ],
)
def test_a_wrong_word_is_named_with_what_would_be_right(world, text, says):
    with pytest.raises(ValueError) as error:
        world.do(text)
    assert says in str(error.value)


@pytest.mark.parametrize(
    ("channels", "options", "says"),
    [
        (8, {}, "8 channels: a Maestro has 6, 12, 18, 24"),
        (6, {"servos": [HobbySpec(6)]}, "channels are 0 to 5"),
        (6, {"servos": [(1,), (1,)]}, "channel 1: use a different channel for each"),
    ],
)
def test_boards_that_do_not_exist(channels, options, says):
    with pytest.raises(ValueError, match=says):
        build_board(channels, lambda: 0.0, **options)


# --- anything at all


@given(
    st.sampled_from(SIZES),
    st.booleans(),
    st.lists(st.tuples(st.binary(max_size=40), st.integers(0, 500)), max_size=12),
)
def test_no_bytes_break_it_and_no_pulse_leaves_its_limits(channels, crc, talk):
    twins = [World(channels, crc=crc) for _ in range(2)]
    for data, nap_ms in talk:
        answers = []
        for world in twins:
            answers.append(world.ask(data))
            world.now_s += nap_ms / 1000.0
            for channel in world.board.body.channels:
                assert channel.position == 0 or 3968 <= channel.position <= 8000
        assert answers[0] == answers[1]
    assert twins[0].board.positions_steps() == twins[1].board.positions_steps()
