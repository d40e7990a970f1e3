"""The STS bus over both twins: in-process port and pseudo-terminal."""

import time
from math import nan

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from moving_bus import IDS
from present import present
from sts_rig import Rig

from gazerig.drivers.errors import ServoFault, ServoMissing
from gazerig.drivers.feetech.family import FEETECH
from gazerig.drivers.feetech.params import FeetechParams
from gazerig.drivers.serial.port import BlockingPort
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.drivers.types import ServoConfig
from gazerig.sim_mock.devices import FeetechLine
from gazerig.sim_mock.pty.client import PtyBus
from gazerig.sim_mock.smart_servo.physics import ServoSpec
from gazerig.testing.bus_bench import rows

SPECS = (
    ServoSpec(3, "sts3215", 1800),
    ServoSpec(1, "sts3215", 2048),
    ServoSpec(12, "sts3215-12v", 2300),
)
SETUPS = tuple(ServoConfig(s.id, s.model, 1000, 3000, 3000.0) for s in SPECS)
STARTS = [1800, 2048, 2300]


class Twin:
    """A bus with its port and a function that lets time pass."""

    def __init__(self, port, wait):
        self.port, self.wait = port, wait

    def bus(self, setups=SETUPS):
        # A shared machine may stall a process for longer than real servos ever wait.
        patient = FeetechParams(reply_timeout_ms=200.0, prompt_timeout_ms=200.0)
        return SmartServoBus(FEETECH, self.port, setups, patient)

    def run(self, bus, seconds, goals=None):
        end_s = self.port.now_s() + seconds
        while True:
            readings = rows(bus.read(self.port.now_s()))
            if goals is not None:
                bus.write(goals)
            if self.port.now_s() >= end_s:
                return readings
            self.wait(0.01)


@pytest.fixture(params=["in-process", "pty"])
def twin(request):
    if request.param == "in-process":
        rig = Rig(SPECS, SETUPS)
        yield Twin(rig.port, lambda s: rig.sleep_until(rig.now_s + s))
        return
    with PtyBus() as server:
        port = BlockingPort(server.start_device(FeetechLine(SPECS)))
        yield Twin(port, time.sleep)
        port.closePort()


def places(readings):
    return [None if r is None else r.position_steps for r in readings]


def test_from_open_to_close(twin):
    bus = twin.bus()
    bus.open()
    assert any("Return Delay Time 250 -> 0" in line for line in bus.events())
    before_s = twin.port.now_s()
    readings = rows(bus.read(before_s))
    assert places(readings) == STARTS
    assert all(
        before_s <= present(r).at_s <= twin.port.now_s() and present(r).measured for r in readings
    )
    assert not any(present(r).torque or present(r).fault for r in readings)
    bus.write([2000] * 3)
    assert places(twin.run(bus, 0.1)) == STARTS
    assert bus.enable_torque() == tuple(STARTS)
    assert places(twin.run(bus, 0.2)) == pytest.approx(STARTS, abs=2)
    readings = twin.run(bus, 0.8, [1900, 1900, 2200])
    assert places(readings) == pytest.approx([1900, 1900, 2200], abs=12)
    assert all(r.torque for r in readings)
    twin.run(bus, 1.2, [-5000, 99999, 999])
    assert places(rows(bus.read(twin.port.now_s()))) == pytest.approx([1000, 3000, 1000], abs=12)
    bus.disable_torque()
    readings = twin.run(bus, 0.1, [2000] * 3)
    assert places(readings) == pytest.approx([1000, 3000, 1000], abs=12)
    assert not any(r.torque for r in readings)
    assert bus.health().tx_bytes > 0 < bus.health().rx_bytes
    assert isinstance(twin.port, BlockingPort) or bus.health().errors == {}
    bus.close()
    bus.close()
    bus.open()
    bus.events()
    bus.close()


def test_open_names_every_problem_at_once_and_those_that_nobody_expects(twin):
    setups = (SETUPS[0]._replace(firmware_min=400), ServoConfig(50, "sts3215", 0, 4095, 3000.0))
    with pytest.raises(ServoMissing) as caught:
        twin.bus(setups).open()
    message = str(caught.value)
    assert "servo 3 has firmware 353, older than 400" in message
    assert "servo 50 does not answer" in message
    assert "unexpected: servo 1 (sts3215), 12 (sts3215)" in message
    assert twin.port.port_name in message
    assert "\n" not in message


