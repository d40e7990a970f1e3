"""One emulated servo alone: what may be written when, torque, live registers."""

import struct

import pytest
from present import present

from gazerig.sim_mock.dynamixel.servo import DynamixelServo
from gazerig.sim_mock.smart_servo.physics import Physics, Quirks, ServoSpec


class Bench:
    """A servo and its clock, which is set by hand."""

    def __init__(self, *spec):
        self.servo = DynamixelServo(ServoSpec(1, *spec), 0)
        self.now_s = 0.0

    def advance(self) -> None:
        self.servo.advance(round(self.now_s * 1000.0), 0)

    def write(self, address: int, size: int, value: int) -> int:
        """Write one register; give the error number."""
        self.advance()
        return self.servo.write(address, value.to_bytes(size, "little", signed=value < 0))

    def read(self, address: int, size: int, signed: bool = False) -> int:
        self.advance()
        return int.from_bytes(present(self.servo.read(address, size)), "little", signed=signed)

    def enable_torque(self, goal: int | None = None) -> None:
        assert self.write(64, 1, 1) == 0
        if goal is not None:
            assert self.write(116, 4, goal) == 0


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
    assert bench.write(address, size, value) == error
    assert bytes(bench.servo.memory.bytes) == before


def test_homing_offset_shifts_the_present_position():
    bench = Bench("xl330-m288", 700)
    bench.write(20, 4, 100)
    assert bench.read(132, 4) == 800
    bench.write(20, 4, -5000)
    assert bench.read(132, 4, signed=True) == 700 - 1024


def test_some_firmware_takes_the_present_position_as_goal_instead():
    bench = Bench("xl330-m288", 1000, 53, Physics(), Quirks(goal_at_torque_on=True))
    bench.servo.turn(200)
    bench.write(64, 1, 1)
    bench.now_s = 1.0
    assert (bench.read(116, 4), bench.read(132, 4)) == (1200, 1200)


def test_some_firmware_wraps_the_position_as_the_torque_comes_on():
    plain = Bench("xl330-m288", 100)
    wraps = Bench("xl330-m288", 100, 53, Physics(), Quirks(wrap_at_torque_on=True))
    for bench, at in ((plain, -100), (wraps, 3996)):
        bench.write(20, 4, -200)
        bench.write(64, 1, 1)
        assert bench.read(132, 4, signed=True) == at


def test_live_registers_tell_the_motion():
    bench = Bench("xl330-m077", 1000)
    bench.write(112, 4, 100)
    bench.enable_torque(2000)
    bench.now_s = 0.2
    assert bench.read(128, 4) == pytest.approx(100, abs=25)
    assert bench.read(136, 4) == 100
    assert bench.read(140, 4) > bench.read(132, 4) > 1200
    assert bench.read(122, 1) == 1
    assert bench.read(123, 1) == 0b010010
    assert bench.read(124, 2) > 0
    assert (bench.read(144, 2), bench.read(146, 1)) == (50, 30)
    assert bench.read(120, 2) == 200
    bench.now_s = 40.0
    assert bench.read(132, 4) == pytest.approx(2000, abs=12)
    assert (bench.read(122, 1), bench.read(123, 1)) == (0, 0b010001)
    assert bench.read(120, 2) == 40000 - 32768


def test_a_joint_that_cannot_follow_reports_a_following_error():
    bench = Bench("xl330-m077", 1000)
    bench.enable_torque(1900)
    bench.servo.jam()
    bench.now_s = 0.5
    assert bench.read(123, 1) == 0b001000


def test_a_servo_that_holds_still_flickers_by_its_seed_however_often_one_looks():
    def heard(seed, looks):
        bench = Bench("xl330-m077", 1000, 53, Physics(), Quirks(), seed)
        bench.enable_torque()
        out = []
        for k in range(200 * looks):
            bench.now_s = 1.0 + k / looks / 1000.0
            bench.advance()
            if k % looks == 0:
                out.append(struct.unpack("<hii", present(bench.servo.read(126, 10))))
        return out

    once = heard(1, 1)
    assert once == heard(1, 3) != heard(2, 1)
    assert {place for _, _, place in once} == {1000}
    assert {amps for amps, _, _ in once} == {-2, -1, 0, 1, 2}
    assert 3 >= max(abs(speed) for _, speed, _ in once) > 0
    # The everyday answer that must be stuffed: current -1, velocity -3.
    assert any((amps, speed) == (-1, -3) for amps, speed, _ in once + heard(3, 1) + heard(4, 1))


def test_reverse_mode_mirrors_position_velocity_current_and_pwm():
    bench = Bench("xl330-m077", 1000)
    bench.write(10, 1, 1)
    assert bench.read(132, 4) == 4096 - 1000
    bench.enable_torque(3500)
    bench.now_s = 0.04
    assert bench.read(132, 4) > 3100 and bench.servo.shaft.x < 1000
    assert bench.read(128, 4, signed=True) > 0
    assert bench.read(124, 2, signed=True) > 0
    bench.now_s = 2.0
    assert bench.read(132, 4) == pytest.approx(3500, abs=12)


