"""One emulated servo alone: what may be written when, torque, live registers."""

import pytest

from sim_mock.servo import Servo, ServoSpec


class Bench:
    """A servo and its clock, which is set by hand."""

    def __init__(self, *spec):
        self.servo = Servo(ServoSpec(1, *spec), 0)
        self.now_s = 0.0

    def advance(self) -> None:
        self.servo.advance(round(self.now_s * 1000.0), 0)

    def write(self, address: int, size: int, value: int) -> int:
        """Write one register; give the error number."""
        self.advance()
        return self.servo.write(address, value.to_bytes(size, "little", signed=value < 0))

    def read(self, address: int, size: int, signed: bool = False) -> int:
        self.advance()
        return int.from_bytes(self.servo.read(address, size), "little", signed=signed)

    def engage(self, goal: int | None = None) -> None:
        assert self.write(64, 1, 1) == 0
        if goal is not None:
            assert self.write(116, 4, goal) == 0


@pytest.mark.parametrize(
    ("address", "size", "value", "error"),
    [
        (65, 1, 2, 4),  # out of range
        (11, 1, 2, 4),  # no such mode
        (116, 4, 4096, 6),  # beyond Max Position Limit
        (116, 4, -1, 6),
        (100, 2, 886, 6),  # beyond PWM Limit
        (132, 4, 0, 7),  # read only
        (66, 1, 0, 7),  # undefined
        (116, 2, 0, 5),  # half a register
        (116, 5, 0, 7),  # runs into a read only one
    ],
)
def test_bad_writes_change_nothing(address, size, value, error):
    bench = Bench("xl330-m288", 1234)
    before = bytes(bench.servo.memory.bytes)
    assert bench.write(address, size, value) == error
    assert bytes(bench.servo.memory.bytes) == before


def test_the_limit_registers_narrow_the_goal():
    bench = Bench("xl330-m288")
    bench.write(48, 4, 3000)
    bench.write(52, 4, 1000)
    assert [bench.write(116, 4, goal) for goal in (999, 1000, 3000, 3001)] == [6, 0, 0, 6]
    bench.engage()
    assert [bench.write(116, 4, goal) for goal in (999, 1000, 3000, 3001)] == [6, 0, 0, 6]


def test_indirect_window_shows_and_takes_other_registers():
    bench = Bench("xl330-m288", 777)
    for i in range(4):
        bench.write(168 + 2 * i, 2, 132 + i)
    bench.write(176, 2, 65)
    assert bench.read(224, 4) == 777
    assert bench.write(228, 1, 1) == 0
    assert bench.read(65, 1) == 1
    assert bench.write(224, 1, 0) == 7
    assert bench.write(168, 2, 20) == 4


def test_mode_change_clears_the_profile_and_takes_the_present_position():
    bench = Bench("xl330-m288", 700)
    bench.write(112, 4, 55)
    bench.write(116, 4, 900)
    assert bench.write(11, 1, 4) == 0
    assert (bench.read(112, 4), bench.read(116, 4)) == (0, 700)
    assert bench.write(116, 4, 9000) == 0


def test_homing_offset_shifts_the_present_position():
    bench = Bench("xl330-m288", 700)
    bench.write(20, 4, 100)
    assert bench.read(132, 4) == 800
    bench.write(20, 4, -5000)
    assert bench.read(132, 4, signed=True) == 700 - 1024


def test_the_goal_is_kept_and_followed_when_the_torque_comes_on():
    bench = Bench("xl330-m288", 1000)
    bench.servo.shaft.place(1200)
    bench.write(64, 1, 1)
    bench.now_s = 1.0
    assert bench.read(132, 4) == 1000


def test_without_torque_a_joint_stays_or_sinks():
    stays, sinks = (
        Bench("xl330-m288", 1000),
        Bench("xl330-m288", 1000, 53, 0.01, 0.05, 700),
    )
    for bench in (stays, sinks):
        bench.engage()
        bench.now_s = 1.0
        bench.read(132, 4)
        bench.write(64, 1, 0)
        bench.now_s = 6.0
    assert (stays.read(132, 4), sinks.read(132, 4)) == (1000, 700)


def test_live_registers_tell_the_motion():
    bench = Bench("xl330-m077", 1000)
    bench.write(112, 4, 100)
    bench.engage(2000)
    bench.now_s = 0.2
    assert bench.read(128, 4) == 100
    assert bench.read(136, 4) == 100
    assert bench.read(140, 4) > bench.read(132, 4) > 1200
    assert bench.read(122, 1) == 1
    assert bench.read(123, 1) == 0b010010
    assert bench.read(124, 2) > 0
    assert (bench.read(144, 2), bench.read(146, 1)) == (50, 30)
    assert bench.read(120, 2) == 200
    bench.now_s = 40.0
    assert bench.read(132, 4) == 2000
    assert (bench.read(122, 1), bench.read(128, 4), bench.read(126, 2)) == (0, 0, 0)
    assert bench.read(120, 2) == 40000 - 32768


def test_current_points_the_way_the_shaft_is_pushed():
    bench = Bench("xl330-m077", 1000)
    bench.engage(3000)
    bench.now_s = 0.005
    assert 100 < bench.read(126, 2, signed=True) <= 1470
    bench.write(116, 4, 0)
    bench.now_s = 0.010
    assert -1470 <= bench.read(126, 2, signed=True) < -100


def test_eeprom_is_locked_while_the_torque_is_on():
    bench = Bench("xl330-m288")
    bench.engage()
    assert bench.write(9, 1, 0) == 7
    assert bench.read(9, 1) == 250
    bench.write(64, 1, 0)
    assert bench.write(9, 1, 0) == 0
    assert bench.read(9, 1) == 0
