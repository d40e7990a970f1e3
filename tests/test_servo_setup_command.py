"""Setting servos up one at a time, and restarting them: on emulated servos, byte for byte."""

import pytest

from drivers.dynamixel.control_table import BAUD_RATES
from drivers.errors import PortError, ServoFault, ServoMissing
from drivers.servo_bus.discovery import COMMON_FIRST, Found
from drivers.types import ServoSetup
from robot.bringup.servo_families import DYNAMIXEL
from robot.bringup.servo_reboot import Standing, restart
from robot.bringup.servo_setup import assign, find_alone, search_order
from sim_mock.dynamixel.chain import build_dynamixel
from sim_mock.dynamixel.packets import status
from sim_mock.in_process_port import InProcessPort
from sim_mock.smart_servo.physics import ServoSpec

BAUD = 1_000_000
YAW = ServoSetup(7, "xc330-m288", 1252, 2844, 2000.0, "neck_yaw")


class Bench:
    """Servos on a table, factory fresh unless told otherwise, heard at their own rate only."""

    def __init__(self, *specs, baud=57_600):
        self.now = 0.0
        specs = specs or (ServoSpec(1, "xc330-m288", 2000),)
        self.chain = build_dynamixel(specs, lambda: self.now, baud=baud)
        self.port = InProcessPort(self.chain)
        self.told = []

    def sleep_until(self, t_s):
        self.now = max(self.now, t_s)

    def find(self):
        return find_alone(self.port, DYNAMIXEL, search_order(DYNAMIXEL, BAUD), self.told.append)

    def assign(self, setup=YAW, baud=BAUD):
        return assign(self.port, DYNAMIXEL, self.find(), setup, baud, self.told.append)


def test_a_factory_fresh_servo_gets_its_id_and_rate():
    bench = Bench()
    result = bench.assign()
    assert result.before == Found(1, 1240, 53, 57_600)
    assert result.now == Found(7, 1240, 53, BAUD)
    assert result.done == ("id 1 -> 7", f"baud rate 57600 -> {BAUD} bit/s")
    (servo,) = bench.chain.servos
    assert (servo.id, servo.memory.get("baud_rate")) == (7, BAUD_RATES.index(BAUD))
    assert servo.memory.get("torque_enable") == 0


def test_doing_it_again_changes_nothing():
    bench = Bench()
    bench.assign()
    before = bytes(bench.chain.servos[0].memory.bytes[:64])
    assert bench.assign().done == ()
    assert bytes(bench.chain.servos[0].memory.bytes[:64]) == before


@pytest.mark.parametrize("baud", [b for b in COMMON_FIRST if b != 4_500_000])
def test_it_is_found_whatever_its_id_and_rate(baud):
    bench = Bench(ServoSpec(200, "xc330-m288"), baud=baud)
    assert bench.find() == Found(200, 1240, 53, baud)
    assert bench.assign().now.id == 7


def test_the_likely_rates_are_asked_first():
    assert search_order(DYNAMIXEL, 2_000_000)[:2] == (57_600, 2_000_000)
    assert sorted(search_order(DYNAMIXEL, 57_600)) == sorted(COMMON_FIRST)


def test_a_servo_whose_torque_is_on_is_let_go_first():
    bench = Bench()
    bench.chain[1].write(64, b"\x01")
    assert bench.assign().done[0] == "torque 1 -> 0"
    assert bench.chain.servos[0].id == 7


def test_a_servo_that_answers_pings_alone():
    bench = Bench()
    servo = bench.chain[1]
    servo.memory.set("status_return_level", 0)
    servo.status_level = 0
    assert bench.assign().now.id == 7


def test_nobody_is_there():
    bench = Bench()
    bench.port.faults.command("lose all")
    with pytest.raises(ServoMissing, match="no servo answers at any baud rate"):
        bench.find()


@pytest.mark.parametrize("ids", [(1, 2), (1, 1)])
def test_two_servos_are_refused(ids):
    bench = Bench(*(ServoSpec(i, "xc330-m288", 1000 + 500 * n) for n, i in enumerate(ids)))
    with pytest.raises(ServoMissing, match="connect one servo alone"):
        bench.find()


def test_two_servos_at_two_rates_are_refused():
    bench = Bench(ServoSpec(1, "xc330-m288"), ServoSpec(2, "xl330-m077"))
    bench.chain[2].memory.set("baud_rate", 3)
    bench.chain.refresh()
    with pytest.raises(ServoMissing, match=r"id 1 \(xc330-m288\) at 57600.*id 2 \(xl330-m077\) at"):
        bench.find()


def test_pieces_are_refused():
    bench = Bench()
    bench.port.faults.command("truncate all 8")
    with pytest.raises(ServoMissing, match="in pieces only"):
        bench.find()