def test_a_servo_of_another_model_is_named():
    rig = Rig()
    rig.chain[2].memory.set_permanently("model_number", 1540)
    rig.chain[2].memory.power_up()
    with pytest.raises(ServoMissing, match=r"jaw \(servo 2\) is model number 1540, not sts3215"):
        rig.bus.open()


def test_a_second_open_writes_nothing_to_the_servos():
    rig = Rig()
    rig.bus.open()
    rig.bus.close()
    rig.bus.events()
    rig.sent.clear()
    rig.bus.open()
    assert rig.bus.events() == ()
    # But for the order to answer, which is not kept: status level to all, lock closed.
    written = [(p[4], p[5]) for p in rig.sent if p[4] in (0x03, 0x04, 0x83)]
    assert written == [(0x83, 8)]


@pytest.mark.parametrize(("low", "high"), [(900, 3170), (999, 3001)])
def test_a_joint_outside_its_limits_comes_in_slowly(low, high):
    specs = [ServoSpec(1, "sts3215", low), ServoSpec(2, "sts3215", high)]
    setups = [ServoConfig(i, "sts3215", 1000, 3000, 3000.0) for i in (1, 2)]
    rig = Rig(specs, setups)
    rig.bus.open()
    assert rig.bus.enable_torque() == (1000, 3000)
    for _ in range(100):
        readings = rig.tick([1500, 2500])
        outside = [r for r in readings if not 1000 <= r.position_steps <= 3000]
        assert all(abs(r.velocity_steps_s) <= 30 / 360 * 4096 + 64 for r in outside)
    rig.run(0.5, [1500, 2500])
    assert rig.get(1, 46, 2) == rig.get(2, 46, 2) == 3000
    assert places(rig.tick([1500, 2500])) == pytest.approx([1500, 2500], abs=8)


def test_speed_and_acceleration_are_armed_before_the_torque():
    setups = [ServoConfig(1, "sts3215", 1000, 3000, 700.0, max_accel_steps_s2=5000.0)]
    rig = Rig([ServoSpec(1, "sts3215", 2000)], setups)
    rig.bus.open()
    rig.sent.clear()
    rig.bus.enable_torque()
    writes = [(p[5], p[8:-1]) for p in rig.sent if p[4] == 0x83]
    names = [address for address, _ in writes]
    assert names.index(41) < names.index(42) < names.index(40)
    assert dict(writes)[41] == bytes((50,))
    assert dict(writes)[42][4:] == (700).to_bytes(2, "little")
    speeds = [abs(rig.tick([3000])[0].velocity_steps_s) for _ in range(60)]
    assert 600 < max(speeds) < 760
    assert speeds[1] < 200


def test_strength_and_gains_reach_the_servo_and_outlive_a_restart():
    setup = ServoConfig(1, "sts3215", 1000, 3000, 3000.0, gains=(20, 1, 16), strength=0.4)
    rig = Rig([ServoSpec(1, "sts3215", 2000)], [setup])
    rig.bus.open()
    rig.bus.enable_torque()
    assert [rig.get(1, at) for at in (21, 22, 23)] == [20, 16, 1]
    assert rig.get(1, 48, 2) == 400
    rig.command("brown-out 1")
    rig.run(1.2, [2000])
    rig.until_all()
    assert [rig.get(1, at) for at in (21, 22, 23)] == [20, 16, 1]
    assert (rig.get(1, 48, 2), rig.get(1, 55)) == (400, 1)


def test_what_the_eeprom_must_be_is_kept_and_the_lock_closed():
    rig = Rig()
    for servo in rig.chain.servos:
        servo.memory.set_permanently("phase", 12 | 0x10)
        servo.memory.set_permanently("operating_mode", 1)
        servo.memory.power_up()
    rig.bus.open()
    for servo in rig.chain.servos:
        servo.restart()
    rig.now_s += 1.0
    for i in IDS:
        assert (rig.get(i, 9, 2), rig.get(i, 11, 2)) == (1000, 3000)
        assert (rig.get(i, 7), rig.get(i, 18), rig.get(i, 33), rig.get(i, 55)) == (0, 12, 0, 1)


