"""Watching servos of every kind: what is shown is what they say, and nothing is written."""

import json
from math import degrees
from pathlib import Path

import pytest
from mixed_rig import mixed_text

from gazerig.config.schema import Rig, load_rig
from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.feetech.family import FEETECH as STS
from gazerig.drivers.maestro.commands import Speech
from gazerig.drivers.servo_bus.registers import Registers
from gazerig.robot.app.bus_wiring import bus_names
from gazerig.robot.app.emulation import emulated_lines
from gazerig.robot.bringup.monitor import Monitor, as_json
from gazerig.robot.bringup.telemetry import (
    DynamixelLooks,
    FeetechLooks,
    Look,
    MaestroLooks,
    look_at_pulse,
)
from gazerig.robot.model.clock import SimulatedClock
from gazerig.sim_mock.devices import build
from gazerig.sim_mock.in_process_port import InProcessPort

FEETECH, MAKER = load_rig("feetech"), load_rig("maker")
STS_WRITES = {0x03, 0x04, 0x05, 0x06, 0x08, 0x83}
GET_POSITION = 0x90


class Bench:
    """A rig's emulated buses, and what is sent to each."""

    def __init__(self, rig: Rig) -> None:
        self.clock = SimulatedClock()
        lines = emulated_lines(rig)
        self.devices = {name: build(line, self.clock.now_s) for name, line in lines.items()}
        self.sent: dict[str, list[bytes]] = {name: [] for name in lines}
        self.ports = {
            name: InProcessPort(device, self.sent[name].append, sleep_until=self.clock.sleep_until)
            for name, device in self.devices.items()
        }
        looks = {}
        for name in bus_names(rig):
            config, port = rig.bus_named(name), self.ports[name]
            port.setBaudRate(config.baud)
            if config.kind == "maestro":
                looks[name] = MaestroLooks(port, config.maestro)
            elif config.kind == "feetech":
                looks[name] = FeetechLooks(Registers(port, STS, 1))
            else:
                looks[name] = DynamixelLooks(Registers(port, DYNAMIXEL, 1))
        joints = {name: rig.joints[name] for name in rig.names}
        self.monitor = Monitor(looks, joints, self.clock.now_s)

    def see(self, joint: str) -> Look:
        seen = self.monitor.sample().looks[joint]
        assert seen is not None
        return seen


def test_sts_servos_tell_all_and_nothing_is_written() -> None:
    bench = Bench(FEETECH)
    registers = Registers(bench.ports[""], STS)
    registers.write(7, "goal_speed", 300)
    registers.write(7, "goal_position", 1500)
    registers.write(7, "torque_enable", 1)
    bench.clock.sleep_until(0.6)
    bench.sent[""].clear()
    neck = bench.see("neck_yaw")
    assert neck.torque and neck.measured and neck.errors == ()
    assert neck.goal_deg == pytest.approx((1500 - 2048) * 360 / 4096)
    assert neck.velocity_deg_s == pytest.approx(-300 * 360 / 4096, rel=0.2)
    assert neck.voltage_v == pytest.approx(7.4, abs=0.5) and neck.temperature_c in range(15, 41)
    assert not {packet[4] for packet in bench.sent[""]} & STS_WRITES
    bench.ports[""].faults.command("overload 7")
    assert bench.see("neck_yaw").errors == ("overload",)
    assert bench.see("left_eye_pan").errors == ()


def test_hobby_servos_show_their_pulse_and_what_it_would_be_in_degrees() -> None:
    bench = Bench(MAKER)
    limp = bench.see("eyes_pan")
    assert limp.pulse_us == 0.0 and limp.position_deg is None and not limp.torque
    bench.ports[""].write(Speech(crc=MAKER.bus.maestro.crc).target(0, 1634 * 4))
    bench.clock.sleep_until(0.5)
    seen = bench.see("eyes_pan")
    assert seen.pulse_us == 1634.0 and seen.position_deg == pytest.approx(10.0)
    assert seen.torque and not seen.measured
    assert (seen.goal_deg, seen.velocity_deg_s, seen.load, seen.temperature_c, seen.voltage_v) == (
        None,
    ) * 5


def test_a_board_is_asked_for_pulses_alone_and_keeps_its_errors() -> None:
    bench = Bench(MAKER)
    bench.ports[""].faults.command("error protocol")
    bench.sent[""].clear()
    for _ in range(3):
        assert bench.monitor.sample().unanswered == 0
    assert {packet[0] for packet in bench.sent[""]} == {GET_POSITION}
    told = json.loads(bench.ports[""].faults.command("status"))
    assert told["errors"] == ["protocol"]


def test_a_board_that_waits_for_the_first_byte_of_the_pololu_form_is_woken_by_a_question() -> None:
    bench = Bench(MAKER)
    bench.ports[""].faults.command("lose all count 1")
    assert bench.monitor.sample().looks["eyes_pan"] is None
    bench.sent[""].clear()
    assert bench.see("eyes_tilt").pulse_us == 0.0
    pololu = [packet for packet in bench.sent[""] if packet[0] == 0xAA]
    assert pololu and all(packet[2] == GET_POSITION & 0x7F for packet in pololu)


def test_an_input_is_no_servo() -> None:
    seen = look_at_pulse(MAKER.joints["eyes_pan"], 700)
    assert seen.errors == ("its channel is an input",) and seen.pulse_us is None


def test_a_rig_of_three_kinds_is_one_sample(tmp_path: Path) -> None:
    path = tmp_path / "mixed.yaml"
    path.write_text(mixed_text(), encoding="utf-8")
    rig = load_rig(str(path))
    bench = Bench(rig)
    bench.ports["tilt"].faults.command("lose 1")
    told = json.loads(json.dumps(as_json(bench.monitor.sample(), 0.0)))
    assert set(told["joints"]) == set(rig.names)
    assert told["joints"]["neck_pitch"] is None and told["unanswered"] == 1
    pan, yaw = told["joints"]["eyes_pan"], told["joints"]["neck_yaw"]
    assert pan["measured"] is False and pan["pulse_us"] == 0.0 and pan["load"] is None
    assert yaw["measured"] is True and "pulse_us" not in yaw
    start = emulated_lines(rig)["neck"].servos[0].start_steps
    assert yaw["position_deg"] == pytest.approx(
        degrees(rig.joints["neck_yaw"].angle_rad(start)), abs=0.2
    )
