"""Injected faults of STS servos only; those of all smart servos are in test_servo_faults."""

import pytest
from copied import copied
from feedback_rows import rows
from moving_bus import IDS, NAMES
from present import present
from sts_rig import Rig

from gazerig.drivers.errors import ServoFault, ServoMissing
from gazerig.drivers.servo_bus.supervisor import FAR_SIDE
from gazerig.drivers.types import ServoConfig
from gazerig.sim_mock.smart_servo.physics import ServoSpec


@pytest.fixture(scope="module")
def started():
    return Rig().start()


@pytest.fixture
def rig(started):
    return copied(started)


def test_one_that_was_silent_gets_no_goals_until_it_holds_its_place_again(rig):
    rig.run(0.5, [2000] * 4)
    rig.command("lose 2")
    rig.run(0.2, [2000] * 4)
    rig.sent.clear()
    rig.run(0.3, [2600] * 4)
    goals = [p for p in rig.sent if p[4] == 0x83 and p[5] == 42]
    assert goals and all(list(p[7:-1:7]) == [1, 3, 4] for p in goals)
    rig.command("clear")
    seen = [rig.tick([2600] * 4)[1] for _ in range(120)]
    assert [r.rearmed for r in seen if r is not None].count(True) == 1
    assert next(r for r in seen if r is not None).rearmed
    assert rig.chain.positions_steps()[1] == pytest.approx(2600, abs=8)


def test_a_restart_in_the_wink_of_an_eye_is_found(rig):
    """One that nobody missed, after which a goal has switched the torque on again."""
    rig.bus.disable_torque()
    setups = [s._replace(strength=0.5, max_accel_steps_s2=20_000.0) for s in rig.setups]
    rig.bus.retune(setups)
    rig.bus.enable_torque()
    rig.run(0.2, [2000] * 4)
    assert (rig.get(3, 41), rig.get(3, 48, 2)) == (200, 500)
    memory = rig.chain[3].memory
    memory.set("acceleration", 0)
    memory.set("torque_limit", 1000)
    readings = rig.run(0.2, [2000] * 4)
    assert (rig.get(3, 41), rig.get(3, 48, 2)) == (200, 500)
    assert None not in readings


def test_lost_torque_is_found_and_brought_back_at_the_present_place(rig):
    rig.run(0.5, [2000] * 4)
    rig.chain[2].write(40, b"\x00")
    rig.command("turn 2 200")
    seen = [rig.tick([2000] * 4)[1] for _ in range(30)]
    rearmed = [r for r in seen if r is not None and r.rearmed]
    assert len(rearmed) == 1
    assert rearmed[0].position_steps == pytest.approx(2200, abs=8)
    assert rig.get(2, 40) == 1


def test_overload_is_named_and_goes(rig):
    rig.run(0.5, [2000] * 4)
    rig.command("overload 2")
    # Once could be noise.
    assert rig.tick([2000] * 4)[1].fault == ""
    readings = rig.tick([2000] * 4)
    assert None not in readings
    assert [r.fault for r in readings] == ["", "overload", "", ""]
    assert rig.bus.faults() == ("jaw (servo 2): overload",)
    assert rig.bus.events() == ("jaw (servo 2): overload",)
    # Another goal ends it.
    readings = rig.run(1.5, [2100] * 4)
    assert rig.bus.faults() == ()
    assert readings[1].fault == ""
    assert rig.bus.events() == ("jaw (servo 2): the fault is gone",)


def test_one_that_is_too_hot_keeps_no_other_without_torque_after_a_replug(rig):
    rig.run(0.5, [2000] * 4)
    rig.command("overheat 2")
    rig.command("unplug for 0.1")
    rig.run(0.3, [2000] * 4)
    for servo_id in IDS:
        rig.chain.find_servo(servo_id).write(40, b"\x00")
    rig.run(2.0, [2100] * 4)
    assert [servo.torque for servo in rig.chain.servos] == [True, False, True, True]
    assert rig.bus.faults() == ("jaw (servo 2): overheating",)
    rig.command("temperature 2 40")
    rig.run(2.0, [2100] * 4)
    assert all(servo.torque for servo in rig.chain.servos) and rig.bus.faults() == ()