def test_retune_waits_for_the_next_engage():
    rig = Rig().start()
    narrow = [s._replace(min_steps=1900, max_steps=2100) for s in rig.setups]
    rig.bus.retune(narrow)
    rig.run(0.6, [2600] * 4)
    assert rig.chain.positions_steps() == pytest.approx([2600] * 4, abs=8)
    rig.bus.disable_torque()
    assert rig.bus.enable_torque() == (2100,) * 4
    assert rig.get(1, 11, 2) == 2100
    with pytest.raises(ValueError, match="ids and models must not change"):
        rig.bus.retune(narrow[:2])


def test_a_goal_that_is_no_number_is_refused():
    rig = Rig().start()
    rig.sent.clear()
    with pytest.raises(ValueError, match="not a number"):
        rig.bus.write([2000, nan, 2000, 2000])
    with pytest.raises(ValueError, match="zip"):
        rig.bus.write([2000])
    assert rig.sent == []


def test_a_refused_torque_is_named():
    rig = Rig()
    rig.bus.open()
    rig.command("overheat 2")
    rig.now_s += 0.1
    rig.chain.positions_steps()
    with pytest.raises(ServoFault, match=r"jaw \(servo 2\): overheating: let it cool"):
        rig.bus.enable_torque()
    assert not any(servo.torque for servo in rig.chain.servos)


def test_ranges_and_numbers_that_cannot_be_are_refused():
    rig = Rig()
    for low, high in ((-1, 5), (0, 4096), (9, 8)):
        wrong = [s._replace(min_steps=low, max_steps=high) for s in rig.setups]
        with pytest.raises(ValueError, match=r"eye \(servo 1\): .* is not a range within 0..4095"):
            SmartServoBus(FEETECH, rig.port, wrong, FeetechParams())
        with pytest.raises(ValueError, match="is not a range within"):
            rig.bus.retune(wrong)
    crowd = [ServoConfig(i, "sts3215", 0, 4095, 3000.0) for i in range(36)]
    with pytest.raises(ValueError, match="36 servos are too many for one bus: 35 at most"):
        SmartServoBus(FEETECH, rig.port, crowd, FeetechParams())


GOALS = st.lists(st.integers(-(2**40), 2**40) | st.just(10**400), min_size=4, max_size=4)


@settings(max_examples=40, deadline=None)
@given(st.lists(GOALS, min_size=1, max_size=8), st.sampled_from(["", "lose 2", "brown-out 3"]))
def test_no_goal_outside_its_limits_ever_leaves(many, fault):
    rig = Rig()
    rig.bus.open()
    rig.bus.enable_torque()
    if fault:
        rig.command(fault)
    for goals in many:
        rig.tick(goals)
    packets = [p for p in rig.sent if p[4] == 0x83 and p[5] == 42]
    assert packets
    for packet in packets:
        rows = packet[7:-1]
        for k in range(0, len(rows), 7):
            assert 1000 <= int.from_bytes(rows[k + 1 : k + 3], "little") <= 3000
            assert 1 <= int.from_bytes(rows[k + 5 : k + 7], "little") <= 3000


@settings(max_examples=20, deadline=None)
@given(st.lists(st.tuples(st.integers(1, 4), st.integers(0, 167)), min_size=1, max_size=3))
def test_corrupted_answers_never_become_readings(flips):
    """The rig asserts in every tick that a value was true in it."""
    rig = Rig()
    rig.bus.open()
    rig.bus.enable_torque()
    for servo_id, bit in flips:
        rig.command(f"corrupt {servo_id} {bit} count 3")
        for _ in range(4):
            rig.tick()
    rig.until_all()


def test_with_the_bytes_time_on_the_wire_a_tick_fits_into_ten_milliseconds():
    specs = [ServoSpec(i, "sts3215", 2000) for i in range(1, 9)]
    setups = [ServoConfig(i, "sts3215", 1000, 3000, 3000.0) for i in range(1, 9)]
    rig = Rig(specs, setups, wire_time=True).start()
    for _ in range(30):
        assert None not in rig.tick([2000] * 8)
    # 8 answers of 21 bytes, now and then of 37, at 1 Mbit/s.
    assert rig.longest_s < 0.0045
    assert rig.bus.health().errors == {}
