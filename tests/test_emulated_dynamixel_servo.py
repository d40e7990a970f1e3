"""One emulated Dynamixel servo alone: registers, torque, operating modes, protections."""

import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from present import present

from gazerig.drivers.dynamixel.control_table import MODELS, registers_of
from gazerig.sim_mock.dynamixel.servo import DynamixelServo
from gazerig.sim_mock.smart_servo.physics import Physics, Quirks, ServoSpec


class Bench:
    """A servo, its registers by their addresses, and its clock in milliseconds."""

    def __init__(self, model="xl330-m077", start=2048, firmware=53, quirks=None, seed=0, **physics):
        quirks = quirks or Quirks()
        spec = ServoSpec(1, model, start, firmware, Physics(**physics), quirks, seed)
        self.servo = DynamixelServo(spec, 0)
        self.registers = {register.address: register for register in registers_of(MODELS[model])}
        self.ms = 0

    def put(self, address, value):
        """Write one register; give the error number."""
        size = self.registers[address].size
        return self.servo.write(address, value.to_bytes(size, "little", signed=value < 0))

    def get(self, address):
        register = self.registers[address]
        raw = present(self.servo.read(address, register.size))
        return int.from_bytes(raw, "little", signed=register.signed)

    def enable_torque(self, goal=None):
        assert self.put(64, 1) == 0
        if goal is not None:
            assert self.put(116, goal) == 0

    def at(self, ms):
        """Let time pass until then; give whether it listens."""
        self.ms = ms
        return self.servo.advance(ms, ms)

    def run(self, ms):
        return self.at(self.ms + ms)


@pytest.mark.parametrize(
    ("address", "size", "value", "error"),
    [
        (11, 1, 2, 4),  # no such mode
        (116, 4, 4096, 6),  # beyond Max Position Limit
        (132, 4, 0, 7),  # read only
        (66, 1, 0, 7),  # undefined
        (116, 2, 0, 5),  # half a register
        (116, 5, 0, 7),  # runs into a read only one
    ],
)
def test_bad_writes_change_nothing(address, size, value, error):
    bench = Bench("xl330-m288", 1234)
    before = bytes(bench.servo.memory.bytes)
    raw = value.to_bytes(size, "little", signed=value < 0)
    assert bench.servo.write(address, raw) == error
    assert bytes(bench.servo.memory.bytes) == before


def test_homing_offset_shifts_the_present_position():
    bench = Bench("xl330-m288", 700)
    bench.put(20, 100)
    assert bench.get(132) == 800
    bench.put(20, -5000)
    assert bench.get(132) == 700 - 1024


def test_some_firmware_takes_the_present_position_as_goal_instead():
    bench = Bench("xl330-m288", 1000, 53, Quirks(goal_at_torque_on=True))
    bench.servo.turn(200)
    bench.put(64, 1)
    bench.at(1000)
    assert (bench.get(116), bench.get(132)) == (1200, 1200)


def test_some_firmware_wraps_the_position_as_the_torque_comes_on():
    plain = Bench("xl330-m288", 100)
    wraps = Bench("xl330-m288", 100, 53, Quirks(wrap_at_torque_on=True))
    for bench, at in ((plain, -100), (wraps, 3996)):
        bench.put(20, -200)
        bench.put(64, 1)
        assert bench.get(132) == at


def test_live_registers_tell_the_motion():
    bench = Bench("xl330-m077", 1000)
    bench.put(112, 100)
    bench.enable_torque(2000)
    bench.at(200)
    assert bench.get(128) == pytest.approx(100, abs=25)
    assert bench.get(136) == 100
    assert bench.get(140) > bench.get(132) > 1200
    assert bench.get(122) == 1
    assert bench.get(123) == 0b010010
    assert bench.get(124) > 0
    assert (bench.get(144), bench.get(146)) == (50, 30)
    assert bench.get(120) == 200
    bench.at(40000)
    assert bench.get(132) == pytest.approx(2000, abs=12)
    assert (bench.get(122), bench.get(123)) == (0, 0b010001)
    assert bench.get(120) == 40000 - 32768


