"""Emulated Feetech SCS servos: high byte first, 1024 steps on less than a turn; by rustypot."""

import math

import pytest
from fakes.pty_bus import PtyBus
from fakes.waiting import eventually

from gazerig.sim_mock.devices import FeetechLine
from gazerig.sim_mock.smart_servo.physics import ServoSpec

BAUD = 1_000_000


# --- judged by a client that was written by others


@pytest.fixture
def client():
    rustypot = pytest.importorskip("rustypot", reason="rustypot is not installed")
    specs = (ServoSpec(1, "scs0009", 511), ServoSpec(2, "scs0009", 300))
    with PtyBus() as bus:
        opened = rustypot.Scs0009PyController(bus.start_device(FeetechLine(specs, BAUD)), BAUD, 1.0)
        yield opened
        opened.close()


def test_rustypot_moves_it(client):
    [present] = client.read_present_position(2)
    assert present == pytest.approx(math.radians(300.0) * (300 - 511) / 1024, abs=0.01)
    client.write_torque_enable(2, 1)
    client.write_goal_position(2, 0.4)
    assert eventually(lambda: abs(client.read_present_position(2)[0] - 0.4) < 0.02)
    client.sync_write_goal_position([2], [-0.2])
    assert eventually(lambda: abs(client.read_present_position(2)[0] + 0.2) < 0.02)
    assert client.read_present_voltage(2) == [60]
