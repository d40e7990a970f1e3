"""Servos on the bus: every baud rate, pieces, shared ids, echoes."""

import pytest
from sts_rig import Rig

from gazerig.drivers.dynamixel.control_table import BAUD_RATES
from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.feetech.family import FEETECH
from gazerig.drivers.servo_bus.discovery import FoundServo, count_corrupt, scan_ids
from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.smart_servo.physics import ServoSpec

XL, STS = "xl330-m077", "sts3215"


class Bench:
    """Some servos of one family on a port, and how the driver names them."""

    def __init__(self, family, baud, *ids):
        self.family, self.baud = family, baud
        if family is FEETECH:
            self.rig = Rig([ServoSpec(i, STS, 1900 + 7 * i) for i in ids], setups=[], baud=baud)
            self.port, self.chain = self.rig.port, self.rig.chain
            self.names = [FoundServo(i, 777, 353, baud, STS) for i in ids]
        else:
            specs, self.now_s = [ServoSpec(i, XL, 2000) for i in ids], 0.0
            chain = self.chain = build_dynamixel(specs, lambda: self.now_s)
            for servo in chain.servos:
                servo.memory.set("baud_rate", BAUD_RATES.index(baud))
            chain.check_baud = True
            chain.refresh()
            chain.refresh()
            self.port = InProcessPort(chain, sleep_until=self.sleep_until)
            self.names = [FoundServo(i, 1190, 53, baud, XL) for i in ids]
        assert self.port.setBaudRate(baud)

    def sleep_until(self, t_s):
        self.now_s = max(self.now_s, t_s)

    def corrupt(self, servo_id):
        return count_corrupt(self.port, self.family, servo_id)


@pytest.fixture(params=[DYNAMIXEL, FEETECH], ids=lambda family: family.name)
def family(request):
    return request.param


def test_all_servos_are_found_at_their_own_rate_and_no_other(family):
    bench = Bench(family, 57_600, 1, 7, family.highest_id)
    for baud in family.baud_rates:
        assert bench.port.setBaudRate(baud)
        wanted = (tuple(bench.names), 0) if baud == bench.baud else ((), 0)
        assert scan_ids(bench.port, family, baud) == wanted


@pytest.mark.parametrize("fault", ["echo", "delay all 15"])
def test_servos_are_found_whatever_the_adapter_does(family, fault):
    bench = Bench(family, 1_000_000, 1, 2, 3, 40)
    bench.chain.faults.command(fault)
    assert list(scan_ids(bench.port, family, bench.baud)[0]) == bench.names


def test_two_servos_with_one_id_are_seen(family):
    bench = Bench(family, 57_600, 1, 2)
    assert bench.corrupt(1) == 0 == bench.corrupt(77)
    bench.chain.faults.command("collide 1")
    # Their identities are equal and look healthy.
    assert bench.corrupt(1) >= 2 and bench.corrupt(2) == 0
