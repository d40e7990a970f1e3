"""Injected faults of Dynamixel servos only; those of all smart servos are in test_servo_faults."""

import pytest
from copied import copied
from dynamixel_rig import WAYS, Rig
from moving_bus import IDS
from present import present

from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.dynamixel.params import DynamixelParams
from gazerig.drivers.servo_bus.bus import SmartServoBus
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


def test_no_goal_is_followed_before_positions_are_read_again(rig):
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


def test_a_watchdog_that_tripped_unnoticed_is_found_where_servos_were_read_without_torque():
    rig = Rig()
    rig.bus.open()
    for _ in range(3):
        rig.tick()
    rig.bus.enable_torque()
    rig.until_all()
    # Packets to one servo get lost, although the host has sent them in time.
    rig.chain[2].memory.set("bus_watchdog", 255)
    for _ in range(600):
        rig.tick([2000] * 4)
    assert rig.errors().get("watchdog") == 1
    assert any("watchdog of 1 servo stopped them" in line for line in rig.bus.events())


@pytest.mark.parametrize("fast", [True, False])
def test_one_silent_servo_of_nine_costs_little_time(fast):
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
