"""Setting STS servos up one at a time, and restarting them: on emulated servos, byte for byte."""

import pytest

from drivers.errors import ServoFault, ServoMissing
from drivers.types import ServoSetup
from robot.bringup.servo_families import DYNAMIXEL, FEETECH
from robot.bringup.servo_reboot import Standing, restart
from robot.bringup.servo_setup import assign, find_alone, search_order
from sim_mock.dynamixel.chain import build_dynamixel
from sim_mock.feetech.chain import build_feetech
from sim_mock.in_process_port import InProcessPort
from sim_mock.smart_servo.physics import ServoSpec

BAUD = 1_000_000
YAW = ServoSetup(7, "sts3215", 1252, 2844, 2000.0, "neck_yaw")


class Bench:
    """Servos on a table, factory fresh unless told otherwise, heard at their own rate only."""

    def __init__(self, *specs, baud=BAUD):
        self.now = 10.0
        self.chain = build_feetech(
            specs or (ServoSpec(1, "sts3215", 2000),), lambda: self.now, baud
        )
        self.port = InProcessPort(self.chain)
        self.told = []

    def sleep_until(self, t_s):
        self.now = max(self.now, t_s)
        self.chain.positions_steps()

    def find(self):
        return find_alone(self.port, FEETECH, search_order(FEETECH, BAUD), self.told.append)

    def assign(self, setup=YAW):
        return assign(self.port, FEETECH, self.find(), setup, BAUD, self.told.append)


@pytest.mark.parametrize(("servo_id", "baud"), [(1, BAUD), (200, 57_600), (7, 500_000)])
def test_a_servo_gets_its_id_and_rate_for_good_wherever_it_was(servo_id, baud):
    bench = Bench(ServoSpec(servo_id, "sts3215"), baud=baud)
    result = bench.assign()
    assert (result.before.id, result.before.baud) == (servo_id, baud)
    assert (result.now.id, result.now.baud) == (7, BAUD)
    bench.chain[7].restart()
    bench.sleep_until(bench.now + 1.0)
    bench.chain.refresh()
    bench.port.setBaudRate(BAUD)
    assert FEETECH.ping(bench.port, 7, BAUD, 1) is not None
    assert bench.chain[7].read(55, 1) == b"\1"


def test_doing_it_again_changes_nothing():
    bench = Bench(ServoSpec(7, "sts3215"))
    before = bench.chain[7].read(0, 40)
    assert bench.assign().done == ()
    assert bench.chain[7].read(0, 40) == before


def test_two_servos_are_refused_at_one_rate_and_at_two():
    with pytest.raises(ServoMissing, match="2 servos answer: id 1 .* id 2 .*: connect one servo"):
        Bench(ServoSpec(1, "sts3215"), ServoSpec(2, "sts3215")).find()
    bench = Bench(ServoSpec(1, "sts3215"), ServoSpec(1, "sts3215", 300))
    with pytest.raises(ServoMissing, match="connect one servo alone"):
        bench.find()
    bench = Bench(ServoSpec(1, "sts3215"), ServoSpec(2, "sts3215"))
    bench.chain[2].write(55, b"\0")
    bench.chain[2].write(6, b"\4")
    bench.chain.refresh()
    with pytest.raises(ServoMissing, match=r"id 1 \(sts3215\) at 1000000 .*id 2 .* at 115200"):
        bench.find()


def test_another_model_is_refused_and_left_alone():
    bench = Bench()
    before = bench.chain[1].read(0, 40)
    other = FEETECH._replace(models={"sts3215": FEETECH.models["sts3215"]._replace(number=1029)})
    with pytest.raises(ServoMissing, match="this is sts3215"):
        assign(bench.port, other, bench.find(), YAW, BAUD, print)
    assert bench.chain[1].read(0, 40) == before


def test_nobody():
    bench = Bench()
    bench.port.faults.command("lose all")
    with pytest.raises(ServoMissing, match="no servo answers at any baud rate"):
        bench.find()


@pytest.mark.parametrize("habit", ["mute", "answer"])
def test_a_restart_ends_an_overload_and_takes_the_torque(habit):
    bench = Bench()
    bench.chain.choose("reboot", habit)
    bench.port.setBaudRate(BAUD)
    bench.chain[1].write(40, b"\x01")
    bench.port.faults.command("overload 1")
    result = restart(bench.port, FEETECH, 1, BAUD, bench.sleep_until)
    assert (result.before.errors, result.before.torque) == (("overload",), True)
    assert (result.after.errors, result.after.torque) == ((), False)
    assert result.after.position == 2000 and 0.5 < result.away_s < 1.5


def test_firmware_that_does_not_know_how_to_restart_is_told_by_the_torque():
    bench = Bench()
    bench.port.setBaudRate(BAUD)
    bench.chain[1].write(40, b"\x01")
    deaf = FEETECH._replace(reboot=lambda port, servo_id: None)
    with pytest.raises(ServoFault, match="servo 1 has not restarted, its torque is still on"):
        restart(bench.port, deaf, 1, BAUD, bench.sleep_until)


def test_a_servo_in_words():
    assert str(Standing((), False, 5, 7.4, latching=False)) == (
        "no errors, torque off, at step 5, 7.4 V"
    )
    assert str(Standing(("overload",), None, None, None, latching=False)) == (
        "reports: overload, torque unknown, at step None"
    )


def test_kinds_write_firmware_as_their_makers_do():
    assert (FEETECH.version(353), FEETECH.version(310), DYNAMIXEL.version(53)) == (
        "3.53", "3.10", "53",
    )  # fmt: skip


def test_anybody_is_a_matter_of_answers_not_of_echoes():
    bench = Bench()
    bench.port.setBaudRate(BAUD)
    assert FEETECH.any_reply(bench.port)
    bench.port.faults.command("lose all")
    assert not FEETECH.any_reply(bench.port)
    bench.port.faults.command("echo on")
    assert not FEETECH.any_reply(bench.port)
    assert DYNAMIXEL.any_reply(InProcessPort(build_dynamixel([], lambda: 0.0)))
