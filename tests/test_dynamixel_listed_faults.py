"""Every listed fault of a servo bus, injected, and what the driver makes of it.

What must be true of each: a read takes a bounded time; no value is delivered that was not
true in its cycle; one bad servo does not blind the others; an alert is data and a named
fault; a restarted servo is set up again and holds where it is.

Faults on the wire and in servos, by number, and their tests, here or in test_servo_faults:

 1 byte lost             test_a_passing_fault_costs_little_and_passes
 2 bit flipped           test_a_passing_fault_costs_little_and_passes
 3 bad CRC               test_a_passing_fault_costs_little_and_passes
 4 truncated             test_a_passing_fault_costs_little_and_passes
 5 duplicate             test_answers_that_come_twice
 6 late                  test_all_late_is_never_taken_for_fresh
 7 wrong id              test_a_passing_fault_costs_little_and_passes
 8 noise                 test_what_is_harmless
 9 loose headers         test_what_is_harmless
10 echo                  test_what_is_harmless
11 refused, no data      test_a_passing_fault_costs_little_and_passes
12 too short or long     test_a_passing_fault_costs_little_and_passes
13 out of order          test_answers_out_of_order
14 id missing            test_silent_servos_cost_only_themselves
15 stuffed answer        test_dynamixel_faults
16 EIO                   test_a_port_that_fails_is_opened_again
17 path gone and back    test_17_replugged_under_the_same_name
18 no permission         test_opening_is_forbidden
19 wrong baud            test_wrong_baud_rate
20 id collision          test_20_two_servos_with_one_id
21 brown-out             test_21_brown_out
22 overload              test_22_to_26_latched_errors
23 overheating           test_22_to_26_latched_errors
24 input voltage         test_24_input_voltage
25 stuck joint           test_25_stuck_joint
26 encoder               test_22_to_26_latched_errors
27 bus watchdog          test_27_watchdog_trip
28 stall mid-packet      test_a_passing_fault_costs_little_and_passes
29 babbling node         test_a_babbling_node
30 factory defaults      test_30_factory_defaults
31 group write lost      test_lost_writes
32 write blocked         test_a_blocked_write

Single reads are in test_servo_registers. Of the maker's SDK's group
reads: silent, corrupt, lost byte, refused, alert, late and truncated are numbers 1 to 14
and 22 here; a broadcast ping with noise or a bad CRC is test_ping_among_noise; fast bulk
reads, which it takes apart wrongly, are never sent.
"""

import json

import pytest
from copied import copied
from dynamixel_rig import WAYS, Rig
from moving_bus import (
    IDS,
    LONGEST_S,
)
from present import present

from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.dynamixel.params import DynamixelParams
from gazerig.drivers.errors import ServoMissing
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.drivers.servo_bus.faults import AGAIN_AND_AGAIN
from gazerig.drivers.servo_bus.transaction import RESERVE_S
from gazerig.drivers.types import ServoConfig
from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.smart_servo.physics import ServoSpec
from gazerig.testing.bus_bench import rows


@pytest.fixture(scope="module")
def started():
    return {way: Rig(*chosen).start() for way, chosen in WAYS.items()}


@pytest.fixture(params=WAYS)
def rig(request, started):
    return copied(started[request.param])


def test_17_replugged_under_the_same_name(rig):
    rig.tick([2500] * 4)
    rig.command("unplug for 3.0")
    for _ in range(250):
        assert rig.heard() == [False] * 4
    while None in (readings := rig.tick([2500] * 4)):
        pass
    assert [(r.rearmed, r.torque) for r in readings] == [(True, True)] * 4
    assert [r.rearmed for r in rig.tick([2500] * 4)] == [False] * 4


def test_17_no_goal_is_followed_before_positions_are_read_again(rig):
    rig.command("unplug for 0.5")
    rig.tick()
    for servo_id in IDS:
        rig.command(f"turn {servo_id} 150")
    rig.now_s += 0.6
    rig.sent.clear()
    readings = rows(rig.bus.read(rig.now_s))
    places = [present(r).position_steps for r in readings]
    goals = [p for p in rig.sent if p[7] == 0x83 and int.from_bytes(p[8:10], "little") == 116]
    named = [int.from_bytes(goals[0][13 + 5 * k : 17 + 5 * k], "little") for k in range(4)]
    assert all(abs(goal - at) <= 2 for goal, at in zip(named, places, strict=True))