def test_torque_on_by_goal_update_needs_its_bit_and_firmware():
    for firmware, bit, on in ((53, 8, 1), (53, 0, 0), (45, 8, 0)):
        bench = Bench("xl330-m288", 1000, firmware)
        bench.write(10, 1, bit)
        bench.write(116, 4, 1200)
        assert bench.read(64, 1) == on
        bench.now_s = 1.0
        assert bench.read(132, 4) == pytest.approx(1200 if on else 1000, abs=12)


def test_a_time_based_profile_needs_its_bit_and_firmware():
    for firmware, at in ((53, 1500), (41, 1000)):
        bench = Bench("xl330-m077", 1000, firmware)
        bench.write(10, 1, 4)
        bench.write(112, 4, 1000)
        bench.enable_torque(2000)
        bench.now_s = 0.5
        # 1000 register units of velocity have long arrived; of time they are at half.
        assert bench.read(140, 4) == (1500 if firmware == 53 else 2000), at


def test_startup_configuration_switches_the_torque_on_and_restores_the_ram():
    bench = Bench("xl330-m288", 1000)
    assert bench.write(84, 2, 999) == 0
    assert bench.servo.backup() == 0
    for configuration, torque, gain in ((0, 0, 400), (1, 1, 400), (2, 0, 999), (3, 1, 999)):
        bench.write(64, 1, 0)
        assert bench.write(60, 1, configuration) == 0
        bench.servo.restart()
        bench.now_s += 1.0
        assert (bench.read(64, 1), bench.read(84, 2)) == (torque, gain)
        assert bench.read(132, 4) == 1000


def test_backup_and_restore():
    bench = Bench("xl330-m288", 1000)
    assert (bench.read(147, 1), bench.servo.restore()) == (0, 1)
    bench.write(9, 1, 7)
    bench.write(84, 2, 777)
    assert (bench.servo.backup(), bench.read(147, 1)) == (0, 1)
    bench.write(9, 1, 0)
    bench.write(84, 2, 1)
    bench.enable_torque()
    assert (bench.servo.backup(), bench.servo.restore()) == (1, 1)
    bench.write(64, 1, 0)
    assert bench.servo.restore() == 0
    assert not bench.servo.advance(round(bench.now_s * 1000) + 399, 0)
    bench.now_s += 0.4
    assert (bench.read(9, 1), bench.read(84, 2), bench.read(147, 1)) == (7, 777, 1)
    old = Bench("xl330-m288", 1000, 45)
    assert (old.servo.backup(), old.servo.restore()) == (2, 2)


def test_factory_reset_puts_the_eeprom_back_and_spares_what_it_was_told():
    for option, servo_id, baud in ((0xFF, 1, 57600), (1, 5, 57600), (2, 5, 4_000_000)):
        bench = Bench("xl330-m288")
        for address, size, value in ((7, 1, 5), (8, 1, 6), (9, 1, 0), (20, 4, 300), (48, 4, 3000)):
            assert bench.write(address, size, value) == 0
        assert bench.servo.factory_reset(option) == 0
        bench.now_s = 0.5
        assert (bench.servo.id, bench.servo.baud) == (servo_id, baud)
        assert (bench.read(9, 1), bench.read(20, 4), bench.read(48, 4)) == (250, 0, 4095)
        assert bench.read(132, 4) == 2048
    bench.enable_torque()
    assert (bench.servo.factory_reset(3), bench.servo.factory_reset(1)) == (4, 7)


def test_a_reboot_restarts_tick_ram_and_turns_and_keeps_the_eeprom():
    bench = Bench("xl330-m288", 4000)
    bench.write(11, 1, 4)
    bench.write(9, 1, 3)
    bench.enable_torque(4500)
    bench.write(112, 4, 77)
    bench.now_s = 3.0
    assert bench.read(132, 4) > 4400
    bench.servo.restart()
    bench.now_s = 3.5
    assert bench.read(120, 2) == 500
    assert (bench.read(64, 1), bench.read(112, 4), bench.read(9, 1)) == (0, 0, 3)
    assert bench.read(132, 4) == pytest.approx(4500 - 4096, abs=12)
    assert bench.read(116, 4) == bench.read(132, 4)


def test_what_the_line_needs_to_know():
    bench = Bench("xm430-w350")
    servo = bench.servo
    assert (servo.baud, servo.return_delay_s, servo.shadow_id) == (57600, 0.0005, None)
    for address, value in ((8, 7), (9, 10), (12, 42)):
        bench.write(address, 1, value)
    assert (servo.baud, servo.shadow_id) == (4_500_000, 42)
    assert servo.return_delay_s == pytest.approx(2e-5)
    assert Bench("xl330-m077").write(8, 1, 7) == 4
