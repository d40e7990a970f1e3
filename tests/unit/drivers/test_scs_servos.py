"""Feetech SCS servos on a line with others: known apart, and let go one by one."""

import pytest
from scs_text import scs_text

from gazerig.config.load import ConfigError
from gazerig.config.schema import load_rig
from gazerig.drivers.feetech.family import FEETECH, FEETECH_SCS
from gazerig.drivers.feetech.memory_table import FeetechParams
from gazerig.drivers.servo_bus.discovery import count_corrupt, scan_ids
from gazerig.drivers.servo_bus.transaction import Transactions
from gazerig.robot.guardian.process import releaser
from gazerig.robot.guardian.release_plan import ReleasePlan
from gazerig.sim_mock.feetech.chain import build_feetech
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.smart_servo.physics import ServoSpec


class Bench:
    """Two SCS servos and an STS one on a line, which only bring-up ever meets."""

    def __init__(self):
        self.now_s = 0.0
        specs = [ServoSpec(1, "scs0009", 511), ServoSpec(2, "scs15", 300), ServoSpec(3, "sts3215")]
        self.chain = build_feetech(specs, lambda: self.now_s)
        self.port = InProcessPort(self.chain, sleep_until=self.sleep_until)
        self.port.setBaudRate(1_000_000)

    def sleep_until(self, t_s):
        self.now_s = max(self.now_s, t_s)


def test_both_series_are_known_by_one_search():
    bench = Bench()
    found, _ = scan_ids(bench.port, FEETECH, 1_000_000)
    assert [(one.id, one.number, one.model) for one in found] == [
        (1, 1284, "scs0009"), (2, 1295, "scs15"), (3, 777, "sts3215"),
    ]  # fmt: skip
    assert count_corrupt(bench.port, FEETECH_SCS, 1) == 0
    bench.chain.faults.command("collide 1")
    assert count_corrupt(bench.port, FEETECH_SCS, 1) >= 2


def test_the_guardian_lets_go_of_servos_without_sync_read():
    bench = Bench()
    for servo_id in (1, 2):
        assert Transactions(bench.port, FEETECH_SCS).write(servo_id, "torque_enable", 1)
    plan = ReleasePlan("feetech", "", (1, 2), FeetechParams(), "feetech scs")
    assert releaser(plan)(bench.port) == ()
    assert [bench.chain[i].read(40, 1)[1] for i in (1, 2)] == [b"\x00", b"\x00"]


def test_a_place_beyond_the_potentiometer_and_a_mixture_of_series_are_refused(tmp_path):
    path = tmp_path / "scs.yaml"
    path.write_text(scs_text().replace("zero_step: 512", "zero_step: 1000"), encoding="utf-8")
    with pytest.raises(ConfigError, match="1023"):
        load_rig(str(path))
    eyes, neck = scs_text(neck="sts3215").split("neck_yaw:", 1)
    neck = neck.replace("zero_step: 512", "zero_step: 2048")
    path.write_text(f"{eyes}neck_yaw:{neck}", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"a sts3215 cannot be on one bus with a scs0009"):
        load_rig(str(path))
