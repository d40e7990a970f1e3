"""The STS bus over both twins: in-process port and pseudo-terminal."""

import pytest
from moving_bus import IDS
from sts_rig import Rig

from gazerig.drivers.feetech.family import FEETECH
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.drivers.types import ServoConfig
from gazerig.sim_mock.smart_servo.physics import ServoSpec


def places(readings):
    return [None if r is None else r.position_steps for r in readings]


def test_a_second_open_writes_nothing_to_the_servos():
    rig = Rig()
    rig.bus.open()
    rig.bus.close()
    rig.bus.events()
    rig.sent.clear()
    rig.bus.open()
    assert rig.bus.events() == ()
    # But for the order to answer, which is not kept: status level to all, lock closed.
    written = [(p[4], p[5]) for p in rig.sent if p[4] in (0x03, 0x04, 0x83)]
    assert written == [(0x83, 8)]


def test_a_joint_outside_its_limits_comes_in_slowly():
    specs = [ServoSpec(1, "sts3215", 900), ServoSpec(2, "sts3215", 3170)]
    setups = [ServoConfig(i, "sts3215", 1000, 3000, 3000.0) for i in (1, 2)]
    rig = Rig(specs, setups)
    rig.bus.open()
    assert rig.bus.enable_torque() == (1000, 3000)
    for _ in range(100):
        readings = rig.tick([1500, 2500])
        outside = [r for r in readings if not 1000 <= r.position_steps <= 3000]
        assert all(abs(r.velocity_steps_s) <= 30 / 360 * 4096 + 64 for r in outside)
    rig.run(0.5, [1500, 2500])
    assert rig.get(1, 46, 2) == rig.get(2, 46, 2) == 3000
    assert places(rig.tick([1500, 2500])) == pytest.approx([1500, 2500], abs=8)


def test_speed_and_acceleration_are_armed_before_the_torque():
    setups = [ServoConfig(1, "sts3215", 1000, 3000, 700.0, max_accel_steps_s2=5000.0)]
    rig = Rig([ServoSpec(1, "sts3215", 2000)], setups)
    rig.bus.open()
    rig.sent.clear()
    rig.bus.enable_torque()
    writes = [(p[5], p[8:-1]) for p in rig.sent if p[4] == 0x83]
    names = [address for address, _ in writes]
    assert names.index(41) < names.index(42) < names.index(40)
    assert dict(writes)[41] == bytes((50,))
    assert dict(writes)[42][4:] == (700).to_bytes(2, "little")
    speeds = [abs(rig.tick([3000])[0].velocity_steps_s) for _ in range(60)]
    assert 600 < max(speeds) < 760
    assert speeds[1] < 200


def test_strength_and_gains_reach_the_servo_and_outlive_a_restart():
    setup = ServoConfig(1, "sts3215", 1000, 3000, 3000.0, gains=(20, 1, 16), strength=0.4)
    rig = Rig([ServoSpec(1, "sts3215", 2000)], [setup])
    rig.bus.open()
    rig.bus.enable_torque()
    assert [rig.get(1, at) for at in (21, 22, 23)] == [20, 16, 1]
    assert rig.get(1, 48, 2) == 400
    rig.command("brown-out 1")
    rig.run(1.2, [2000])
    rig.until_all()
    assert [rig.get(1, at) for at in (21, 22, 23)] == [20, 16, 1]
    assert (rig.get(1, 48, 2), rig.get(1, 55)) == (400, 1)


def test_what_the_eeprom_must_be_is_kept_and_the_lock_closed():
    rig = Rig()
    for servo in rig.chain.servos:
        servo.memory.set_permanently("phase", 12 | 0x10)
        servo.memory.set_permanently("operating_mode", 1)
        servo.memory.power_up()
    rig.bus.open()
    for servo in rig.chain.servos:
        servo.restart()
    rig.now_s += 1.0
    for i in IDS:
        assert (rig.get(i, 9, 2), rig.get(i, 11, 2)) == (1000, 3000)
        assert (rig.get(i, 7), rig.get(i, 18), rig.get(i, 33), rig.get(i, 55)) == (0, 12, 0, 1)


def test_retune_waits_for_the_next_engage():
    rig = Rig().start()
    narrow = [s._replace(min_steps=1900, max_steps=2100) for s in rig.setups]
    rig.bus.retune(narrow)
    rig.run(0.6, [2600] * 4)
    assert rig.chain.positions_steps() == pytest.approx([2600] * 4, abs=8)
    rig.bus.disable_torque()
    assert rig.bus.enable_torque() == (2100,) * 4
    assert rig.get(1, 11, 2) == 2100
    with pytest.raises(ValueError, match="ids and models must not change"):
        rig.bus.retune(narrow[:2])


def test_ranges_and_numbers_that_cannot_be_are_refused():
    rig = Rig()
    for low, high in ((-1, 5), (0, 4096), (9, 8)):
        wrong = [s._replace(min_steps=low, max_steps=high) for s in rig.setups]
        with pytest.raises(ValueError, match=r"eye \(servo 1\): .* is not a range within 0..4095"):
            SmartServoBus(FEETECH, rig.port, wrong)
        with pytest.raises(ValueError, match="is not a range within"):
            rig.bus.retune(wrong)
    crowd = [ServoConfig(i, "sts3215", 0, 4095, 3000.0) for i in range(36)]
    with pytest.raises(ValueError, match="36 servos are too many for one bus: 35 at most"):
        SmartServoBus(FEETECH, rig.port, crowd)


def test_with_the_bytes_time_on_the_wire_a_tick_fits_into_ten_milliseconds():
    specs = [ServoSpec(i, "sts3215", 2000) for i in range(1, 9)]
    setups = [ServoConfig(i, "sts3215", 1000, 3000, 3000.0) for i in range(1, 9)]
    rig = Rig(specs, setups, wire_time=True).start()
    for _ in range(30):
        assert None not in rig.tick([2000] * 8)
    # 8 answers of 21 bytes, now and then of 37, at 1 Mbit/s.
    assert rig.longest_s < 0.0045
    assert rig.bus.health().errors == {}