def test_a_servo_that_holds_still_flickers_by_its_seed_however_often_one_looks():
    def heard(seed, looks):
        bench = Bench("xl330-m077", 1000, 53, Quirks(), seed)
        bench.enable_torque()
        out = []
        for k in range(200 * looks):
            bench.at(round(1000 + k / looks))
            if k % looks == 0:
                out.append(struct.unpack("<hii", present(bench.servo.read(126, 10))))
        return out

    once = heard(1, 1)
    assert once == heard(1, 3) != heard(2, 1)
    assert {place for _, _, place in once} == {1000}
    assert {amps for amps, _, _ in once} == {-2, -1, 0, 1, 2}


def test_reverse_mode_mirrors_position_velocity_current_and_pwm():
    bench = Bench("xl330-m077", 1000)
    bench.put(10, 1)
    assert bench.get(132) == 4096 - 1000
    bench.enable_torque(3500)
    bench.at(40)
    assert bench.get(132) > 3100 and bench.servo.shaft.x < 1000
    assert bench.get(128) > 0
    assert bench.get(124) > 0
    bench.at(2000)
    assert bench.get(132) == pytest.approx(3500, abs=12)


def test_startup_configuration_switches_the_torque_on_and_restores_the_ram():
    bench = Bench("xl330-m288", 1000)
    assert bench.put(84, 999) == 0
    assert bench.servo.backup() == 0
    for configuration, torque, gain in ((0, 0, 400), (1, 1, 400), (2, 0, 999), (3, 1, 999)):
        bench.put(64, 0)
        assert bench.put(60, configuration) == 0
        bench.servo.restart()
        bench.run(1000)
        assert (bench.get(64), bench.get(84)) == (torque, gain)
        assert bench.get(132) == 1000


def test_backup_and_restore():
    bench = Bench("xl330-m288", 1000)
    assert (bench.get(147), bench.servo.restore()) == (0, 1)
    bench.put(9, 7)
    bench.put(84, 777)
    assert (bench.servo.backup(), bench.get(147)) == (0, 1)
    bench.put(9, 0)
    bench.put(84, 1)
    bench.enable_torque()
    assert (bench.servo.backup(), bench.servo.restore()) == (1, 1)
    bench.put(64, 0)
    assert bench.servo.restore() == 0
    assert not bench.run(399)
    assert bench.run(1)
    assert (bench.get(9), bench.get(84), bench.get(147)) == (7, 777, 1)
    old = Bench("xl330-m288", 1000, 45)
    assert (old.servo.backup(), old.servo.restore()) == (2, 2)


def test_factory_reset_puts_the_eeprom_back_and_spares_what_it_was_told():
    for option, servo_id, baud in ((0xFF, 1, 57600), (1, 5, 57600), (2, 5, 4_000_000)):
        bench = Bench("xl330-m288")
        for address, value in ((7, 5), (8, 6), (9, 0), (20, 300), (48, 3000)):
            assert bench.put(address, value) == 0
        assert bench.servo.factory_reset(option) == 0
        bench.at(500)
        assert (bench.servo.id, bench.servo.baud) == (servo_id, baud)
        assert (bench.get(9), bench.get(20), bench.get(48)) == (250, 0, 4095)
        assert bench.get(132) == 2048
    bench.enable_torque()
    assert (bench.servo.factory_reset(3), bench.servo.factory_reset(1)) == (4, 7)


# --- operating modes


def in_mode(mode, model="xl330-m077", **physics):
    bench = Bench(model, **physics)
    assert bench.put(11, mode) == 0
    return bench


@pytest.mark.parametrize("mode", [0, 1, 16])
def test_a_servo_that_is_driven_by_a_goal_of_its_own_waits_for_it(mode):
    bench = in_mode(mode)
    bench.put(64, 1)
    bench.run(500)
    assert bench.servo.position_steps == 2048


def test_the_velocity_mode_reaches_its_goal_both_ways_and_under_load():
    for goal, load in ((500, 0.0), (-500, 0.0), (300, 0.03), (300, -0.03)):
        bench = in_mode(1, load_nm=load)
        bench.put(64, 1)
        assert bench.put(104, goal) == 0
        bench.run(3000)
        assert bench.get(128) == pytest.approx(goal, abs=3)
        assert bench.get(136) == goal
    assert bench.put(104, 1621) == 6


