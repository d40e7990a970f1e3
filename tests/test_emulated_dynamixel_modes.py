"""The operating modes of the emulated servo, driven through its registers."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from present import present

from gazerig.sim_mock.dynamixel.servo import DynamixelServo
from gazerig.sim_mock.smart_servo.physics import Physics, ServoSpec

SIZE = {11: 1, 36: 2, 38: 2, 44: 4, 62: 1, 64: 1, 98: 1, 100: 2, 102: 2, 104: 4, 108: 4, 112: 4}


class Bench:
    """A servo in a mode, and its clock in milliseconds."""

    def __init__(self, mode, model="xl330-m077", **physics):
        self.servo = DynamixelServo(ServoSpec(1, model, 2048, 53, Physics(**physics)), 0)
        self.ms = 0
        assert self.put(11, mode) == 0

    def put(self, address, value):
        size = SIZE.get(address, 4 if address == 116 else 2)
        return self.servo.write(address, value.to_bytes(size, "little", signed=value < 0))

    def get(self, address, size=4):
        return int.from_bytes(present(self.servo.read(address, size)), "little", signed=True)

    def run(self, ms):
        self.ms += ms
        self.servo.advance(self.ms, self.ms)


@pytest.mark.parametrize("mode", [0, 1, 16])
def test_a_servo_that_is_driven_by_a_goal_of_its_own_waits_for_it(mode):
    bench = Bench(mode)
    bench.put(64, 1)
    bench.run(500)
    assert bench.servo.position_steps == 2048


def test_the_velocity_mode_reaches_its_goal_both_ways_and_under_load():
    for goal, load in ((500, 0.0), (-500, 0.0), (300, 0.03), (300, -0.03)):
        bench = Bench(1, load_nm=load)
        bench.put(64, 1)
        assert bench.put(104, goal) == 0
        bench.run(3000)
        assert bench.get(128) == pytest.approx(goal, abs=3)
        assert bench.get(136) == goal
    assert bench.put(104, 1621) == 6


def test_the_velocity_mode_ramps_with_profile_acceleration_alone():
    bench = Bench(1)
    bench.put(112, 10)
    bench.put(108, 100)
    bench.put(64, 1)
    bench.put(104, 400)
    bench.run(128)
    # 64 V/A ms: half of 256 ms, half of the speed.
    assert bench.get(136) == 200
    bench.run(128)
    assert bench.get(136) == 400


def test_the_pwm_mode_is_open_loop():
    bench = Bench(16, supply_ohm=0.0)
    bench.put(64, 1)
    for goal in (443, -443):
        assert bench.put(100, goal) == 0
        bench.run(2000)
        assert bench.get(124, 2) == goal
        share = 443 / 885
        # Half the voltage, of which dry friction takes its 3 %.
        expected = (share - 0.03) / (1 - 0.03) * 383 / 0.229
        assert abs(bench.get(128)) == pytest.approx(expected, rel=0.01)


def test_pwm_slope_limits_how_fast_the_pwm_rises():
    bench = Bench(16)
    bench.put(64, 1)
    bench.put(100, 885)
    bench.run(9)
    # 140 * 1.977 mV/ms at 5 V: 18 ms to full.
    assert bench.get(124, 2) == pytest.approx(885 * 9 * 0.27678 / 5.0, abs=1)
    bench.run(10)
    assert bench.get(124, 2) == 885


def test_the_current_mode_pushes_with_its_current_and_no_more():
    bench = Bench(0, stop_high_steps=2100)
    bench.put(64, 1)
    assert (bench.put(102, 1751), bench.put(102, 200)) == (6, 0)
    bench.run(1000)
    assert bench.get(126, 2) == pytest.approx(200, abs=3)
    assert bench.servo.position_steps == 2100
    bench.put(102, 30)
    bench.run(100)
    bench.servo.turn(-50)
    bench.run(500)
    # 30 of 1470 mA are less than dry friction.
    assert bench.servo.position_steps == 2050


def test_current_based_position_yields_to_an_obstacle():
    soft, hard = (Bench(5, stop_high_steps=2200) for _ in range(2))
    for bench, goal in ((soft, 300), (hard, 1470)):
        bench.put(102, goal)
        bench.put(64, 1)
        bench.put(116, 4000)
        bench.run(500)
    assert soft.get(126, 2) == pytest.approx(300, abs=3)
    assert hard.get(126, 2) > 1200
    soft.put(116, 2100)
    soft.run(2000)
    assert soft.servo.position_steps == pytest.approx(2100, abs=12)


def test_extended_position_counts_turns_and_a_return_to_position_mode_wraps_them():
    bench = Bench(4, "xl330-m288")
    bench.put(64, 1)
    assert (bench.put(116, 1_048_576), bench.put(116, 9000)) == (6, 0)
    bench.run(8000)
    assert bench.get(132) == pytest.approx(9000, abs=12)
    bench.put(64, 0)
    at = bench.get(132)
    bench.put(11, 3)
    assert bench.get(132) == at - 2 * 4096


@pytest.mark.parametrize("mode", [0, 1, 16])
def test_a_change_of_mode_resets_profile_gains_and_goals(mode):
    bench = Bench(3)
    for address, value in ((108, 5), (112, 6), (84, 7), (90, 8), (100, 9), (102, 10), (104, 11)):
        assert bench.put(address, value) == 0
    bench.put(11, mode)
    assert [bench.get(a) for a in (108, 112)] == [0, 0]
    assert [bench.get(a, 2) for a in (84, 90)] == [400, 0]
    mine = {0: 102, 1: 104, 16: 100}.get(mode)
    limits = {100: 885, 102: 1750, 104: 1620}
    assert {a: bench.get(a, 4 if a == 104 else 2) for a in limits} == {
        a: 0 if a == mine else limit for a, limit in limits.items()
    }


@pytest.mark.parametrize(
    ("mode", "address", "goal"), [(1, 104, 400), (16, 100, 400), (0, 102, 300)]
)
def test_the_watchdog_ends_every_kind_of_motion(mode, address, goal):
    bench = Bench(mode)
    bench.put(64, 1)
    bench.put(address, goal)
    bench.put(98, 2)
    bench.servo.advance(39, 0)
    assert bench.get(128) > 0
    bench.servo.advance(3000, 0)
    assert bench.get(98, 1) == -1
    assert abs(bench.get(128)) <= 3
    assert bench.put(address, goal) == 4
    bench.put(98, 0)
    bench.ms = 3000
    assert bench.put(address, goal) == 0
    bench.run(300)
    assert bench.get(128) > 100


def test_a_model_without_current_sensor_has_four_modes_and_reports_load():
    bench = Bench(3, "xl430-w250", stop_high_steps=2100, supply_ohm=0.0)
    assert [bench.put(11, mode) for mode in (0, 5, 1, 4, 16, 3)] == [4, 4, 0, 0, 0, 0]
    bench.put(64, 1)
    bench.put(116, 4000)
    bench.run(500)
    assert 998 <= bench.get(126, 2) <= 1000  # 2 of noise
    assert bench.put(102, 1) == 7


@given(
    mode=st.sampled_from((0, 1, 3, 4, 5, 16)),
    writes=st.lists(
        st.tuples(
            st.sampled_from((76, 78, 80, 82, 84, 88, 90, 100, 102, 104, 108, 112, 116)),
            st.integers(-20000, 20000),
            st.integers(0, 60),
        ),
        max_size=12,
    ),
    drive=st.sampled_from((0, 1, 4, 5, 12)),
)
@settings(max_examples=80, deadline=None)
def test_any_writes_leave_finite_registers_and_the_same_result_however_often_one_looks(
    mode, writes, drive
):
    seen = []
    for looks in (1, 7):
        bench = Bench(mode, load_nm=0.02)
        bench.servo.write(10, bytes((drive,)))
        bench.put(64, 1)
        for address, value, ms in writes:
            low = 0 if address < 100 or address in (108, 112) else -20000
            size = SIZE.get(address, 4 if address == 116 else 2)
            bench.servo.write(address, max(low, value).to_bytes(size, "little", signed=True))
            for k in range(looks):
                bench.servo.advance(bench.ms + ms * (k + 1) // looks, 0)
            bench.ms += ms
        seen.append((bench.servo.position_steps, bench.servo.read(120, 27)))
    assert seen[0] == seen[1]
