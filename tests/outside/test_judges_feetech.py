"""A client that others wrote does all it can on the emulated STS bus: rustypot, in Rust."""

import math

import pytest
from fakes.pty_bus import PtyBus
from fakes.waiting import eventually

from gazerig.sim_mock.devices import FeetechLine
from gazerig.sim_mock.smart_servo.physics import ServoSpec

BAUD = 1_000_000
IDS = [1, 2, 3]
PLACES = [2048, 1000, 3000]
STEADY_STEPS = 3


@pytest.fixture
def bus():
    with PtyBus() as started:
        yield started


@pytest.fixture
def patience_s():
    """Longest wait for an answer."""
    return 1.0


@pytest.fixture
def client(bus, patience_s):
    rustypot = pytest.importorskip("rustypot", reason="rustypot is not installed")
    specs = [ServoSpec(i, "sts3215", place) for i, place in zip(IDS, PLACES, strict=True)]
    opened = rustypot.Sts3215PyController(
        bus.start_device(FeetechLine(tuple(specs), BAUD)), BAUD, patience_s
    )
    yield opened
    opened.close()


def test_every_register_it_knows(client):
    registers = client.registers()
    assert len(registers) >= 50
    for register in registers:
        data, error = client.read_raw_data_with_error(1, register.addr, register.size)
        assert (len(data), error) == (register.size, 0), register.name
    assert client.read_firmware_major_version(1) in (3, [3])


def test_positions_speeds_and_torque_of_a_group(client):
    assert client.sync_read_raw_present_position(IDS) == PLACES
    angles = [(place - 2048) / 4096 * math.tau for place in PLACES]
    assert client.sync_read_present_position(IDS) == pytest.approx(angles, abs=0.002)
    client.sync_write_raw_goal_speed(IDS, [1000] * 3)
    client.sync_write_raw_goal_position(IDS, [1500, 1500, 2500])
    client.sync_write_torque_enable(IDS, [True] * 3)
    assert client.sync_read_torque_enable(IDS) == [True] * 3
    seen = []

    def near():
        seen.append(client.sync_read_register(IDS, "present_speed"))
        places = client.sync_read_raw_present_position([3, 1, 2])
        wanted = (2500, 1500, 1500)
        return all(abs(a - b) <= STEADY_STEPS for a, b in zip(places, wanted, strict=True))

    assert eventually(near)
    # 1 and 3 turn downwards, 2 upwards, none much faster than commanded
    assert min(speeds[0] for speeds in seen) < -500
    assert max(speeds[1] for speeds in seen) > 500
    assert min(speeds[2] for speeds in seen) < -500
    assert max(abs(speed) for speeds in seen for speed in speeds) < 1200
    client.write_torque_enable(2, False)
    assert client.sync_read_torque_enable(IDS) == [True, False, True]


def test_signs_are_those_it_expects(client):
    client.write_register(1, "homing_offset", -100)
    assert client.read_register(1, "homing_offset") == -100
    assert client.read_register(1, "present_position") == 2148
    for name in ("min_position_limit", "max_position_limit"):
        client.write_register(2, name, 0)
    client.write_torque_enable(2, True)
    client.write_register(2, "goal_position", -500)
    assert eventually(lambda: client.read_register(2, "present_load") < -500)
    assert eventually(
        lambda: abs(client.read_register(2, "present_position") + 500) <= STEADY_STEPS
    )


@pytest.mark.parametrize("patience_s", [0.3])
def test_a_new_id_and_a_new_baud(client):
    assert eventually(lambda: client.ping(3))
    client.write_id(3, 9)
    assert client.ping(3) is False
    assert eventually(lambda: client.ping(9))
    client.write_raw_data(9, 6, [1])
    assert client.ping(9) is False
    client.set_baudrate(500_000)
    assert eventually(lambda: client.ping(9))
    assert client.ping(1) is False
