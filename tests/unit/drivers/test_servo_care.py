"""Torque and care of smart servos, seen from inside their registers.

What every kind of bus promises is in tests/buses; here is what only one make does, or what a user
does not see.
"""

import pytest
from fakes.dynamixels import Rig as DynamixelRig
from feedback_rows import rows
from moving_bus import IDS, NAMES
from present import present
from sts_rig import Rig as StsRig

from gazerig.drivers.errors import BusLost, ServoFault, ServoMissing
from gazerig.drivers.process.host_lateness import LATE_COMPUTER
from gazerig.drivers.servo_bus.torque import FAR_SIDE
from gazerig.drivers.types import ServoConfig
from gazerig.sim_mock.smart_servo.physics import ServoSpec


@pytest.fixture
def xl():
    return DynamixelRig().open()


@pytest.fixture
def sts():
    return StsRig().start()


# --- torque comes on


@pytest.mark.parametrize(
    ("spoil", "error", "told"),
    [
        (lambda chain: chain[3].overload(), ServoFault, "servo 3: overload: let it cool"),
        (lambda chain: chain[2].restart(), ServoMissing, "no answer from servo 2: check its cable"),
    ],
    ids=["latched", "silent"],
)
def test_such_a_servo_is_named_and_all_are_left_without_torque(xl, spoil, error, told):
    spoil(xl.chain)
    with pytest.raises(error, match=told):
        xl.bus.enable_torque()
    assert not any(servo.torque for servo in xl.chain.servos)


def test_no_torque_while_settings_cannot_be_read(xl):
    xl.port.spoil = lambda code, raw: b"" if xl.sent[-1][8] == 44 else raw
    with pytest.raises(ServoMissing, match="no answer from servo 1, servo 2, servo 3: check"):
        xl.bus.enable_torque()


@pytest.mark.parametrize("turn", [4096, -4096])
def test_a_position_that_wraps_as_the_torque_comes_on_is_found(xl, turn):
    servo = xl.chain[2]

    def wrap(code, raw):
        if servo.torque and 0 < servo.shaft.x < 4000:
            servo.shaft.x += turn
        return raw

    xl.port.spoil = wrap
    with pytest.raises(ServoFault, match=f"servo 2: position jumped from 2002 to {2002 + turn}"):
        xl.bus.enable_torque()
    assert not any(s.torque for s in xl.chain.servos)


def test_torque_does_not_come_on_before_the_goal_is_known_to_be_kept(xl):
    xl.chain[1].shaft.place(2400)
    real, refused = xl.chain[1].write, []

    def deaf_to_goals(address, data):
        if address == 116:
            refused.append(data)
            return 6
        return real(address, data)

    xl.chain[1].write = deaf_to_goals
    with pytest.raises(ServoMissing, match="servo 1 does not accept Goal Position 2400: restart"):
        xl.bus.enable_torque()
    assert len(refused) == 3 and xl.chain[1].shaft.x == 2400


def test_a_place_to_begin_from_must_be_read_again_before_torque():
    """Damaged bytes may pass a checksum of one byte: a goal from them would be a jump."""
    rig = StsRig()
    rig.bus.open()
    places, servo = iter([2000, 1000]), rig.chain[2]
    real = servo.read

    def read(address, length):
        error, data = real(address, length)
        if (address, length) == (56, 2):
            data = next(places, 2000).to_bytes(2, "little")
        return error, data

    servo.read = read
    with pytest.raises(ServoMissing, match="servo 2. does not rest: hold it still"):
        rig.bus.enable_torque()
    assert not any(servo.torque for servo in rig.chain.servos)


@pytest.mark.parametrize("place", [2000, 950])
def test_servos_whose_goal_goes_with_their_place_while_they_are_limp(place):
    rig = StsRig([ServoSpec(1, "sts3215", place)], [ServoConfig(1, "sts3215", 1000, 3000, 3000.0)])
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


