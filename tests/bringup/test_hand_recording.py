"""A gesture that is recorded by hand: torque off, and the head's motion becomes its keys."""

from collections.abc import Callable
from math import pi, sin
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from emulated_rig import EmulatedRig
from typer.testing import CliRunner

from gazerig.config.gestures import load_gesture
from gazerig.config.schema import load_rig
from gazerig.drivers.errors import ServoFault, SetupError
from gazerig.drivers.servo_bus.registers import Registers
from gazerig.features.bringup.cli.record_gesture import app
from gazerig.features.bringup.hand_recording import record, switch_off
from gazerig.features.bringup.servo_families import KINDS
from gazerig.features.bringup.telemetry import Monitor, SmartServoTelemetry, TelemetrySample
from gazerig.robot.app.gesture_file import TOLERANCE_DEG, gesture_text, write_gesture
from gazerig.robot.model.gesture_fit import motions

DESK = load_rig("desk")


class Bench:
    """The desk rig, emulated, with a hand on its neck."""

    def __init__(self) -> None:
        self.rig = EmulatedRig(DESK)
        self.port = self.rig.ports[""]
        self.port.setBaudRate(DESK.bus.baud)
        joints = {name: DESK.joints[name] for name in DESK.names}
        reader = SmartServoTelemetry(self.port, KINDS["dynamixel"])
        self.monitor = Monitor({"": reader}, joints, self.rig.clock.now_s)
        self._at: dict[str, float] = {}

    def servo(self, joint: str) -> Any:
        return cast(Any, self.rig.devices[""]).here(DESK.joints[joint].id)

    def hold(self, joint: str, deg: float) -> None:
        """Turn a joint by hand to an angle from where it was at first."""
        joint_params = DESK.joints[joint]
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


def test_a_head_moved_by_hand_becomes_a_gesture_that_moves_it_so(tmp_path: Path) -> None:
    bench = Bench()
    switch_off(DESK.joints, bench.port)

    def how(t: float) -> dict[str, float]:
        up = 10.0 * sin(pi * t) ** 2 if t < 2.0 else 0.0
        return {"neck_pitch": -up, "neck_yaw": 0.4 * up}

    found = record(bench.moved(how), bench.rig.clock, lambda: None, 2.5)
    assert found.ended_by == "the time is over" and set(found.series) == set(DESK.names)
    path, fitted = write_gesture(
        DESK, "mine", gesture_text(DESK, found.series, "by hand"), tmp_path, False
    )
    gesture = load_gesture(path)
    assert gesture.space == "joint" and len(gesture.frames) < 40
    assert fitted.slowed_by == 1.0
    motion = motions(gesture, DESK.names).motion
    at = np.linspace(0.1, 2.3, 50)
    played = np.degrees(motion.sampled(at).value)
    wanted = np.array([how(t)["neck_pitch"] for t in at])
    assert np.abs(played[:, 1] - wanted).max() < TOLERANCE_DEG + 0.8
    assert np.abs(played[:, 2]).max() == 0.0  # the roll has not moved


def test_torque_that_comes_on_ends_the_recording() -> None:
    bench = Bench()
    switch_off(DESK.joints, bench.port)
    left = iter(range(5))

    def sample() -> TelemetrySample:
        if next(left, None) is None:  # as another program does
            Registers(bench.port, KINDS["dynamixel"].family).write(7, "torque_enable", 1)
        return bench.monitor.sample()

    with pytest.raises(SetupError, match="the torque of neck_yaw came on: another program"):
        record(sample, bench.rig.clock, lambda: None, 2.0)


def test_a_servo_that_does_not_let_go_is_named_and_all_others_are_off() -> None:
    bench = Bench()
    registers = Registers(bench.port, KINDS["dynamixel"].family)
    for joint in DESK.joints.values():
        assert registers.write(joint.id, "torque_enable", 1)
    bench.rig.command("lose 1")
    with pytest.raises(ServoFault, match=r"left_eye_pan \(servo 1\): not known to have let go"):
        switch_off(DESK.joints, bench.port)
    bench.rig.command("clear")
    held = [joint.id for joint in DESK.joints.values() if registers.read(joint.id, "torque_enable")]
    assert not held


def test_hobby_servos_and_a_closed_input_are_refused_before_anything_moves(tmp_path: Path) -> None:
    run = CliRunner()
    hobby = run.invoke(app, ["maker", "mine", "--mock", "--yes"])
    assert hobby.exit_code != 0 and "hobby servos do not report their position" in hobby.stderr
    unsaid = run.invoke(app, ["desk", "mine", "--mock", "--folder", str(tmp_path)])
    assert unsaid.exit_code != 0 and "goes off and stays off" in unsaid.stderr
    assert "hold it and say --yes" in unsaid.stderr
