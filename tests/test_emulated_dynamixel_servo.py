"""One emulated Dynamixel servo alone: registers, torque, protections."""

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

    def __init__(self, model="xl330-m077", start=2048, seed=0, **physics):
        spec = ServoSpec(1, model, start, 53, Physics(**physics), Quirks(), seed)
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
        bench = Bench("xl330-m077", 1000, seed)
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
        bench = Bench(load_nm=0.02)
        assert (bench.put(11, mode), bench.put(10, drive)) == (0, 0)
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


@pytest.mark.parametrize(("volts", "bits"), [(3.3, 1), (3.5, 0), (7.2, 1)])
def test_an_xl330_loses_its_torque_outside_its_voltage_limits(volts, bits):
    bench = Bench()
    bench.put(64, 1)
    bench.servo.supply_v = volts
    bench.at(100)
    assert (bench.get(70), bench.get(64), bench.get(144)) == (bits, 1 - bits, volts * 10)
    bench.servo.supply_v = 5.0
    bench.at(200)
    assert bench.get(70) == bits