def test_17_servo_power_cut_and_back(rig):
    rig.command("lose all for 3.0")
    for _ in range(180):
        assert rig.heard() == [False] * 4
    for servo_id in IDS:
        rig.chain[servo_id].restart()
    assert "no servo answers: check servo power and cable" in rig.bus.events()
    rig.until_all()
    assert rig.errors()["restarted"] >= 4
    assert [s.memory.get("profile_velocity") for s in rig.chain.servos] == [383] * 4


def test_20_two_servos_with_one_id(rig):
    rig.command("turn 2 300")
    rig.command("collide 2")
    rig.command("turn 2 -111")
    for _ in range(200):
        heard = [r is not None for r in _tick_blind(rig)]
        assert heard[0] and heard[2] and heard[3]
    assert rig.longest_s < LONGEST_S
    assert any(line.startswith("jaw (servo 2) answers, but") for line in rig.bus.events())


def _tick_blind(rig):
    """Run a cycle in which servo 2's own value cannot be judged: there are two of it."""
    rig.now_s += 0.01
    began_s = rig.now_s
    readings = rows(rig.bus.read(rig.now_s))
    rig.longest_s = max(rig.longest_s, rig.now_s - began_s)
    rig.bus.write([2000] * len(IDS))
    return readings


def test_21_brown_out(rig):
    rig.tick([2300] * 4)
    rig.command("brown-out 3")
    cycles = rig.until_all()
    assert cycles * 0.01 <= 1.5
    assert rig.bus.faults() == ()
    lines = rig.bus.events()
    assert "neck (servo 3) restarted: set up again" in lines
    get = rig.chain[3].memory.get
    assert (get("profile_velocity"), get("bus_watchdog"), get("torque_enable")) == (383, 10, 1)


def test_21_brown_out_in_the_middle_of_a_long_way_ends_where_it_is(rig):
    for _ in range(3):
        rig.tick([2900] * 4)
    rig.command("brown-out 3")
    seen = []
    for _ in range(120):
        rig.now_s += 0.01
        at = rig.chain.positions_steps()[2]
        reading = rows(rig.bus.read(rig.now_s))[2]
        if reading is not None and reading.rearmed:
            assert abs(reading.position_steps - at) <= 2
            assert abs(rig.chain[3].memory.get("goal_position") - at) <= 2
            seen.append(at)
        rig.bus.write([2900] * 4)
    assert len(seen) == 1


def test_21_a_servo_that_keeps_restarting_stays_limp(rig):
    for _ in range(5):
        rig.command("brown-out 2")
        for _ in range(150):
            rig.tick()
    assert rig.bus.faults() == (f"jaw (servo 2): {AGAIN_AND_AGAIN}",)
    reading = rig.tick()[1]
    assert (reading.torque, reading.fault) == (False, AGAIN_AND_AGAIN)
    assert not rig.chain[2].torque
    assert rig.chain[1].torque


@pytest.mark.parametrize(
    ("fault", "name"),
    [("overload", "overload"), ("overheat", "overheating"), ("encoder", "encoder"),
     ("shock", "electrical shock")],
)  # fmt: skip
def test_22_to_26_latched_errors(rig, fault, name):
    # Here every error takes the torque away.
    rig.bus.disable_torque()
    rig.chain[2].memory.set("shutdown", 0x3F)
    rig.bus.enable_torque()
    rig.bus.events()
    rig.command(f"{fault} 2")
    readings = rig.tick()
    assert None not in readings
    assert readings[1].fault == name
    for _ in range(40):
        readings = rig.tick()
    assert rig.bus.faults() == (f"jaw (servo 2): {name}",)
    assert (readings[1].torque, readings[1].fault) == (False, name)
    assert [r.fault for r in readings] == ["", name, "", ""]
    assert rig.bus.events() == (f"jaw (servo 2): {name}",)
    assert not rig.chain[2].torque
    # Only a restart clears it; then the servo is set up again.
    rig.chain[2].restart()
    rig.until_all()
    assert rig.bus.faults() == ()
    assert rig.tick()[1].fault == ""


