"""On a real terminal: an adapter pulled out and put back, and a driver that is killed."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from present import present

from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.dynamixel.params import DynamixelParams
from gazerig.drivers.serial.port import BlockingPort
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.drivers.types import ServoConfig
from gazerig.sim_mock.pty.client import PtyBus
from gazerig.sim_mock.smart_servo.physics import ServoSpec
from gazerig.testing.bus_bench import rows

IDS = (1, 2, 3)
SPECS = [ServoSpec(i, "xl330-m077", 1200) for i in IDS]
SETUPS = [ServoConfig(i, "xl330-m077", 1000, 3000, 200.0, f"joint_{i}") for i in IDS]
ROOT = Path(__file__).parents[1]

DRIVER = """
import sys, time
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.dynamixel.params import DynamixelParams
from gazerig.drivers.serial.port import BlockingPort
from gazerig.drivers.types import ServoConfig
setups = [ServoConfig(i, "xl330-m077", 1000, 3000, 200.0) for i in (1, 2, 3)]
params = DynamixelParams(reply_timeout_ms=100.0)
bus = SmartServoBus(DYNAMIXEL, BlockingPort(sys.argv[1]), setups, params)
bus.open()
bus.enable_torque()
while True:
    bus.read(time.monotonic())
    bus.write([2900] * 3)
    print("moving", flush=True)
    time.sleep(0.01)
"""


def places(server):
    return [servo["position"] for servo in json.loads(server.command("status"))["servos"]]


def run(bus, seconds, goals=None, until=lambda readings: False):
    """Run at about 100 Hz; gives the last readings."""
    end_s = time.monotonic() + seconds
    while True:
        readings = rows(bus.read(time.monotonic()))
        if goals is not None:
            bus.write(goals)
        if until(readings) or time.monotonic() >= end_s:
            return readings
        time.sleep(0.01)


def test_pulled_out_and_put_back_it_goes_on_from_where_the_joints_are():
    with PtyBus() as server:
        bus = SmartServoBus(
            DYNAMIXEL,
            BlockingPort(server.start(SPECS)),
            SETUPS,
            DynamixelParams(reply_timeout_ms=100.0),
        )
        bus.open()
        bus.enable_torque()
        run(bus, 0.2, [2000] * 3)
        bus.events()
        server.command("unplug")
        # The first read after the plug is out knows it.
        assert rows(bus.read(time.monotonic())) == (None, None, None)
        assert bus.events()[0].startswith("port lost: ")
        for servo_id in IDS:
            server.command(f"turn {servo_id} -100")
        run(bus, 0.3, [2000] * 3)
        server.command("plug")
        readings = run(bus, 10.0, until=lambda readings: None not in readings)
        assert [r.rearmed and r.torque for r in readings] == [True] * 3
        held = places(server)
        run(bus, 0.2)
        assert all(abs(a - b) <= 12 for a, b in zip(places(server), held, strict=True))
        assert any("port back after" in line for line in bus.events())
        readings = run(
            bus, 20.0, [1500] * 3, lambda rs: all(r and r.position_steps > 1450 for r in rs)
        )
        assert all(reading.position_steps > 1450 for reading in readings)
        bus.disable_torque()
        bus.close()


def test_a_killed_driver_leaves_servos_that_stop_by_themselves():
    with PtyBus() as server:
        path = server.start(SPECS)
        driver = subprocess.Popen(
            [sys.executable, "-c", DRIVER, path], cwd=ROOT, stdout=subprocess.PIPE
        )
        try:
            for _ in range(40):
                assert present(driver.stdout).readline() == b"moving\n"
            moving = places(server)
            os.kill(driver.pid, signal.SIGKILL)
            driver.wait()
        finally:
            driver.kill()
            driver.wait()
            present(driver.stdout).close()
        # Watchdog 200 ms, its step of 20, and time for a slow machine.
        time.sleep(0.5)
        stopped = places(server)
        time.sleep(0.5)
        later = places(server)
        servos = json.loads(server.command("status"))["servos"]
    assert all(at > 1200 for at in moving)
    assert all(abs(a - b) <= 3 for a, b in zip(stopped, later, strict=True))
    # Far from its goal, which is 8 s away.
    assert all(at < 2700 for at in later)
    assert [(servo["goal"], servo["torque"]) for servo in servos] == [(2900, 1)] * 3
