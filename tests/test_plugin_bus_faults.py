"""A bus of a package that raises, is slow or reads nonsense: it is named, no torque stays on."""

from math import inf, nan
from types import SimpleNamespace
from typing import Any

import pytest

from gazerig.drivers.bus.checked_bus import CheckedBus
from gazerig.drivers.errors import BusLost
from gazerig.drivers.types import Feedback, ServoConfig


def raising(*_):
    raise KeyError("no\nbody")


SERVOS = (ServoConfig(1, "m", 0, 1000, 500.0, "neck"), ServoConfig(2, "m", 0, 1000, 500.0, "jaw"))
GOOD: Any = Feedback.of_none(2)._replace(
    position_steps=(500.0, 400.0), velocity_steps_s=(0.0, 0.0), load=(0.0, 0.0), at_s=(1.0, 1.0),
    torque=(True, True), missing=(),
)  # fmt: skip


def checked(**methods):
    said = SimpleNamespace(events=lambda: (), faults=lambda: (), **methods)
    return CheckedBus(said, "bus 'b' of b 1", SERVOS)


@pytest.mark.parametrize(
    ("answer", "reported"),
    [
        (lambda now_s: None, "read returned a NoneType, wanted Feedback"),
        (lambda now_s: (1, 2, 3), "read returned a tuple, wanted Feedback"),
        (lambda now_s: Feedback.of_none(1), "1 values of position_steps for 2 servos"),
        (lambda now_s: GOOD._replace(torque=(True,)), "1 values of torque for 2 servos"),
        (lambda now_s: GOOD._replace(load=7), "object of type 'int' has no len"),
        (lambda now_s: GOOD._replace(missing=(5,)), "missing [5] of 2 servos"),
        (lambda now_s: GOOD._replace(position_steps=("a", 1.0)), "must be real number"),
        (raising, "read failed (KeyError"),
    ],
)
def test_a_bus_that_reads_nonsense_ends_the_run_with_its_name(answer, reported):
    with pytest.raises(BusLost) as caught:
        checked(read=answer).read(1.0)
    assert str(caught.value).startswith("bus 'b' of b 1: ") and reported in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("column", ["position_steps", "velocity_steps_s", "load", "at_s"])
@pytest.mark.parametrize("value", [nan, inf])
def test_a_servo_without_a_finite_reading_counts_as_missing(column, value):
    bus = checked(read=lambda now_s: GOOD._replace(**{column: (1.0, value)}))
    for k in range(5):
        reported = bus.read(1.0 + 0.01 * k)
        assert reported.missing == (1,) and reported.position_steps[0] == (
            1.0 if "pos" in column else 500.0
        )
        assert not reported.torque[1]
    assert bus.events() == (
        "bus 'b' of b 1: no finite position, speed, load or time of jaw (servo 2): taken as missing",
    )


def test_a_read_that_takes_a_tick_is_reported_seldom():
    clock = [0.0]

    def slow(now_s):
        clock[0] += 0.02
        return GOOD

    bus = CheckedBus(
        SimpleNamespace(read=slow, events=lambda: ()), "bus 'b' of b 1", SERVOS, lambda: clock[0]
    )
    for _ in range(100):
        bus.read(clock[0])
    (line,) = bus.events()
    assert line == "bus 'b' of b 1: a read took 20 ms, as long as a tick: lower loop.rate_hz"


def test_goals_are_clipped_and_checked_whatever_the_bus_does():
    sent: list[list[int]] = []
    bus = checked(write=sent.append)
    bus.write([-50, 1e9])
    assert sent == [[0, 1000]]
    for wrong in ([nan, 1], [1], [1, 2, 3]):
        with pytest.raises(ValueError):
            bus.write(wrong)
    assert len(sent) == 1


@pytest.mark.parametrize("goals", [None, (1,), (500, nan), (500, 4000), "no"])
def test_torque_with_a_goal_outside_is_taken_off_again(goals):
    released = []
    bus = checked(enable_torque=lambda: goals, disable_torque=lambda: released.append(1))
    with pytest.raises(BusLost, match="enable_torque returned no goal within limits"):
        bus.enable_torque()
    assert released


def test_a_bus_that_cannot_release_says_to_cut_the_power():
    with pytest.raises(
        BusLost, match=r"disable_torque failed \(KeyError.*\): cut the servo power$"
    ):
        checked(disable_torque=raising).disable_torque()