@pytest.mark.parametrize("goal", ["wait", "torque-on"])
@pytest.mark.parametrize("torque_on", ["old-goal", "present"])
def test_whatever_goal_and_torque_do_nothing_leaps(goal, torque_on):
    rig = Rig()
    rig.command(f"set goal {goal}")
    rig.command(f"set torque-on {torque_on}")
    rig.bus.open()
    for servo in rig.chain.servos:
        servo.memory.set("goal_position", 3000)
    assert rig.bus.enable_torque() == (2000,) * 4
    for _ in range(20):
        rig.tick([2000] * 4)
        assert rig.chain.positions_steps() == pytest.approx([2000] * 4, abs=3)
    rig.command("brown-out 3")
    for _ in range(150):
        rig.tick([2000] * 4)
        assert rig.chain.positions_steps() == pytest.approx([2000] * 4, abs=3)
    rig.until_all()
    rig.bus.disable_torque()
    rig.run(0.2, [2500] * 4)
    assert not any(servo.torque for servo in rig.chain.servos)


@pytest.mark.parametrize("place", [2000, 950])
def test_servos_whose_goal_goes_with_their_place_while_they_are_limp(place):
    rig = Rig([ServoSpec(1, "sts3215", place)], [ServoConfig(1, "sts3215", 1000, 3000, 3000.0)])
    servo = rig.chain[1]
    real = servo.read

    def read(address, length):
        if not servo.torque:
            servo.memory.set("goal_position", round(servo.position_steps))
        return real(address, length)

    servo.read = read
    rig.bus.open()
    assert rig.bus.enable_torque() == (max(1000, place),)
    assert rig.get(1, 42, 2) == max(1000, place)
    for _ in range(30):
        (reading,) = rig.tick([max(1000, place)])
        assert abs(reading.velocity_steps_s) < 420


def far_rig():
    specs = [ServoSpec(1, "sts3215", 4090), ServoSpec(2, "sts3215", 700)]
    setups = [ServoConfig(i, "sts3215", 100, 1500, 3000.0, NAMES[i - 1]) for i in (1, 2)]
    return Rig(specs, setups)


def test_a_joint_beyond_its_encoders_zero_is_told_so_and_not_led_the_wrong_way():
    rig = far_rig()
    rig.bus.open()
    rig.now_s += 0.01
    assert present(rows(rig.bus.read(rig.now_s))[0]).position_steps == 4090 - 4096
    with pytest.raises(ServoFault, match=r"eye \(servo 1\) is at 4090, beyond .*by hand"):
        rig.bus.enable_torque()
    assert not any(servo.torque for servo in rig.chain.servos)
    rig.command("turn 1 100")
    assert rig.bus.enable_torque() == (100, 700)


def test_a_joint_that_restarts_beyond_zero_stays_limp_until_it_is_turned_back():
    rig = far_rig()
    rig.bus.open()
    rig.command("turn 1 200")
    rig.bus.enable_torque()
    for _ in range(20):
        rig.bus.read(rig.now_s)
        rig.now_s += 0.01
    rig.command("brown-out 1")
    rig.command("turn 1 -250")
    faults = []
    for _ in range(150):
        rig.now_s += 0.01
        rig.bus.read(rig.now_s)
        rig.bus.write([500, 500])
        faults.append(rig.bus.faults())
    assert faults[-1] == (f"eye (servo 1): {FAR_SIDE}",)
    assert [servo.torque for servo in rig.chain.servos] == [False, True]
    assert sum("is beyond" in line for line in rig.bus.events()) == 1
    rig.command("turn 1 300")
    for _ in range(60):
        rig.now_s += 0.01
        rig.bus.read(rig.now_s)
        rig.bus.write([500, 500])
    assert rig.bus.faults() == ()
    assert [servo.torque for servo in rig.chain.servos] == [True, True]


def test_a_place_to_begin_from_must_be_read_again_before_torque():
    """Damaged bytes may pass a checksum of one byte: a goal from them would be a jump."""
    rig = Rig()
    rig.bus.open()
    places = iter([2000, 1000])
    servo = rig.chain[2]
    real = servo.read

    def read(address, length):
        data = real(address, length)
        if (address, length) == (56, 2) and data is not None:
            data = next(places, 2000).to_bytes(2, "little")
        return data

    servo.read = read
    with pytest.raises(ServoMissing, match="servo 2. does not rest: hold it still"):
        rig.bus.enable_torque()
    assert not any(servo.torque for servo in rig.chain.servos)
