"""Telemetry of servos of every kind: their values are shown, and nothing is written."""

from collections.abc import Callable
from dataclasses import replace
from math import pi, sin
from typing import Any, cast

import numpy as np
import pytest
from emulated_rig import EmulatedRig

from gazerig.config.schema import Rig, load_rig
from gazerig.config.tracks import load_track
from gazerig.drivers.errors import ServoFault, SetupError
from gazerig.drivers.maestro.board import MaestroParams
from gazerig.drivers.servo_bus.transaction import Transactions
from gazerig.features.bringup.cli.monitor import reader_of
from gazerig.features.bringup.hand_recording import record_hand_motion, switch_off
from gazerig.features.bringup.servo_kinds import KINDS
from gazerig.features.bringup.telemetry import (
    Monitor,
    Telemetry,
    TelemetrySample,
    smart_servo_reader,
)
from gazerig.robot.model.commands import Play
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.weight import HeadMassParams, MassParams
from gazerig.robot.run.rig_limits import bus_names, joints_on, limits, track_fit
from gazerig.robot.run.track_file import TOLERANCE_DEG, write_track
from gazerig.sim_mock.devices import DynamixelLine, FeetechLine
from gazerig.sim_mock.smart_servo.physics import ServoSpec

EYE = JointParams(1, "xl330-m077", -35.0, 35.0, 600.0, 45000.0)
NECK = JointParams(7, "xc330-m288", -35.0, 35.0, 200.0, 2000.0, sign=-1, ratio=2.0, zero_step=2000)
WRITES = {
    "dynamixel": (7, {0x03, 0x04, 0x05, 0x06, 0x08, 0x10, 0x20, 0x83, 0x93}),
    "feetech": (4, {0x03, 0x04, 0x05, 0x06, 0x08, 0x83}),
}
"""Where a packet's instruction stands, and those that change something."""


def two_servos(kind: str) -> Rig:
    """Return a rig of an eye and a geared neck on one kind of servo, and their positions."""
    joints = {"left_eye_pan": EYE, "neck_yaw": NECK}
    if kind == "feetech":
        joints = {name: replace(one, model="sts3215") for name, one in joints.items()}
    rig = load_rig("desk" if kind == "dynamixel" else "feetech")
    return replace(rig, joints={**rig.joints, **joints})


class Bench(EmulatedRig):
    """Emulated buses and what monitors them."""

    def __init__(self, rig: Rig | str) -> None:
        self.kind = rig if isinstance(rig, str) else ""
        lines = None
        if isinstance(rig, str):
            rig = two_servos(rig)
            specs = tuple(
                ServoSpec(one.id, one.model, 2100 if name == "left_eye_pan" else 1900)
                for name, one in rig.joints.items()
            )
            lines = {"": (FeetechLine if self.kind == "feetech" else DynamixelLine)(specs)}
        super().__init__(rig, lines)
        readers = {}
        for name in bus_names(rig):
            config, port = rig.bus_named(name), self.ports[name]
            port.setBaudRate(config.section.baud)
            readers[name] = reader_of(port, config, rig.joints[joints_on(rig, name)[0]].model)
        joints = {name: rig.joints[name] for name in rig.names}
        self.monitor = Monitor(readers, joints, self.clock.now_s)

    def see(self, joint: str) -> Telemetry:
        seen = self.monitor.sample().servos[joint]
        assert seen is not None
        return seen

    def registers(self) -> Transactions:
        return Transactions(self.ports[""], KINDS[self.kind].family)


each = pytest.mark.parametrize("kind", list(KINDS))


@each
def test_a_sample_says_what_the_servos_say(kind):
    bench = Bench(kind)
    bench.registers().write(1, "goal_position", 2100)
    seen = bench.monitor.sample().servos
    eye, neck = seen["left_eye_pan"], seen["neck_yaw"]
    assert eye is not None and neck is not None
    assert (eye.position_steps, eye.goal_steps) == (2100, 2100)
    assert eye.position_deg == pytest.approx((2100 - 2048) * 360 / 4096)
    assert neck.position_deg == pytest.approx((2000 - 1900) * 360 / 4096 / 2.0)
    volts = 5.0 if kind == "dynamixel" else 7.4
    assert eye.voltage_v == pytest.approx(volts, abs=0.5) and eye.temperature_c in range(15, 41)
    assert not eye.torque and eye.errors == () and eye.measured


@each
def test_nothing_is_ever_written(kind):
    bench = Bench(kind)
    servo = cast(Any, bench.devices[""]).find_servo(1)
    before = bytes(servo.memory.bytes[:56])
    bench.sent[""].clear()
    for _ in range(5):
        bench.monitor.sample()
    at, writes = WRITES[kind]
    instructions = {packet[at] for packet in bench.sent[""]}
    assert instructions and not instructions & writes
    assert bytes(servo.memory.bytes[:56]) == before


# --- boards