def test_the_pwm_mode_is_open_loop():
    bench = in_mode(16, supply_ohm=0.0)
    bench.put(64, 1)
    for goal in (443, -443):
        assert bench.put(100, goal) == 0
        bench.run(2000)
        assert bench.get(124) == goal
        share = 443 / 885
        # Half the voltage, of which dry friction takes its 3 %.
        expected = (share - 0.03) / (1 - 0.03) * 383 / 0.229
        assert abs(bench.get(128)) == pytest.approx(expected, rel=0.01)


def test_the_current_mode_pushes_with_its_current_and_no_more():
    bench = in_mode(0, stop_high_steps=2100)
    bench.put(64, 1)
    assert (bench.put(102, 1751), bench.put(102, 200)) == (6, 0)
    bench.run(1000)
    assert bench.get(126) == pytest.approx(200, abs=3)
    assert bench.servo.position_steps == 2100
    bench.put(102, 30)
    bench.run(100)
    bench.servo.turn(-50)
    bench.run(500)
    # 30 of 1470 mA are less than dry friction.
    assert bench.servo.position_steps == 2050


def test_current_based_position_yields_to_an_obstacle():
    soft, hard = (in_mode(5, stop_high_steps=2200) for _ in range(2))
    for bench, goal in ((soft, 300), (hard, 1470)):
        bench.put(102, goal)
        bench.put(64, 1)
        bench.put(116, 4000)
        bench.run(500)
    assert soft.get(126) == pytest.approx(300, abs=3)
    assert hard.get(126) > 1200
    soft.put(116, 2100)
    soft.run(2000)
    assert soft.servo.position_steps == pytest.approx(2100, abs=12)


def test_extended_position_counts_turns_and_a_return_to_position_mode_wraps_them():
    bench = in_mode(4, "xl330-m288")
    bench.put(64, 1)
    assert (bench.put(116, 1_048_576), bench.put(116, 9000)) == (6, 0)
    bench.run(8000)
    assert bench.get(132) == pytest.approx(9000, abs=12)
    bench.put(64, 0)
    at = bench.get(132)
    bench.put(11, 3)
    assert bench.get(132) == at - 2 * 4096


def test_a_change_of_mode_resets_profile_gains_and_goals():
    bench = in_mode(3)
    for address, value in ((108, 5), (112, 6), (84, 7), (90, 8), (100, 9), (102, 10), (104, 11)):
        assert bench.put(address, value) == 0
    bench.put(11, 1)
    assert [bench.get(a) for a in (108, 112, 84, 90)] == [0, 0, 400, 0]
    # The goal of the mode itself is 0, the others are at their limits.
    assert [bench.get(a) for a in (100, 102, 104)] == [885, 1750, 0]


@pytest.mark.parametrize(
    ("mode", "address", "goal"), [(1, 104, 400), (16, 100, 400), (0, 102, 300)]
)
def test_the_watchdog_ends_every_kind_of_motion(mode, address, goal):
    bench = in_mode(mode)
    bench.put(64, 1)
    bench.put(address, goal)
    bench.put(98, 2)
    bench.servo.advance(39, 0)
    assert bench.get(128) > 0
    bench.servo.advance(3000, 0)
    assert bench.get(98) == 255
    assert abs(bench.get(128)) <= 3
    assert bench.put(address, goal) == 4
    bench.put(98, 0)
    bench.ms = 3000
    assert bench.put(address, goal) == 0
    bench.run(300)
    assert bench.get(128) > 100