def test_a_joint_outside_its_limits_gets_its_full_speed_when_it_is_inside():
    rig = DynamixelRig(starts=(900, 3170, 2003)).open()
    assert rig.bus.enable_torque() == (1000, 3000, 2003)
    for _ in range(300):
        outside = [r for r in rig.tick() if not 1000 <= r.position_steps <= 3000]
        assert all(abs(r.velocity_steps_s) <= 30 / 360 * 4096 + 64 for r in outside)
    assert rig.places() == pytest.approx([1000, 3000, 2003], abs=12)
    for _ in range(100):
        rig.tick([1100, 2900, 2000])
    assert [s.memory.get("profile_velocity") for s in rig.chain.servos] == [383] * 3


# --- torque goes


def test_a_servo_that_keeps_its_torque_is_named(xl):
    xl.bus.enable_torque()
    xl.chain[2].write = lambda address, data: 0
    xl.bus.disable_torque()
    assert [servo.torque for servo in xl.chain.servos] == [False, True, False]
    assert xl.errors()["refused"] == 1
    assert "servo 2: torque still on: cut the servo power" in xl.bus.events()


def test_release_and_close_before_open_do_nothing():
    rig = DynamixelRig()
    rig.bus.disable_torque()
    rig.bus.close()
    assert rig.sent == []


# --- silence of servos and of this computer


def test_a_bus_without_any_answer_is_given_up_in_the_end():
    rig = DynamixelRig(give_up_s=1.6).open()
    rig.bus.enable_torque()
    rig.bus.events()
    rig.port.spoil = lambda code, raw: b""
    start_s = rig.now_s
    with pytest.raises(BusLost, match="no servo has answered for 1.6 s"):
        for _ in range(1000):
            assert rig.tick() == (None, None, None)
    assert 1.6 <= rig.now_s - start_s <= 1.63
    assert rig.bus.events() == ("no servo has answered for 1.5 s: check servo power and cable",)


def test_a_stall_shown_by_a_write_is_healed_by_the_next_read_and_told(xl):
    xl.bus.enable_torque()
    xl.now_s += 1.0
    xl.bus.write([2500] * 3)
    # The planner of goals does not know it yet: no goal is sent before the next read.
    xl.bus.write([2500] * 3)
    xl.now_s += 0.1
    assert xl.chain.positions_steps() == pytest.approx([2001, 2002, 2003], abs=1)
    assert [r.rearmed for r in xl.tick([2500] * 3)] == [True] * 3
    assert [r.rearmed for r in xl.tick([2500] * 3)] == [False] * 3
    assert any("so the watchdog of 3 servos stopped them" in line for line in xl.bus.events())
    assert xl.errors() == {LATE_COMPUTER: 3}
    assert [s.memory.get("bus_watchdog") for s in xl.chain.servos] == [10] * 3


# --- faults, and servos that restart


@pytest.mark.parametrize("lost", ["torque", "limits"])
def test_a_restart_that_nobody_missed_is_found(sts, lost):
    """After it a goal may have switched the torque on again."""
    sts.bus.disable_torque()
    setups = [s._replace(strength=0.5, max_accel_steps_s2=20_000.0) for s in sts.setups]
    sts.bus.retune(setups)
    sts.bus.enable_torque()
    sts.run(0.2, [2000] * 4)
    if lost == "torque":
        sts.chain[3].write(40, b"\x00")
        sts.command("turn 3 200")
    sts.chain[3].memory.set("acceleration", 0)
    sts.chain[3].memory.set("torque_limit", 1000)
    seen = [row for row in (sts.tick([2000] * 4)[2] for _ in range(200)) if row is not None]
    (rearmed,) = [row for row in seen if row.rearmed]
    assert lost == "limits" or rearmed.position_steps == pytest.approx(2200, abs=8)
    assert (sts.get(3, 40), sts.get(3, 41), sts.get(3, 48, 2)) == (1, 200, 500)


def test_one_that_was_silent_gets_no_goals_until_it_holds_its_place_again(sts):
    sts.run(0.5, [2000] * 4)
    sts.command("lose 2")
    sts.run(0.2, [2000] * 4)
    sts.sent.clear()
    sts.run(0.3, [2600] * 4)
    goals = [p for p in sts.sent if p[4] == 0x83 and p[5] == 42]
    assert goals and all(list(p[7:-1:7]) == [1, 3, 4] for p in goals)
    sts.command("clear")
    seen = [row for row in (sts.tick([2600] * 4)[1] for _ in range(120)) if row is not None]
    assert [row.rearmed for row in seen].count(True) == 1 and seen[0].rearmed
    assert sts.chain.positions_steps()[1] == pytest.approx(2600, abs=8)


