"""Servos that stop, restart or start outside their limits while the driver looks after them."""

import pytest
from fakes.dynamixels import Rig
from feedback_rows import rows

from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.process.host_lateness import LATE_COMPUTER
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.drivers.servo_bus.transaction import RESERVE_S
from gazerig.drivers.types import ServoConfig
from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.smart_servo.physics import ServoSpec


@pytest.fixture(params=[True, False], ids=["fast", "plain"])
def fast(request):
    return request.param


@pytest.fixture
def rig(fast):
    return Rig(fast).open()


def test_the_watchdog_stops_the_servos_when_the_host_falls_silent():
    rig = Rig(starts=(1001, 1002, 1003)).open()
    rig.bus.enable_torque()
    rig.tick([3000] * 3)
    rig.now_s += 5.0
    stopped = rig.chain.positions_steps()
    assert all(1003 < x < 2900 for x in stopped)


def test_a_host_that_stalled_brings_the_servos_back_without_a_jump(rig):
    rig.bus.enable_torque()
    rig.tick([2800] * 3)
    rig.now_s += 5.0
    stopped = rig.chain.positions_steps()
    # The first exchange shows the stall, the next one heals it.
    rig.tick()
    rig.tick()
    assert rig.errors() == {LATE_COMPUTER: 3}
    assert [s.memory.get("bus_watchdog") for s in rig.chain.servos] == [10] * 3
    rig.now_s += 0.1
    assert all(abs(a - b) <= 40 for a, b in zip(rig.chain.positions_steps(), stopped, strict=True))
    for _ in range(200):
        rig.tick([2500] * 3)
    assert rig.places() == pytest.approx([2500] * 3, abs=12)
    assert rig.errors() == {LATE_COMPUTER: 3}


def test_a_stall_shown_by_a_write_is_healed_by_the_next_read_and_told(rig):
    rig.bus.enable_torque()
    rig.now_s += 1.0
    rig.bus.write([2500] * 3)
    # The planner of goals does not know it yet: no goal is sent before the next read.
    rig.bus.write([2500] * 3)
    rig.now_s += 0.1
    assert all(
        abs(x - at) < 1
        for x, at in zip(rig.chain.positions_steps(), (2001, 2002, 2003), strict=True)
    )
    assert [r.rearmed for r in rig.tick([2500] * 3)] == [True] * 3
    assert [r.rearmed for r in rig.tick([2500] * 3)] == [False] * 3
    rig.now_s += 0.19
    assert all(x > 2100 for x in rig.chain.positions_steps())
    assert rig.errors() == {LATE_COMPUTER: 3}


def test_a_quick_restart_between_two_reads_is_found_by_asking_in_turn(fast):
    rig = Rig(fast, direct=True).open()
    rig.bus.enable_torque()
    rig.chain[2].restart()
    rig.chain[2]._deaf_until_ms = 0
    for _ in range(100):
        rig.tick([2500] * 3)
    assert rig.bus.events()[-1] == "servo 2 restarted: set up again"
    assert rig.chain[2].torque


def test_a_joint_outside_its_limits_comes_in_slowly():
    rig = Rig(starts=(900, 3170, 2003)).open()
    assert rig.bus.enable_torque() == (1000, 3000, 2003)
    for _ in range(300):
        outside = [r for r in rig.tick() if not 1000 <= r.position_steps <= 3000]
        assert all(abs(r.velocity_steps_s) <= 30 / 360 * 4096 + 64 for r in outside)
    assert rig.places() == pytest.approx([1000, 3000, 2003], abs=12)
    for _ in range(100):
        rig.tick([1100, 2900, 2000])
    assert [s.memory.get("profile_velocity") for s in rig.chain.servos] == [383] * 3


def test_healing_keeps_to_the_limits():
    rig = Rig(starts=(900, 2002, 2003)).open()
    rig.bus.enable_torque()
    rig.tick()
    rig.now_s += 1.0
    rig.tick()
    rig.tick()
    assert rig.errors() == {LATE_COMPUTER: 3}
    assert rig.chain[1].memory.get("goal_position") == 1000


def test_an_alert_whose_name_is_not_told_is_asked_about_seldom(fast):
    rig = Rig(fast, direct=True).open()
    rig.bus.enable_torque()
    rig.chain[2].alert = 0x20
    for _ in range(50):
        rig.tick()
    before = rig.bus.health().tx_bytes
    rig.tick()
    quiet = rig.bus.health().tx_bytes - before
    assert rig.bus.faults() == ()
    rig.chain[2].fail("overload")
    for _ in range(101):
        rig.tick()
    assert rig.bus.faults() == ("servo 2: overload",)
    assert quiet == 14 + 3


def test_one_silent_servo_of_nine_costs_little_time(fast):
    """Simulated time of a line at 1 Mbaud: no host and no scheduler in it."""
    now_s = [0.0]

    def sleep_until(t_s):
        now_s[0] = max(now_s[0], t_s)

    ids, version = range(1, 10), 53 if fast else 45
    specs = [ServoSpec(i, "xl330-m077", 2000, version) for i in ids]
    chain = build_dynamixel(specs, lambda: now_s[0])
    port = InProcessPort(chain, sleep_until=sleep_until, wire_time=True)
    setups = [ServoConfig(i, "xl330-m077", 1000, 3000, 6000.0) for i in ids]
    bus = SmartServoBus(DYNAMIXEL, port, setups)
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
