"""Protections of the emulated servo against heat, load and voltage."""

import pytest
from present import present

from gazerig.sim_mock.dynamixel.servo import DynamixelServo
from gazerig.sim_mock.smart_servo.physics import Physics, ServoSpec


class Bench:
    def __init__(self, model="xl330-m077", **physics):
        self.servo = DynamixelServo(ServoSpec(1, model, 2048, 53, Physics(**physics)), 0)

    def put(self, address, size, value):
        return self.servo.write(address, value.to_bytes(size, "little"))

    def get(self, address, size=1):
        return int.from_bytes(present(self.servo.read(address, size)), "little")

    def at(self, ms):
        return self.servo.advance(ms, ms)


def stuck(**physics):
    """A servo that pushes against a jammed joint."""
    bench = Bench(**physics)
    bench.put(64, 1, 1)
    bench.servo.jam()
    bench.put(116, 4, 4000)
    return bench


def test_a_jammed_joint_overloads_after_its_time_and_only_a_reboot_clears_it():
    bench = stuck(overload_s=1.5)
    bench.at(1400)
    assert (bench.get(70), bench.get(64), bench.servo.error_flag) == (0, 1, 0)
    bench.at(1600)
    assert (bench.get(70), bench.get(64), bench.servo.error_flag) == (0x20, 0, 0x80)
    assert (bench.get(124, 2), bench.get(126, 2)) == (0, 0)
    bench.servo.jam(False)
    assert bench.put(64, 1, 1) == 0
    assert bench.get(64) == 0
    bench.servo.restart()
    assert not bench.at(1900)
    assert bench.at(2100)
    assert (bench.get(70), bench.put(64, 1, 1), bench.get(64)) == (0, 0, 1)


def test_a_load_below_the_threshold_or_broken_off_in_time_is_none():
    weak = stuck()
    weak.put(100, 2, 600)
    weak.at(20_000)
    brief = stuck()
    for k in range(1, 6):
        brief.at(k * 2000 - 200)
        brief.put(116, 4, 2048)
        brief.at(k * 2000)
        brief.put(116, 4, 4000)
    assert (weak.get(70), brief.get(70)) == (0, 0)


def test_a_held_load_warms_the_motor_towards_its_final_temperature():
    bench = stuck(overload_s=1e4, thermal_s=100.0, stall_rise_c=60.0, supply_ohm=0.0)
    bench.put(100, 2, 708)
    bench.at(100_000)
    # 80 % of the current are 64 % of the heat; 1 - 1/e of it after one time constant.
    assert bench.get(146) == pytest.approx(30 + 60 * 0.64 * 0.632, abs=1)
    bench.put(64, 1, 0)
    bench.at(1_000_000)
    assert bench.get(146) == 30


def test_overheating_latches_above_the_limit_register():
    bench = Bench()
    bench.put(64, 1, 1)
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
    bench.put(64, 1, 1)
    bench.servo.supply_v = volts
    bench.at(100)
    assert (bench.get(70), bench.get(64), bench.get(144, 2)) == (bits, 1 - bits, volts * 10)
    bench.servo.supply_v = 5.0
    bench.at(200)
    assert bench.get(70) == bits


def test_an_xc330_keeps_its_torque_and_tells():
    bench = Bench("xc330-m288")
    bench.put(64, 1, 1)
    bench.servo.supply_v = 3.3
    bench.at(100)
    assert (bench.get(70), bench.get(64), bench.servo.error_flag) == (1, 1, 0x80)


def test_too_little_voltage_restarts_the_servo_without_a_word():
    bench = Bench()
    bench.put(64, 1, 1)
    bench.put(112, 4, 99)
    bench.at(1000)
    bench.servo.supply_v = 2.0
    assert not bench.at(1050)
    bench.servo.supply_v = 5.0
    assert not bench.at(1400)
    assert bench.at(1500)
    assert (bench.get(64), bench.get(112, 4), bench.get(70)) == (0, 0, 0)
    assert bench.get(120, 2) < 500


def test_a_fault_is_injected_by_name():
    bench = Bench()
    bench.put(64, 1, 1)
    bench.servo.fail("encoder")
    assert (bench.get(70), bench.get(64)) == (0x08, 1)
    bench.servo.fail("electrical shock")
    assert (bench.get(70), bench.get(64)) == (0x18, 0)
    with pytest.raises(ValueError, match="'cold': expected input voltage, overheating"):
        bench.servo.fail("cold")


def test_temperature_and_overload_do_not_depend_on_how_often_one_looks():
    seldom, often = stuck(), stuck()
    seldom.at(1990)
    for ms in range(1, 1991):
        often.at(ms)
    assert seldom.servo.temperature_c == often.servo.temperature_c
    seldom.at(60_000)
    for ms in range(1990, 60_001, 13):
        often.at(ms)
    often.at(60_000)
    assert seldom.servo.temperature_c == often.servo.temperature_c
    assert seldom.servo.read(120, 27) == often.servo.read(120, 27)
