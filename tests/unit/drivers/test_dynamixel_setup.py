"""Finding and preparing servos: checks, writes, repeated queries and refusals."""

import pytest
from fakes.dynamixels import Rig

from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.errors import ServoMissing
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.drivers.types import ServoConfig


@pytest.fixture
def rig():
    return Rig()


def test_open_writes_what_differs_and_says_so(rig):
    servo = rig.chain[2]
    for name, value in (("operating_mode", 4), ("drive_mode", 4), ("max_position_limit", 2500)):
        servo.memory.set(name, value)
    servo.status_level = 1
    servo.write(64, b"\x01")
    rig.open()
    get = servo.memory.get
    assert (get("torque_enable"), servo.torque) == (0, False)
    assert (get("operating_mode"), get("drive_mode"), get("return_delay_time")) == (3, 0, 0)
    assert (get("min_position_limit"), get("max_position_limit")) == (1000, 3000)
    assert (get("profile_acceleration"), get("profile_velocity")) == (0, 383)
    assert (get("status_return_level"), get("bus_watchdog")) == (2, 0)
    events = rig.bus.events()
    assert "servo 2: Max Position Limit 2500 -> 3000" in events
    assert "servo 2: Return Delay Time 250 -> 0" in events


def test_one_message_names_missing_and_wrong_servos_by_joint(rig):
    setups = [
        ServoConfig(1, "xl430-w250", 1000, 3000, 6000.0, "neck_yaw"),
        ServoConfig(2, "xl330-m077", 1000, 3000, 6000.0, "eye_left"),
        ServoConfig(9, "xl330-m077", 1000, 3000, 6000.0, "jaw"),
    ]
    with pytest.raises(ServoMissing) as caught:
        SmartServoBus(DYNAMIXEL, rig.port, setups).open()
    message = str(caught.value)
    assert "neck_yaw (servo 1) is xl330-m077, not xl430-w250" in message
    assert "jaw (servo 9) does not answer" in message


def test_gains_strength_and_velocity_limit_are_set_where_they_differ_and_told(rig):
    servo = rig.chain[2]
    servo.memory.set("velocity_limit", 100)
    setup = ServoConfig(2, "xl330-m077", 1000, 3000, 6000.0, "jaw", (700, 10, 30), 0.4)
    bus = SmartServoBus(DYNAMIXEL, rig.port, [setup])
    bus.open()
    get = servo.memory.get
    names = ("position_p_gain", "position_i_gain", "position_d_gain")
    assert [get(name) for name in names] == [700, 10, 30]
    assert (get("pwm_limit"), get("velocity_limit")) == (354, 383)
    events = bus.events()
    assert "jaw (servo 2): PWM Limit 885 -> 354" in events
    assert "jaw (servo 2): Velocity Limit 100 -> 383" in events
    assert "jaw (servo 2): Position P Gain 400 -> 700" in events
    bus.open()
    assert not any("->" in line for line in bus.events())
