"""Emulated Feetech SCS servos: high byte first, 1024 steps on less than a turn; by rustypot."""

import math

import pytest
from fakes.pty_bus import PtyBus
from fakes.waiting import eventually
from servo_bench import READ, WRITE, FeetechBench

from gazerig.sim_mock.devices import FeetechLine
from gazerig.sim_mock.smart_servo.physics import ServoSpec

BAUD = 1_000_000


class ScsBench(FeetechBench):
    """A bench whose numbers of two bytes have the high one first."""

    def __init__(self, *specs, **options):
        super().__init__(*(specs or [(1, "scs0009", 511.0)]), **options)

    def word(self, address, servo_id=1):
        [(_, _, data)] = self.ask(servo_id, READ, address, 2)
        return int.from_bytes(data, "big")

    def put(self, address, value, servo_id=1):
        assert len(self.ask(servo_id, WRITE, address, value.to_bytes(2, "big"))) == 1


@pytest.mark.parametrize(
    ("model", "number", "turn_steps"), [("scs0009", 1284, 1228.8), ("scs15", 1295, 1843.2)]
)
def test_its_table_has_the_high_byte_first(model, number, turn_steps):
    bench = ScsBench((1, model, 300.0))
    assert bench.ask(1, READ, 3, 2) == [(1, 0, number.to_bytes(2, "big"))]
    assert [bench.word(at) for at in (9, 11, 16, 56)] == [0, 1023, 1000, 300]
    # A quarter of a turn by hand is a quarter of the steps that a whole one would have.
    bench.chain.faults.command(f"turn 1 {turn_steps / 4}")
    assert bench.word(56) == pytest.approx(300 + turn_steps / 4, abs=1)
    bench.chain.faults.command(f"turn 1 {turn_steps}")
    assert bench.word(56) == 1023


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
