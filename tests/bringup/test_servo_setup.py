"""Setting servos up one at a time, on emulated servos, byte for byte."""

from dataclasses import replace

import pytest
from doctor_rig import BAUD, each
from doctor_rig import NECK as MODELS

from gazerig.drivers.errors import ServoFault, ServoMissing
from gazerig.drivers.servo_bus.discovery import FoundServo, ping
from gazerig.drivers.servo_bus.transaction import Transactions
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.servo_kinds import DYNAMIXEL, FEETECH
from gazerig.features.bringup.servo_setup import (
    assign_servo,
    find_alone,
    search_order,
    search_rates,
)
from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.dynamixel.packets import status
from gazerig.sim_mock.feetech.chain import build_feetech
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.smart_servo.physics import ServoSpec

YAW = ServoConfig(7, "xc330-m288", 1252, 2844, 2000.0, "neck_yaw")

RATES = DYNAMIXEL.family.baud_rates


class Bench:
    """Servos on a table, factory fresh by default, which answer at their own rate only."""

    def __init__(self, *specs, baud=None, kind=DYNAMIXEL):
        self.now = 10.0
        self.kind = kind
        self.baud = kind.family.factory_baud if baud is None else baud
        self.model = MODELS[kind.name]
        self.yaw = YAW._replace(model=self.model)
        build = build_feetech if kind is FEETECH else build_dynamixel
        specs = specs or (ServoSpec(1, self.model, 2000),)
        self.chain = build(specs, lambda: self.now, baud=self.baud)
        self.port = InProcessPort(self.chain)
        self.reported = []

    def sleep_until(self, t_s):
        self.now = max(self.now, t_s)
        self.chain.positions_steps()

    def find(self):
        order = search_order(self.kind, BAUD)
        answers = search_rates(self.port, self.kind, order, self.reported.append, thorough=True)
        return find_alone(answers, self.port.port_name)

    def assign(self, setup=None, baud=BAUD):
        found = self.find()
        return assign_servo(
            self.port, self.kind, found, setup or self.yaw, baud, self.reported.append
        )

    def registers(self):
        return Transactions(self.port, self.kind.family)


NUMBER = {"dynamixel": (1240, 53), "feetech": (777, 353)}
"""Model number and firmware."""

ANYWHERE = [
    *((kind, *place) for kind in (DYNAMIXEL, FEETECH) for place in ((1, BAUD), (7, 115_200))),
    *((DYNAMIXEL, 1, 57_600), (FEETECH, 200, 57_600)),
    *((DYNAMIXEL, 200, baud) for baud in RATES if baud != 4_500_000),
]


@pytest.mark.parametrize(("kind", "servo_id", "baud"), ANYWHERE)
def test_a_servo_gets_its_id_and_rate_for_good_wherever_it_was(kind, servo_id, baud):
    bench = Bench(ServoSpec(servo_id, MODELS[kind.name]), baud=baud, kind=kind)
    result = bench.assign()
    assert result.before == FoundServo(servo_id, *NUMBER[kind.name], baud, bench.model)
    assert result.after == FoundServo(7, *NUMBER[kind.name], BAUD, bench.model)
    assert (f"id {servo_id} -> 7" in result.changes) == (servo_id != 7)
    assert (f"baud rate {baud} -> {BAUD} bit/s" in result.changes) == (baud != BAUD)
    assert len(result.changes) == (servo_id != 7) + (baud != BAUD)
    (servo,) = bench.chain.servos
    assert (servo.id, servo.torque) == (7, False)
    rate = bench.registers().read(7, "baud_rate")
    assert rate == kind.family.baud_rates.index(BAUD)
    bench.chain[7].restart()
    bench.sleep_until(bench.now + 1.0)
    bench.chain.refresh()
    bench.port.setBaudRate(BAUD)
    assert ping(bench.port, kind.family, 7, BAUD) is not None
    assert (
        kind.family.lock_register is None
        or bench.registers().read(7, kind.family.lock_register) == 1
    )


@each
def test_a_servo_whose_torque_is_on_is_let_go_first(kind):
    bench = Bench(kind=kind)
    bench.port.setBaudRate(bench.baud)
    assert bench.registers().write(1, "torque_enable", 1)
    assert bench.assign().changes[0] == "torque 1 -> 0"
    assert not bench.chain[7].torque


@each
@pytest.mark.parametrize(
    ("ids", "fault", "says"),
    [
        ((1,), "lose all", "no servo answers at any baud rate"),
        ((1,), "truncate all 5", "in pieces only"),
        ((1, 2), "clear", "2 servos answer: id 1 .* id 2 .*: connect"),
        ((1, 1), "clear", "alone"),
    ],
)
def test_none_pieces_and_two_servos_are_refused(kind, ids, fault, says):
    model = MODELS[kind.name]
    bench = Bench(*(ServoSpec(i, model, 1000 + 500 * n) for n, i in enumerate(ids)), kind=kind)
    bench.port.faults.command(fault)
    with pytest.raises(ServoMissing, match=says):
        bench.find()


@each
def test_another_model_is_refused_and_left_alone(kind):
    bench = Bench(kind=kind)
    before = bytes(bench.chain[1].memory.bytes[:40])
    models = {bench.model: replace(kind.family.models[bench.model], number=1029)}
    bench.kind = kind._replace(family=replace(kind.family, models=models))
    with pytest.raises(ServoMissing, match=r"this is model number \d+, neck_yaw \(servo 7\) wants"):
        bench.assign()
    assert bytes(bench.chain[1].memory.bytes[:40]) == before


@each
def test_a_servo_that_falls_silent_is_said_to_be_where_it_was(kind):
    bench = Bench(kind=kind)
    found = bench.find()
    bench.port.faults.command("lose all")
    where = f"it answered last as id 1 at {bench.baud} bit/s"
    with pytest.raises(ServoFault, match=where):
        assign_servo(bench.port, kind, found, bench.yaw._replace(id=5), bench.baud, print)


# --- Dynamixel servos, packet by packet


class StubbornPort(InProcessPort):
    """A port whose servo refuses writes to one address."""

    address = None

    def write(self, data):
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


@pytest.mark.parametrize("address", [7, 8])
def test_a_lost_confirmation_does_not_matter(address):
    class Lossy(InProcessPort):
        def write(self, data):
            super().write(data)
            if data[7] == 0x03 and data[8] == address:
                self.drain()

    bench = Bench()
    bench.port = Lossy(bench.chain)
    assert bench.assign().after == FoundServo(7, 1240, 53, BAUD, "xc330-m288")