def test_another_model_is_refused_and_left_alone():
    bench = Bench(ServoSpec(1, "xl330-m077"))
    before = bytes(bench.chain[1].memory.bytes[:64])
    with pytest.raises(ServoMissing, match=r"this is xl330-m077, neck_yaw \(servo 7\) wants xc330"):
        bench.assign()
    assert bytes(bench.chain[1].memory.bytes[:64]) == before


class StubbornPort(InProcessPort):
    """A port whose servo refuses writes to one address, or is silent under some id."""

    address = silent = None

    def write(self, data):
        if data[4] == self.silent:
            return
        if data[7] == 0x03 and data[8] == self.address:
            self._waiting += status(data[4], 7, b"")
            return
        super().write(data)


@pytest.mark.parametrize(
    ("address", "says"),
    [
        (7, r"the id 7 \(error 7\); it answered last as id 1 at 57600"),
        (8, rf"{BAUD} bit/s \(error 7\); it answered last as id 7 at 57600"),
    ],
)
def test_a_refusal_says_where_the_servo_answers_now(address, says):
    bench = Bench()
    bench.port = StubbornPort(bench.chain)
    bench.port.address = address
    with pytest.raises(ServoFault, match=says):
        bench.assign()


def test_an_adaptor_that_cannot_run_at_the_rate():
    bench = Bench()
    found = bench.find()
    bench.port.setBaudRate = lambda baud: (
        baud == 57_600 and InProcessPort.setBaudRate(bench.port, baud)
    )
    with pytest.raises(PortError, match="cannot run at 1000000"):
        assign(bench.port, DYNAMIXEL, found, YAW, BAUD, print)


def test_a_servo_that_is_gone_after_is_missed():
    bench = Bench()
    bench.port = StubbornPort(bench.chain)
    bench.port.silent = 7
    with pytest.raises(ServoMissing, match=f"does not answer as id 7 at {BAUD}"):
        bench.assign()
    bench = Bench(ServoSpec(7, "xc330-m288"))
    found = bench.find()
    bench.port.faults.command("lose 7")
    with pytest.raises(ServoMissing, match=f"does not answer as id 7 at {BAUD}"):
        assign(bench.port, DYNAMIXEL, found, YAW, BAUD, print)


@pytest.mark.parametrize("address", [7, 8])
def test_a_lost_confirmation_does_not_matter(address):
    class Lossy(InProcessPort):
        def write(self, data):
            super().write(data)
            if data[7] == 0x03 and data[8] == address:
                self.drain()

    bench = Bench()
    bench.port = Lossy(bench.chain)
    assert bench.assign().now == Found(7, 1240, 53, BAUD)


# --- restart


def test_a_restart_clears_what_was_latched():
    bench = Bench()
    bench.port.setBaudRate(57_600)
    bench.chain[1].write(64, b"\x01")
    bench.port.faults.command("overload 1")
    result = restart(bench.port, DYNAMIXEL, 1, 57_600, bench.sleep_until)
    assert result.before.errors == ("overload",)
    assert (result.after.errors, result.after.torque) == ((), False)
    assert result.after.position == 2000 and 0.3 < result.away_s < 1.0
    assert str(result.before).startswith("latched: overload, torque off, at step 2000")


def test_a_restart_of_a_servo_that_holds_leaves_it_limp():
    bench = Bench()
    bench.port.setBaudRate(57_600)
    bench.chain[1].write(64, b"\x01")
    result = restart(bench.port, DYNAMIXEL, 1, 57_600, bench.sleep_until)
    assert (result.before.torque, result.after.torque) == (True, False)


def test_a_lost_status_of_the_restart_does_not_matter():
    bench = Bench()
    bench.port.setBaudRate(57_600)
    tapped = []
    write = bench.port.write

    def lossy(data):
        tapped.append(data)
        write(data)
        if data[7] == 0x08:
            bench.port.drain()

    bench.port.write = lossy
    assert restart(bench.port, DYNAMIXEL, 1, 57_600, bench.sleep_until).after.torque is False
    assert bytes.fromhex("FFFFFD00010300082F4E") in tapped


def test_servos_that_do_not_answer_before_or_after():
    bench = Bench()
    bench.port.setBaudRate(57_600)
    with pytest.raises(ServoMissing, match="servo 5 does not answer at 57600"):
        restart(bench.port, DYNAMIXEL, 5, 57_600, bench.sleep_until)

    def sleep_and_lose(t_s):
        bench.sleep_until(t_s)
        bench.port.faults.command("lose 1")

    with pytest.raises(ServoMissing, match="does not come back"):
        restart(bench.port, DYNAMIXEL, 1, 57_600, sleep_and_lose)


def test_a_standing_in_words():
    assert str(Standing((), None, None, None)) == "nothing latched, torque unknown, at step None"
    assert str(Standing(("overload", "encoder"), True, 5, 4.9)) == (
        "latched: overload and encoder, torque on, at step 5, 4.9 V"
    )
