"""Servos that stop, restart or start outside their limits while the driver looks after them."""

import pytest
from fakes.dynamixels import Rig

from gazerig.drivers.process.host_lateness import LATE_COMPUTER


@pytest.fixture(params=[True, False], ids=["fast", "plain"])
def fast(request):
    return request.param


@pytest.fixture
def rig(fast):
    return Rig(fast).open()


def test_the_watchdog_stops_the_servos_when_the_host_falls_silent():
    rig = Rig(watchdog_ms=100).open()
    rig.bus.enable_torque()
    rig.tick([3000] * 3)
    rig.now_s += 5.0
    stopped = rig.chain.positions_steps()
    assert all(2001 < x < 2900 for x in stopped)


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


@pytest.mark.parametrize("indirect", [True, False])
def test_without_watchdog_nothing_is_armed_and_a_restart_is_still_healed(indirect):
    rig = Rig(watchdog_ms=0, indirect_block=indirect).open()
    rig.bus.enable_torque()
    assert [s.memory.get("bus_watchdog") for s in rig.chain.servos] == [0] * 3
    rig.now_s += 60.0
    rig.chain[2].restart()
    for _ in range(300):
        rig.tick([2500] * 3)
    assert rig.bus.faults() == ()
    assert "servo 2 restarted: set up again" in rig.bus.events()
    assert rig.places() == pytest.approx([2500] * 3, abs=12)


def test_a_quick_restart_between_two_reads_is_found_by_asking_in_turn(fast):
    rig = Rig(fast, indirect_block=False).open()
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
    rig = Rig(fast, indirect_block=False).open()
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
