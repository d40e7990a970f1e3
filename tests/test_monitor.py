"""Watching servos: what is shown is what they say, and nothing is written to them."""

import json
from dataclasses import replace
from math import radians

import pytest

from gazerig.drivers.servo_bus.registers import Registers
from gazerig.robot.bringup.monitor import Monitor, as_json
from gazerig.robot.bringup.servo_families import DYNAMIXEL
from gazerig.robot.bringup.telemetry import DynamixelLooks, look
from gazerig.robot.model.clock import SimulatedClock
from gazerig.robot.model.joint import JointParams
from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.smart_servo.physics import ServoSpec

EYE = JointParams(1, "xl330-m077", -35.0, 35.0, 600.0, 45000.0)
NECK = JointParams(7, "xc330-m288", -35.0, 35.0, 200.0, 2000.0, sign=-1, ratio=2.0, zero_step=2000)
JOINTS = {"left_eye_pan": EYE, "neck_yaw": NECK}
WRITES = {0x03, 0x04, 0x05, 0x06, 0x08, 0x10, 0x20, 0x83, 0x93}


class Bench:
    def __init__(self) -> None:
        self.clock = SimulatedClock()
        specs = [ServoSpec(1, EYE.model, 2100), ServoSpec(7, NECK.model, 1900)]
        self.chain = build_dynamixel(specs, self.clock.now_s)
        self.sent: list[bytes] = []
        self.port = InProcessPort(self.chain, self.sent.append, sleep_until=self.clock.sleep_until)
        self.port.setBaudRate(1_000_000)
        self.registers = Registers(self.port, DYNAMIXEL.family)
        self.monitor = Monitor(
            {"": DynamixelLooks(Registers(self.port, DYNAMIXEL.family, 1))}, JOINTS, self.port.now_s
        )


def test_a_sample_says_what_the_servos_say() -> None:
    bench = Bench()
    seen = bench.monitor.sample().looks
    eye, neck = seen["left_eye_pan"], seen["neck_yaw"]
    assert eye is not None and neck is not None
    assert (eye.position_steps, eye.goal_steps) == (2100, 2100)
    assert eye.position_deg == pytest.approx((2100 - 2048) * 360 / 4096)
    assert neck.position_deg == pytest.approx((2000 - 1900) * 360 / 4096 / 2.0)
    assert not eye.torque and eye.errors == () and eye.voltage_v == pytest.approx(5.0, abs=0.3)
    assert 15 <= eye.temperature_c <= 40


def test_nothing_is_ever_written() -> None:
    bench = Bench()
    before = bytes(bench.chain.here(1).memory.bytes[:116])
    bench.sent.clear()
    for _ in range(5):
        bench.monitor.sample()
    instructions = {packet[7] for packet in bench.sent}
    assert instructions and not instructions & WRITES
    assert bytes(bench.chain.here(1).memory.bytes[:116]) == before


def test_a_moving_joint_and_its_goal_are_seen() -> None:
    bench = Bench()
    bench.registers.write(7, "profile_velocity", 20)
    bench.registers.write(7, "torque_enable", 1)
    bench.registers.write(7, "goal_position", 1500)
    bench.clock.sleep_until(0.6)
    neck = bench.monitor.sample().looks["neck_yaw"]
    assert neck is not None and neck.torque
    assert neck.goal_deg == pytest.approx((2000 - 1500) * 360 / 4096 / 2.0)
    # 20 units of 0.229 rev/min towards fewer steps, sign -1, ratio 2: 13.7 deg/s upwards
    assert neck.velocity_deg_s == pytest.approx(13.7, rel=0.2)


def test_a_latched_error_is_named() -> None:
    bench = Bench()
    bench.port.faults.command("overload 7")
    bench.port.faults.command("encoder 7")
    neck = bench.monitor.sample().looks["neck_yaw"]
    assert neck is not None and set(neck.errors) == {"overload", "encoder"}
    eye = bench.monitor.sample().looks["left_eye_pan"]
    assert eye is not None and eye.errors == ()


def test_a_silent_servo_is_none_and_counted() -> None:
    bench = Bench()
    bench.port.faults.command("lose 7")
    bench.monitor.sample()
    sample = bench.monitor.sample()
    assert sample.looks["neck_yaw"] is None and sample.looks["left_eye_pan"] is not None
    assert (sample.asked, sample.unanswered) == (4, 2)
    bench.port.faults.command("clear")
    assert bench.monitor.sample().looks["neck_yaw"] is not None


def test_load_is_a_share_of_the_stall() -> None:
    assert DYNAMIXEL.driving.load("xl330-m077", -147) == pytest.approx(-0.1)
    assert DYNAMIXEL.driving.load("xl430-w250", 250) == pytest.approx(0.25)


def test_registers_are_taken_apart_at_their_places() -> None:
    live = bytearray(31)
    live[0:4] = (3000).to_bytes(4, "little")
    live[10:12] = (-147).to_bytes(2, "little", signed=True)
    live[12:16] = (-3).to_bytes(4, "little", signed=True)
    live[16:20] = (-5).to_bytes(4, "little", signed=True)
    live[28:30] = (52).to_bytes(2, "little")
    live[30] = 41
    seen = look(replace(EYE, zero_step=0, min_deg=0.0), bytes(live), True, 0x20)
    assert (seen.goal_steps, seen.position_steps) == (3000, -5)
    assert seen.load == pytest.approx(-0.1) and seen.temperature_c == 41
    assert seen.voltage_v == pytest.approx(5.2) and seen.errors == ("overload",)
    assert radians(seen.velocity_deg_s) < 0.0


def test_a_sample_is_a_line_of_json() -> None:
    bench = Bench()
    bench.port.faults.command("lose 7")
    read = json.loads(json.dumps(as_json(bench.monitor.sample(), 0.0)))
    assert read["joints"]["neck_yaw"] is None
    assert read["joints"]["left_eye_pan"]["position_steps"] == 2100