def test_hobby_servos_show_their_pulse_and_what_it_would_be_in_degrees(maker_rig):
    bench = Bench(maker_rig)
    limp = bench.see("eyes_pan")
    assert limp.pulse_us == 0.0 and limp.position_deg is None and not limp.torque
    bench.ports[""].write(MaestroParams(crc=maker_rig.bus.maestro.crc).targets({0: 1634 * 4}))
    bench.clock.sleep_until(0.5)
    seen = bench.see("eyes_pan")
    assert seen.pulse_us == 1634.0 and seen.position_deg == pytest.approx(10.0)
    assert seen.torque and not seen.measured
    untold = (seen.goal_deg, seen.velocity_deg_s, seen.load, seen.temperature_c, seen.voltage_v)
    assert untold == (None,) * 5


# --- A track that is recorded by hand: torque off, and the head's motion becomes its keys


class HandBench:
    """The desk rig, emulated, with a hand on its neck."""

    def __init__(self, rig: Rig) -> None:
        # Its head is balanced, so that the limp neck stays where the hand has turned it.
        balanced = MassParams(head=HeadMassParams(com_mm=(0.0, 0.0, 0.0)))
        self.rig = EmulatedRig(replace(rig, mass=balanced))
        self.port = self.rig.ports[""]
        self.port.setBaudRate(rig.bus.section.baud)
        reader = smart_servo_reader(self.port, KINDS["dynamixel"])
        self.monitor = Monitor({"": reader}, rig.joints, self.rig.clock.now_s)
        self._at: dict[str, float] = {}

    def servo(self, joint: str) -> Any:
        return cast(Any, self.rig.devices[""]).find_servo(self.rig.rig.joints[joint].id)

    def hold(self, joint: str, deg: float) -> None:
        """Turn a joint by hand by an angle from its first position."""
        joint_params = self.rig.rig.joints[joint]
        steps = joint_params.steps(np.radians(deg)) - joint_params.steps(0.0)
        self.servo(joint).turn(steps - self._at.get(joint, 0.0))
        self._at[joint] = steps

    def moved(self, how: Callable[[float], dict[str, float]]) -> Callable[[], TelemetrySample]:
        start_s = self.rig.clock.now_s()

        def sample() -> TelemetrySample:
            for joint, deg in how(self.rig.clock.now_s() - start_s).items():
                self.hold(joint, deg)
            return self.monitor.sample()

        return sample


def test_a_head_moved_by_hand_becomes_a_track_that_moves_it_so(desk_rig, tmp_path):
    bench = HandBench(desk_rig)
    switch_off(desk_rig.joints, bench.port)

    def how(t: float) -> dict[str, float]:
        up = 10.0 * sin(pi * t) ** 2 if t < 2.0 else 0.0
        return {"neck_pitch": -up, "neck_yaw": 0.4 * up}

    found = record_hand_motion(bench.moved(how), bench.rig.clock, lambda: None, 2.5)
    assert found.ended_by == "the time is over" and set(found.series) == set(desk_rig.names)
    path = tmp_path / "mine.yaml"
    on_rig = write_track(desk_rig, path, found.series, "by hand")
    track = load_track(path)
    assert len(track.frames) < 40 and on_rig.limited == ""
    motion = track_fit(desk_rig).motion(track, limits(desk_rig.joints), Play("mine"))
    at = np.linspace(0.1, 2.3, 50)
    played = np.degrees(motion.curves.sample(at)[0])
    wanted = np.array([how(t)["neck_pitch"] for t in at])
    assert np.abs(played[:, 1] - wanted).max() < TOLERANCE_DEG + 0.8
    assert np.abs(played[:, 2]).max() == 0.0  # the roll has not moved


def test_torque_that_comes_on_ends_the_recording(desk_rig):
    bench = HandBench(desk_rig)
    switch_off(desk_rig.joints, bench.port)
    left = iter(range(5))

    def sample() -> TelemetrySample:
        if next(left, None) is None:  # as another program does
            Transactions(bench.port, KINDS["dynamixel"].family).write(7, "torque_enable", 1)
        return bench.monitor.sample()

    with pytest.raises(SetupError, match="the torque of neck_yaw came on: another program"):
        record_hand_motion(sample, bench.rig.clock, lambda: None, 2.0)


def test_a_servo_that_does_not_let_go_is_named_and_all_others_are_off(desk_rig):
    bench = HandBench(desk_rig)
    registers = Transactions(bench.port, KINDS["dynamixel"].family)
    joints = desk_rig.joints
    for joint in joints.values():
        assert registers.write(joint.id, "torque_enable", 1)
    bench.rig.command("lose 1")
    with pytest.raises(ServoFault, match=r"left_eye_pan \(servo 1\): not known to have let go"):
        switch_off(joints, bench.port)
    bench.rig.command("clear")
    held = [joint.id for joint in joints.values() if registers.read(joint.id, "torque_enable")]
    assert not held
