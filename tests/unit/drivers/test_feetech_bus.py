"""What a bus of STS servos writes: speed, acceleration, strength, gains, EEPROM and its lock."""

import pytest
from moving_bus import IDS
from sts_rig import Rig

from gazerig.drivers.feetech.family import FEETECH
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.drivers.types import ServoConfig
from gazerig.sim_mock.smart_servo.physics import ServoSpec


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


def test_ranges_and_numbers_that_cannot_be_are_refused():
    rig = Rig()
    for low, high in ((-1, 5), (0, 4096), (9, 8)):
        wrong = [s._replace(min_steps=low, max_steps=high) for s in rig.setups]
        with pytest.raises(ValueError, match=r"eye \(servo 1\): .* is not a range within 0..4095"):
            SmartServoBus(FEETECH, rig.port, wrong)
    crowd = [ServoConfig(i, "sts3215", 0, 4095, 3000.0) for i in range(36)]
    with pytest.raises(ValueError, match="36 servos are too many for one bus: 35 at most"):
        SmartServoBus(FEETECH, rig.port, crowd)