def test_24_input_voltage(rig):
    for servo_id in IDS:
        rig.command(f"voltage {servo_id} 7.6")
    for _ in range(100):
        readings = rig.tick()
    assert len(rig.bus.faults()) == 4
    assert [(r.fault, r.torque) for r in readings] == [("input voltage", False)] * 4
    assert all(abs(r.voltage_v - 7.6) < 0.2 for r in readings)


def test_25_stuck_joint(rig):
    rig.command("stick 2")
    at = rig.chain.positions_steps()[1]
    for _ in range(30):
        readings = rig.tick([2600] * 4)
    assert abs(readings[1].position_steps - at) <= 1
    assert abs(readings[1].load) > 0.3
    for _ in range(600):
        readings = rig.tick([2600] * 4)
    assert readings[1].fault == "overload"
    assert None not in readings


def test_27_watchdog_trip(rig):
    rig.tick([2900] * 4)
    rig.now_s += 1.0
    assert [s.memory.get("torque_enable") for s in rig.chain.servos] == [1] * 4
    rig.tick([2900] * 4)
    readings = rig.tick([2900] * 4)
    assert [r.rearmed for r in readings] == [True] * 4
    assert rig.errors()["late computer"] == 4
    assert [s.memory.get("bus_watchdog") for s in rig.chain.servos] == [10] * 4


def test_27_a_watchdog_that_tripped_unnoticed_is_found_where_servos_were_read_without_torque():
    rig = Rig()
    rig.bus.open()
    for _ in range(3):
        rig.tick()
    rig.bus.enable_torque()
    rig.until_all()
    # As where packets get lost on the way to one servo, and the host has sent them in time.
    rig.chain[2].memory.set("bus_watchdog", 255)
    for _ in range(600):
        rig.tick([2000] * 4)
    assert rig.errors().get("watchdog") == 1
    assert any("watchdog of 1 servo stopped them" in line for line in rig.bus.events())


def test_30_factory_defaults():
    rig = Rig(check_baud=True)
    for servo in rig.chain.servos:
        servo.memory.set("baud_rate", 3)
    rig.chain.refresh()
    rig.start()
    rig.bus.disable_torque()
    rig.command("reset 3")
    rig.now_s += 1.0
    with pytest.raises(ServoMissing, match="neck .servo 3. does not answer"):
        rig.bus.open()


def test_ping_among_noise():
    rig = Rig()
    rig.command("noise after FFFFFD count 1")
    rig.command("corrupt 3 60 count 1")
    rig.bus.open()
    assert len(json.loads(rig.chain.faults.status())["servos"]) == len(IDS)


@pytest.mark.parametrize("fast", [True, False])
def test_14_one_silent_servo_of_nine_costs_little_time(fast):
    """Simulated time of a line at 1 Mbaud: no host and no scheduler in it."""
    now_s = [0.0]

    def sleep_until(t_s):
        now_s[0] = max(now_s[0], t_s)

    ids = range(1, 10)
    chain = build_dynamixel([ServoSpec(i, "xl330-m077", 2000) for i in ids], lambda: now_s[0])
    port = InProcessPort(chain, sleep_until=sleep_until, wire_time=True)
    setups = [ServoConfig(i, "xl330-m077", 1000, 3000, 6000.0) for i in ids]
    bus = SmartServoBus(DYNAMIXEL, port, setups, DynamixelParams(fast_sync_read=fast))
    bus.open()
    bus.enable_torque()

    def cycle():
        """Run flat out: gives the time a read takes, and the values that came."""
        began_s = now_s[0]
        readings = rows(bus.read(began_s))
        bus.write([2000] * 9)
        return now_s[0] - began_s, 9 - readings.count(None)

    for _ in range(300):
        cycle()
    usual_s = max(cycle()[0] for _ in range(50))
    chain.faults.command("lose 5")
    first_s, values = cycle()
    assert values == 8
    # Once all of the reserve: it might have been the host that paused.
    assert first_s - usual_s < 0.002 + RESERVE_S
    later = [cycle() for _ in range(600)]
    assert {values for _, values in later} == {8}
    assert sum(span for span, _ in later) / len(later) < 1.01 * usual_s
