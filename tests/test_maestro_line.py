"""The line's time-out and the memory of one channel, separately."""

import pytest
from stand_in import StandIn

from gazerig.drivers.hobby_board.channel import Channel
from gazerig.drivers.maestro.commands import SPEED_STEPS_S, speed_units
from gazerig.drivers.maestro.line import MaestroLink
from gazerig.drivers.maestro.params import MaestroParams
from gazerig.drivers.types import ServoConfig

SETUP = ServoConfig(3, "hobby", 4400, 7600, 12_000.0)


class SlowPort(StandIn):
    """A port whose answers are a list of byte strings; a late answer arrives while draining."""

    port_name = "scripted"

    def __init__(self, *answers, late=b""):
        self.answers, self.late, self.sent = list(answers), late, []

    def now_s(self):
        return 0.0

    def write(self, data):
        self.sent.append(data)

    def read_until(self, length, deadline_s):
        came = self.answers.pop(0) if self.answers else b""
        if came is None:
            # It is still in transit: clearing the received bytes misses it.
            self.answers.insert(0, self.late)
            return b""
        return came

    def exchange(self, request, length, deadline_s):
        self.write(request)
        return self.read_until(length, deadline_s), 0.0

    def drain(self):
        self.answers = [answer for answer in self.answers if answer is not self.late]
        return 0

    def clearPort(self):
        pass


def test_an_answer_after_its_time_is_not_the_next_ones():
    port = SlowPort(None, *[b"\x70\x17"] * 2, late=b"\xff\x00")
    line = MaestroLink(port, MaestroParams())
    assert line.read_pulses((0,)) is None
    assert line.read_pulses((0,)) == (6000,)
    assert line.errors == {"timeout": 1}


def test_numbers_that_cannot_be_are_damage():
    line = MaestroLink(SlowPort(b"\xff\xff", *[b"\x70\x17"] * 2), MaestroParams())
    assert line.read_pulses((0,)) is None
    assert line.errors == {"damaged": 1}
    assert line.read_pulses((0,)) == (6000,)


def test_the_board_is_not_asked_too_much_at_once():
    port = SlowPort(*[bytes(12), bytes(6)] * 2)
    assert MaestroLink(port, MaestroParams()).read_pulses(range(9)) == (0,) * 9
    assert [len(packet) for packet in port.sent] == [12, 6] * 2


def test_more_than_was_asked_for_is_damage():
    """A channel that answers twice: all behind it would have their neighbour's pulse."""
    port = SlowPort(*[b"\x70\x17" * 3] * 2, b"\x70\x17", *[bytes(6)] * 2)
    line = MaestroLink(port, MaestroParams())
    assert line.read_pulses((0, 1, 2)) is None
    assert line.errors == {"damaged": 1}
    assert line.read_pulses((0, 1, 2)) == (0, 0, 0)


def test_pulses_that_differ_when_asked_twice_are_damage():
    """Answers carry no check, and a channel is held at its reported pulse."""
    line = MaestroLink(SlowPort(b"\x70\x17", b"\x70\x1b", *[b"\x70\x17"] * 2), MaestroParams())
    assert line.read_pulses((0,)) is None
    assert line.errors == {"damaged": 1}
    assert line.read_pulses((0,)) == (6000,)


def held(setup=SETUP, pulse=6000):
    channel = Channel(setup)
    channel.adopt_position(pulse)
    channel.start(pulse, 0.0)
    channel.ramp.speed_steps_s = speed_units(setup.max_speed_steps_s) * SPEED_STEPS_S
    channel.record_hold()
    return channel


def test_a_damaged_pulse_never_puts_a_position_outside_the_limits():
    channel = held(pulse=4400)
    assert not channel.is_implausible(4300, 0.0)
    channel.adopt_pulse(4300)
    channel.advance(0.004)
    assert round(channel.ramp.shaft_steps) == 4400


def test_a_pulse_far_from_every_goal_is_strange():
    channel = held()
    assert channel.is_implausible(0, 0.0)
    assert channel.is_implausible(7000, 0.0)
    assert not channel.is_implausible(6010, 0.0)


def test_long_after_the_last_goal_a_pulse_must_be_there():
    channel = held()
    channel.record_goal(6600, 0.0)
    assert not channel.is_implausible(6200, 0.02)
    assert channel.is_implausible(6200, 1.0)
    assert not channel.is_implausible(6200, 1.0, led_away=True)
    assert not channel.is_implausible(6604, 1.0)


def test_a_board_that_is_behind_still_gives_the_pulse_of_the_goal_before():
    channel = held()
    channel.record_goal(7600, 0.0)
    channel.record_goal(7600, 0.09)
    # By now it would be far from there, had it heard of the goal at once.
    assert abs(channel.ramp.pulse_steps - 6000) > 1.2 * channel.pulse_tolerance_steps()
    assert not channel.is_implausible(6000, 0.095)
    assert channel.is_implausible(6000, 1.0)


def test_an_end_of_the_board_is_believed_when_it_was_met_twice():
    channel = held()
    channel.record_goal(7600, 0.0)
    assert not channel.is_off_goal(7400)
    assert channel.is_off_goal(7400)
    channel.advance(5.0)
    assert round(channel.ramp.shaft_steps) == 7400
    assert not channel.is_off_goal(7600)
    channel.advance(9.0)
    assert round(channel.ramp.shaft_steps) == 7600


@pytest.mark.parametrize(("rest", "place"), [(None, 6000), (5000, 5000), (9000, 7600), (0, 4400)])
def test_where_a_servo_without_pulses_is_taken_to_be(rest, place):
    channel = Channel(SETUP._replace(rest_steps=rest))
    assert round(channel.ramp.shaft_steps) == place
    assert channel.start(0, 0.0) == place


def test_new_limits_bring_the_guess_inside_but_leave_a_known_place():
    channel = Channel(SETUP)
    channel.set_target(SETUP._replace(rest_steps=5000))
    assert round(channel.ramp.shaft_steps) == 5000
    channel.adopt_position(7000)
    channel.set_target(SETUP._replace(max_steps=6500))
    assert round(channel.ramp.shaft_steps) == 7000
    assert channel.start(7000, 0.0) == 6500
