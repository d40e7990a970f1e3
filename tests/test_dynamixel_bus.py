"""The Dynamixel bus over both twins: what it alone does; the rest is in test_bus_kinds."""

import time
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import pytest
from dynamixel_sdk import PacketHandler
from present import present

from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.dynamixel.params import DynamixelParams
from gazerig.drivers.dynamixel.protocol import instruction
from gazerig.drivers.errors import ServoMissing
from gazerig.drivers.serial.port import BlockingPort, BusPort
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.drivers.types import ServoConfig
from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.pty.client import PtyBus
from gazerig.sim_mock.smart_servo.physics import ServoSpec
from gazerig.testing.bus_bench import rows

TWINS = ("in-process", "pty")
"""A terminal's driver has time-outs in real time."""

SPEED = 6000.0
REBOOT = 8
SPECS = (
    ServoSpec(3, "xl330-m077", 1800),
    ServoSpec(1, "xl330-m077", 2048),
    ServoSpec(12, "xc330-m288", 2300),
    ServoSpec(7, "xc330-m288", 2048),
)
SETUPS = tuple(ServoConfig(s.id, s.model, 1000, 3000, SPEED) for s in SPECS)


class Twin(NamedTuple):
    """A bus with its port and a function that lets time pass."""

    port: BusPort
    wait: Callable[[float], None]

    def bus(self, setups=SETUPS, **params) -> SmartServoBus:
        # A shared machine may stall a process for longer than real servos ever wait.
        timeouts: dict[str, Any] = {"reply_timeout_ms": 100.0, "prompt_timeout_ms": 100.0}
        chosen = {**timeouts, "watchdog_ms": 0, **params}
        return SmartServoBus(DYNAMIXEL, self.port, setups, DynamixelParams(**chosen))

    def run(self, bus, seconds, goals=None):
        """Tick every 10 ms; give the last readings."""
        end_s = self.port.now_s() + seconds
        while True:
            readings = rows(bus.read(self.port.now_s()))
            if goals is not None:
                bus.write(goals)
            if self.port.now_s() >= end_s:
                return readings
            self.wait(0.01)


def make_twin(kind: str, specs=SPECS) -> Iterator[Twin]:
    if kind == "in-process":
        now = [0.0]

        def wait(seconds: float) -> None:
            now[0] += seconds

        yield Twin(InProcessPort(build_dynamixel(specs, lambda: now[0])), wait)
        return
    with PtyBus() as server:
        port = BlockingPort(server.start(specs))
        yield Twin(port, time.sleep)
        port.closePort()


@pytest.fixture(params=TWINS)
def twin(request):
    yield from make_twin(request.param)


@pytest.fixture(params=[True, False], ids=["fast", "plain"])
def bus(request, twin):
    made = twin.bus(fast_sync_read=request.param)
    made.open()
    yield made
    made.disable_torque()
    made.close()


def registers(twin, address, size, ids=(3, 1, 12, 7)):
    """Read one register of some servos through the SDK, apart from the driver."""
    read = getattr(PacketHandler(2.0), f"read{size}ByteTxRx")
    return {i: read(twin.port, i, address)[0] for i in ids}


def near(readings, goals, steps=12):
    """Return whether all servos are where they should be, but for what friction leaves."""
    return all(abs(at - goal) <= steps for at, goal in zip(places(readings), goals, strict=True))


def places(readings):
    return [None if r is None else r.position_steps for r in readings]


def test_from_open_to_release_with_fast_and_with_plain_reads(twin, bus):
    assert places(rows(bus.read(twin.port.now_s()))) == [1800, 2048, 2300, 2048]
    assert bus.enable_torque() == (1800, 2048, 2300, 2048)
    twin.run(bus, 0.6, [1900, 1900, 2200, 2200])
    assert places(rows(bus.read(twin.port.now_s()))) == pytest.approx(
        [1900, 1900, 2200, 2200], abs=12
    )
    assert registers(twin, 64, 1) == {3: 1, 1: 1, 12: 1, 7: 1}
    assert registers(twin, 116, 4) == {3: 1900, 1: 1900, 12: 2200, 7: 2200}
    bus.disable_torque()
    assert registers(twin, 64, 1) == {3: 0, 1: 0, 12: 0, 7: 0}
    assert "refused" not in bus.health().errors


def test_a_silent_servo_costs_only_itself_and_is_taken_back(twin, bus):
    bus.enable_torque()
    twin.port.write(instruction(1, REBOOT))
    twin.port.drain()
    seen = [places(twin.run(bus, 0.0)) for _ in range(2)]
    end_s = twin.port.now_s() + 5.0
    while None in seen[-1] and twin.port.now_s() < end_s:
        seen.append(places(twin.run(bus, 0.02)))
    assert [1800, None, 2300, 2048] in seen
    assert seen[-1] == [1800, 2048, 2300, 2048]
    assert registers(twin, 64, 1) == {3: 1, 1: 1, 12: 1, 7: 1}
    assert bus.health().errors["timeout"] >= 1
    assert bus.faults() == ()
    assert "servo 1 restarted: set up again" in bus.events()


def test_open_names_every_problem_at_once(twin):
    setups = (
        *SETUPS[:3],
        SETUPS[3]._replace(model="xl430-w250"),
        ServoConfig(99, "xl330-m288", 0, 4095, SPEED),
    )
    with pytest.raises(ServoMissing) as caught:
        twin.bus(setups).open()
    message = str(caught.value)
    assert "servo 7 is xc330-m288, not xl430-w250" in message
    assert "servo 99 does not answer" in message
    assert twin.port.port_name in message
    assert "\n" not in message


def test_open_names_servos_that_nobody_expects_beside_the_missing_ones(twin):
    with pytest.raises(ServoMissing, match="unexpected: servo 1 .xl330-m077., 3 .xl330-m077."):
        twin.bus([ServoConfig(i, "xl330-m288", 0, 4095, SPEED) for i in (50, 51)]).open()
    bus = twin.bus(SETUPS[:3])
    bus.open()
    assert "servo 7 (xc330-m288) belongs to no joint: not used" in bus.events()


@pytest.mark.parametrize("kind", TWINS)
def test_a_joint_outside_its_limits_comes_in_slowly(kind):
    specs = (ServoSpec(1, "xl330-m077", 900), ServoSpec(2, "xl330-m077", 3170))
    for twin in make_twin(kind, specs):
        bus = twin.bus([ServoConfig(i, "xl330-m077", 1000, 3000, SPEED) for i in (1, 2)])
        bus.open()
        assert bus.enable_torque() == (1000, 3000)
        slowest = 30 / 360 * 4096
        for _ in range(60):
            readings = rows(bus.read(twin.port.now_s()))
            outside = [r for r in readings if not 1000 <= present(r).position_steps <= 3000]
            assert all(abs(present(r).velocity_steps_s) <= slowest + 64 for r in outside)
            twin.wait(0.02)
        assert near(readings, [1000, 3000])
        twin.run(bus, 1.0, [1100, 2900])
        assert registers(twin, 112, 4, ids=(1, 2)) == {1: 383, 2: 383}
        bus.disable_torque()
        bus.close()
