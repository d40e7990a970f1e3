"""The language of faults: how long they last, what tells of them, and what is refused."""

import json
from typing import Any, cast

import pytest
from faulty_line import IDS, World, good
from hypothesis import given
from hypothesis import strategies as st

from gazerig.drivers.errors import BusLost
from gazerig.sim_mock.dynamixel.chain import DynamixelChain


@pytest.fixture
def world():
    return World()


def test_faults_last_for_a_count_a_time_or_until_cleared(world):
    world.faults.command("lose 1 count 2")
    world.faults.command("lose 2 for 1")
    world.faults.command("lose 3")
    assert [world.one(i) for i in IDS] == [b""] * 3
    assert [world.one(i) for i in IDS] == [b""] * 3
    assert world.one(1) == good(1)
    world.now_s = 5.0
    assert world.one(2) == good(2)
    assert world.one(3) == b""
    world.faults.command("clear 3")
    assert world.one(3) == good(3)
    assert not world.faults.wire.any


def test_status_tells_servos_and_faults(world):
    world.faults.command("delay all 3")
    reported = json.loads(world.faults.command("status"))
    assert [servo["position"] for servo in reported["servos"]] == [2001, 2002, 2003]
    assert reported["servos"][0]["torque"] == 0
    assert reported["faults"] == ["delay all"]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("lsoe 3", "'lsoe' is not a command; commands: lose, delay"),
        ("lose", "ID is missing; usage: lose ID"),
        ("lose 3 4", "'4' is one argument too many"),
        ("lose x", "'x' is not a servo id from 0 to 252"),
        ("lose 9", "no servo 9; servos are 1, 2, 3"),
        ("lose 3 count none", "'none' is not a number of answers"),
        ("delay 3 soon", "'soon' is not milliseconds from 0"),
        ("delay 3 nan", "'nan' is not milliseconds"),
        ("noise over", "'over' is neither before nor after"),
        ("noise before xyz", "'xyz' is neither random nor bytes in hex"),
        ("echo perhaps", "'perhaps' is neither on nor off"),
        ("overload 1 count 3", "'count' is not expected here"),
        ("set after-missing wait", "expected silence, skip, timeout"),
        ("set afterwards skip", "unknown; expected after-missing, wrong-baud"),
        ("set slot-timeout-ms -1", "not a number of milliseconds"),
    ],
)
def test_a_wrong_word_is_named_with_what_would_be_right(world, text, says):
    with pytest.raises(ValueError) as error:
        world.faults.command(text)
    assert says in str(error.value)
    assert not world.faults.wire.any


def test_help_explains_every_command(world):
    text = world.faults.command("help")
    commands = DynamixelChain.commands
    assert all(commands.usage(name) in text for name in commands.verbs)
    assert world.faults.command("help lose").startswith("lose ID [count N]")


_WORDS = st.sampled_from(
    [*DynamixelChain.commands.verbs, "help", "1", "2", "3", "0", "-1", "5", "on", "off", "all"]
)


@given(st.lists(st.lists(_WORDS, min_size=1, max_size=5), max_size=6))
def test_no_mixture_of_commands_breaks_the_bus(lines):
    """Whatever was asked for, the bus goes on, and is sound again once all is cleared."""
    world = World()
    for line in lines:
        try:
            world.faults.command(" ".join(line))
        except ValueError as error:
            assert str(error)
        try:
            world.fast()
            world.plain()
        except BusLost:
            world.faults.command("plug")
            world.faults.command("deny off")
            world.port.setBaudRate(1_000_000)
    world.faults.command("clear")
    world.port.setBaudRate(1_000_000)
    world.now_s += 100.0
    world.port.drain()
    if len(set(cast(Any, world.port.chain).ids())) == len(cast(Any, world.port.chain).ids()):
        assert [world.one(i)[8] & 0x7F for i in IDS] == [0, 0, 0]