def test_a_model_without_current_sensor_has_four_modes_and_reports_load():
    bench = in_mode(3, "xl430-w250", stop_high_steps=2100, supply_ohm=0.0)
    assert [bench.put(11, mode) for mode in (0, 5, 1, 4, 16, 3)] == [4, 4, 0, 0, 0, 0]
    bench.put(64, 1)
    bench.put(116, 4000)
    bench.run(500)
    assert 998 <= bench.get(126) <= 1000  # 2 of noise
    assert bench.servo.write(102, bytes(2)) == 7


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
        bench = in_mode(mode, load_nm=0.02)
        bench.put(10, drive)
        bench.put(64, 1)
        for address, value, ms in writes:
            low = 0 if address < 100 or address in (108, 112) else -20000
            bench.put(address, max(low, value))
            for k in range(looks):
                bench.servo.advance(bench.ms + ms * (k + 1) // looks, 0)
            bench.ms += ms
        seen.append((bench.servo.position_steps, bench.servo.read(120, 27)))
    assert seen[0] == seen[1]


# --- protections against heat, load and voltage


def stuck(**physics):
    """A servo that pushes against a jammed joint."""
    bench = Bench(**physics)
    bench.put(64, 1)
    bench.servo.jam()
    bench.put(116, 4000)
    return bench


def test_a_jammed_joint_overloads_after_its_time_and_only_a_reboot_clears_it():
    bench = stuck(overload_s=1.5)
    bench.at(1400)
    assert (bench.get(70), bench.get(64), bench.servo.error_flag) == (0, 1, 0)
    bench.at(1600)
    assert (bench.get(70), bench.get(64), bench.servo.error_flag) == (0x20, 0, 0x80)
    assert (bench.get(124), bench.get(126)) == (0, 0)
    bench.servo.jam(False)
    assert bench.put(64, 1) == 0
    assert bench.get(64) == 0
    bench.servo.restart()
    assert not bench.at(1900)
    assert bench.at(2100)
    assert (bench.get(70), bench.put(64, 1), bench.get(64)) == (0, 0, 1)


def test_a_load_below_the_threshold_or_broken_off_in_time_is_none():
    weak = stuck()
    weak.put(100, 600)
    weak.at(20_000)
    brief = stuck()
    for k in range(1, 6):
        brief.at(k * 2000 - 200)
        brief.put(116, 2048)
        brief.at(k * 2000)
        brief.put(116, 4000)
    assert (weak.get(70), brief.get(70)) == (0, 0)


def test_a_held_load_warms_the_motor_towards_its_final_temperature():
    bench = stuck(overload_s=1e4, thermal_s=100.0, stall_rise_c=60.0, supply_ohm=0.0)
    bench.put(100, 708)
    bench.at(100_000)
    # 80 % of the current are 64 % of the heat; 1 - 1/e of it after one time constant.
    assert bench.get(146) == pytest.approx(30 + 60 * 0.64 * 0.632, abs=1)
    bench.put(64, 0)
    bench.at(1_000_000)
    assert bench.get(146) == 30


def test_overheating_latches_above_the_limit_register():
    bench = Bench()
    bench.put(64, 1)
    bench.servo.temperature_c = 69.5
    bench.at(40)
    assert bench.get(70) == 0
    bench.servo.temperature_c = 71.0
    bench.at(80)
    assert (bench.get(70), bench.get(64)) == (0x04, 0)
    bench.servo.restart()
    bench.at(600)
    assert bench.get(70) == 0x04
    bench.servo.temperature_c = 40.0
    bench.servo.restart()
    bench.at(1200)
    assert bench.get(70) == 0


@pytest.mark.parametrize(("volts", "bits"), [(3.3, 1), (3.5, 0), (5.0, 0), (7.0, 0), (7.2, 1)])
def test_an_xl330_loses_its_torque_outside_its_voltage_limits(volts, bits):
    bench = Bench()
    bench.put(64, 1)
    bench.servo.supply_v = volts
    bench.at(100)
    assert (bench.get(70), bench.get(64), bench.get(144)) == (bits, 1 - bits, volts * 10)
    bench.servo.supply_v = 5.0
    bench.at(200)
    assert bench.get(70) == bits


def test_an_xc330_keeps_its_torque_and_tells():
    bench = Bench("xc330-m288")
    bench.put(64, 1)
    bench.servo.supply_v = 3.3
    bench.at(100)
    assert (bench.get(70), bench.get(64), bench.servo.error_flag) == (1, 1, 0x80)


def test_too_little_voltage_restarts_the_servo_without_a_word():
    bench = Bench()
    bench.put(64, 1)
    bench.put(112, 99)
    bench.at(1000)
    bench.servo.supply_v = 2.0
    assert not bench.at(1050)
    bench.servo.supply_v = 5.0
    assert not bench.at(1400)
    assert bench.at(1500)
    assert (bench.get(64), bench.get(112), bench.get(70)) == (0, 0, 0)
    assert bench.get(120) < 500