def test_eeprom_that_differs_is_corrected_under_way_without_torque(xl):
    xl.bus.enable_torque()
    xl.tick([2000] * 3)
    xl.chain[2].memory.set("max_position_limit", 2500)
    xl.chain.faults.command("lose 2 for 0.2")
    for _ in range(150):
        xl.tick([2000] * 3)
    assert xl.chain[2].memory.get("max_position_limit") == 3000
    assert xl.chain[2].torque and xl.bus.faults() == ()


def test_one_that_is_too_hot_keeps_no_other_without_torque_after_a_replug(sts):
    sts.run(0.5, [2000] * 4)
    sts.command("temperature 2 90")
    sts.command("unplug for 0.1")
    sts.run(0.3, [2000] * 4)
    for servo_id in IDS:
        sts.chain.find_servo(servo_id).write(40, b"\x00")
    sts.run(2.0, [2100] * 4)
    assert [servo.torque for servo in sts.chain.servos] == [True, False, True, True]
    # Some firmware switches torque on with a goal.
    assert [list(p[7:-1:7]) for p in sts.sent if p[4:6] == b"\x83\x2a"][-1] == [1, 3, 4]
    assert sts.bus.faults() == ("jaw (servo 2): overheating",)
    sts.command("temperature 2 40")
    sts.run(2.0, [2100] * 4)
    assert all(servo.torque for servo in sts.chain.servos) and sts.bus.faults() == ()


def test_a_joint_that_was_turned_past_zero_returns_the_short_way():
    """A servo counts on beyond its turn: -100 is left of zero, and no step of the turn."""
    setups = [ServoConfig(1, "sts3215", 100, 1500, 3000.0, "eye")]
    rig = StsRig([ServoSpec(1, "sts3215", 200)], setups)
    rig.bus.open()
    rig.command("turn 1 -300")
    assert rig.bus.read(rig.now_s).position_steps == (-100,)
    assert rig.bus.enable_torque() == (100,)
    steps = []
    for _ in range(100):
        rig.now_s += 0.01
        steps.append(rig.bus.read(rig.now_s).position_steps[0])
        rig.bus.write([500])
    assert min(steps) >= -101 and steps[-1] >= 94
    assert steps[20] < 0  # slowly
    assert rig.bus.faults() == ()


def test_a_joint_beyond_its_encoders_zero_is_not_led_the_wrong_way():
    specs = [ServoSpec(1, "sts3215", 4090), ServoSpec(2, "sts3215", 700)]
    setups = [ServoConfig(i, "sts3215", 100, 1500, 3000.0, NAMES[i - 1]) for i in (1, 2)]
    rig = StsRig(specs, setups)
    rig.bus.open()
    # It counts on from where it started; only a restart makes it measure within one turn.
    for place in (4090, 4290):
        with pytest.raises(ServoFault, match=rf"eye \(servo 1\) is at {place}, beyond .*by hand"):
            rig.bus.enable_torque()
        rig.command("turn 1 200")
    assert not any(servo.torque for servo in rig.chain.servos)
    rig.command("turn 1 -200")
    rig.command("brown-out 1")
    rig.now_s += 2.0
    assert rig.bus.enable_torque() == (194, 700)

    def run(ticks):
        for _ in range(ticks):
            rig.now_s += 0.01
            readings = rows(rig.bus.read(rig.now_s))
            rig.bus.write([500, 500])
        return readings

    run(20)
    rig.command("turn 1 -700")
    rig.command("brown-out 1")
    run(200)
    assert len(rig.bus.faults()) == 1 and FAR_SIDE in rig.bus.faults()[0]
    assert [servo.torque for servo in rig.chain.servos] == [False, True]
    assert sum(", beyond" in line for line in rig.bus.events()) == 1
    rig.command("turn 1 600")
    rig.command("brown-out 1")
    assert present(run(200)[0]).torque
    assert rig.bus.faults() == ()
    assert [servo.torque for servo in rig.chain.servos] == [True, True]
