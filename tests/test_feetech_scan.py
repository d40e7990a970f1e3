"""Looking for STS servos, and giving one its id and baud rate."""

import pytest
from sts_rig import Rig

from gazerig.drivers.errors import ServoFault, ServoMissing
from gazerig.drivers.feetech.homing import set_middle
from gazerig.drivers.feetech.memory_table import BAUD_RATES
from gazerig.drivers.feetech.registers import Identity, StsRegisters
from gazerig.drivers.feetech.scan import Found, everybody, garbled, ping, scan
from gazerig.sim_mock.smart_servo.physics import ServoSpec


def rig_at(baud, *ids):
    return Rig([ServoSpec(i, "sts3215", 1900 + 7 * i) for i in ids], setups=[], baud=baud)


def test_scan_finds_everybody_at_their_own_rates_and_tells_where_it_is():
    rig = rig_at(500_000, 1, 7, 253)
    asked = []
    rounds = list(scan(rig.port, progress=lambda baud, servo_id: asked.append((baud, servo_id))))
    assert [r.baud for r in rounds] == list(BAUD_RATES)
    found = {r.baud: r.found for r in rounds if r.found}
    assert found == {500_000: tuple(Found(i, 777, 353, 500_000) for i in (1, 7, 253))}
    assert all(r.possible and not r.shared and not r.junk for r in rounds)
    assert len(asked) == 8 * 254
    assert (found[500_000][0].model, found[500_000][0].version) == ("sts3215", "3.53")


@pytest.mark.parametrize("fault", ["delay all 15", "echo on", "noise before", "noise after FF"])
def test_everybody_is_found_whatever_the_adapter_does(fault):
    rig = rig_at(1_000_000, 1, 2, 3, 40)
    rig.port.setBaudRate(1_000_000)
    rig.command(fault)
    found, _ = everybody(rig.port, 1_000_000, ids=range(50))
    assert [one.id for one in found] == [1, 2, 3, 40]


def test_an_echo_is_no_servo():
    rig = rig_at(1_000_000, 9)
    rig.port.setBaudRate(1_000_000)
    rig.command("lose 9")
    rig.command("echo on")
    assert everybody(rig.port, 1_000_000, ids=range(12))[0] == ()
    assert ping(rig.port, 9, 1_000_000) is None
    rig.command("clear 9")
    assert ping(rig.port, 9, 1_000_000) == Found(9, 777, 353, 1_000_000)


def test_two_servos_with_one_id_are_seen():
    rig = rig_at(1_000_000, 1, 2)
    rig.port.setBaudRate(1_000_000)
    assert garbled(rig.port, 2) == 0
    rig.command("collide 2")
    (only,) = scan(rig.port, (1_000_000,), ids=range(5))
    assert only.shared == (2,)


def test_single_registers():
    rig = rig_at(1_000_000, 4)
    rig.port.setBaudRate(1_000_000)
    registers = StsRegisters(rig.port)
    assert registers.identify(4) == Identity(777, 353)
    assert registers.ping(4)
    assert not registers.ping(5)
    assert registers.read(5, "id") is None
    assert registers.read(4, "present_position") == 1928
    assert registers.settle(4, "torque_limit", 600)
    assert registers.read(4, "torque_limit") == 600
    assert registers.keep(4, "position_offset", -85)
    rig.chain[4].restart()
    rig.now_s += 1.0
    assert registers.read(4, "position_offset") == -85
    assert registers.read(4, "lock") == 1
    rig.command("voltage 4 12.0")
    rig.now_s += 0.1
    rig.chain.positions_steps()
    assert registers.read(4, "present_input_voltage") == 120
    assert registers.error == 1


@pytest.mark.parametrize("fault", ["lose 4 count 2", "corrupt 4 40 count 2", "delay 4 60 count 1",
                                   "echo on", "truncate 4 3 count 2"])  # fmt: skip
def test_single_registers_through_trouble(fault):
    rig = rig_at(1_000_000, 4)
    rig.port.setBaudRate(1_000_000)
    registers = StsRegisters(rig.port)
    rig.command(fault)
    assert registers.read(4, "present_position") == 1928
    rig.command(fault)
    assert registers.write(4, "torque_limit", 321)
    assert registers.read(4, "torque_limit") == 321


def test_the_present_place_becomes_the_middle_for_good():
    rig = rig_at(1_000_000, 7)
    rig.port.setBaudRate(1_000_000)
    registers = StsRegisters(rig.port)
    assert abs(set_middle(rig.port, 7)) == 2048 - 1949
    rig.chain[7].restart()
    rig.now_s += 1.0
    assert registers.read(7, "present_position") == pytest.approx(2048, abs=1)
    assert (rig.get(7, 40), rig.get(7, 55)) == (0, 1)


def test_the_middle_is_not_set_under_torque_nor_of_nobody():
    rig = rig_at(1_000_000, 7)
    rig.port.setBaudRate(1_000_000)
    rig.chain[7].write(40, b"\x01")
    with pytest.raises(ServoFault, match="servo 7 holds its place: let it go"):
        set_middle(rig.port, 7)
    with pytest.raises(ServoMissing, match="servo 8 does not answer"):
        set_middle(rig.port, 8)
