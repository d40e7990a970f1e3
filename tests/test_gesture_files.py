"""Gestures from tables of animation programs, and recorded by hand from emulated servos."""

from collections.abc import Callable
from math import pi, sin
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from emulated_rig import EmulatedRig
from typer.testing import CliRunner

from gazerig.config.allowed_folder import AllowedFolder
from gazerig.config.gestures import load_gesture
from gazerig.config.load import ConfigError
from gazerig.config.schema import load_rig
from gazerig.drivers.errors import ServoFault, SetupError
from gazerig.drivers.servo_bus.registers import Registers
from gazerig.gaze.gesture.minimum_jerk_curve import MinimumJerkCurve
from gazerig.robot.app.gesture_file import TOLERANCE_DEG, gesture_text, write_gesture
from gazerig.robot.bringup.hand_recording import record, switch_off
from gazerig.robot.bringup.key_frame_table import read_table
from gazerig.robot.bringup.key_frames import fitted_keys, smoothed
from gazerig.robot.bringup.monitor import Monitor, TelemetrySample
from gazerig.robot.bringup.servo_families import KINDS
from gazerig.robot.bringup.telemetry import SmartServoTelemetry
from gazerig.robot.cli.gestures import app
from gazerig.robot.model.gesture_fit import motions

DESK = load_rig("desk")


def table(folder: Path, text: str) -> Path:
    path = folder / "table.csv"
    path.write_text(text, encoding="utf-8")
    return path


WIDE = "time,neck_pitch,neck_yaw\n0,0,5\n0.5,-8,\n1.0,0,9\n"
LONG = "joint;time_s;angle\nneck_pitch;0;0\nneck_yaw;0;5\nneck_pitch;.5;-8\nneck_yaw;1;9\nneck_pitch;1;0\n"
FRAMES = "frame\tneck_pitch\tneck_yaw\n0\t0\t5\n12\t-8\t\n24\t0\t9\n"


@pytest.mark.parametrize("text", [WIDE, LONG, FRAMES])
def test_wide_and_long_tables_and_frame_numbers_are_the_same_gesture(
    text: str, tmp_path: Path
) -> None:
    found = gesture_text(DESK, read_table(table(tmp_path, text), 24.0), "x")
    path, fitted = write_gesture(DESK, "mine", found, tmp_path, False)
    assert [(f.time_s, f.head_pitch_deg, f.head_yaw_deg) for f in load_gesture(path).frames] == [
        (0.5, -8.0, None),
        (1.0, 0.0, 4.0),
    ]
    assert fitted.slowed_by == 1.0 and fitted.played.duration_s == pytest.approx(1.4)


BAD = {
    "": ":1: no column of times",
    "when,neck_yaw\n0,1\n": ":1: no column of times",
    "frame,neck_yaw\n0,1\n": "give --fps",
    "time,neck_yaw\n0,1\n0.5\n": ":3: has 1 columns, and the first row names 2",
    "time,neck_yaw\n0,1\n0.5,left\n": ":3: neck_yaw: 'left' is no number",
    "time,neck_yaw\n0,1\n0.5,nan\n": ":3: neck_yaw: 'nan' is no number",
    "time,neck_yaw\n0,1\n0.5,2\n0.4,3\n": ":4: neck_yaw: 0.4 s is not after 0.5 s",
    "time,neck_yaw\n-1,1\n": ":2: time -1 is before 0",
    "time,neck_yaw\n": "no rows",
    "time,tail\n0,1\n1,5\n": "no joint 'tail'; there is left_eye_pan",
    "time,neck_yaw\n0,1\n1,1\n": "nothing moves",
    "time,neck_yaw\n0,1\n99,5\n": "a gesture takes at most 60 s",
}


@pytest.mark.parametrize("text", BAD)
def test_bad_rows_are_named_with_their_line(text: str, tmp_path: Path) -> None:
    with pytest.raises(SetupError) as caught:
        gesture_text(DESK, read_table(table(tmp_path, text), None), "x")
    assert BAD[text] in str(caught.value)


def test_all_bad_rows_are_named_at_once(tmp_path: Path) -> None:
    rows = "\n".join(f"{t},x" for t in range(15))
    with pytest.raises(SetupError) as caught:
        read_table(table(tmp_path, f"time,neck_yaw\n{rows}\n"), None)
    assert str(caught.value).count("is no number") == 10 and "and 5 more" in str(caught.value)


def test_the_command_imports_a_table_for_a_rig(tmp_path: Path) -> None:
    path = table(tmp_path, WIDE)
    words = ["import-gesture", "desk", str(path), "greet", "--folder", str(tmp_path)]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0 and "greet.yaml: 1.4 s on desk" in done.stderr
    again = CliRunner().invoke(app, words)
    assert again.exit_code != 0 and "--force" in again.stderr
    wrong = CliRunner().invoke(app, [*words[:3], "Greet!", "--folder", str(tmp_path)])
    assert wrong.exit_code != 0 and "small letters" in wrong.stderr


def test_a_motion_sampled_densely_becomes_few_keys_within_the_tolerance() -> None:
    random = np.random.default_rng(3)
    times = np.cumsum(random.uniform(0.015, 0.025, 200))
    truth = 12.0 * np.sin(2 * pi * 0.6 * times) * np.minimum(1.0, times)
    even, smooth = smoothed(times, truth + random.normal(0.0, 0.15, 200))
    found, values = fitted_keys(even, smooth, TOLERANCE_DEG)
    assert 4 <= len(found) <= 30
    curve = MinimumJerkCurve(float(smooth[0]), found.tolist(), values.tolist())
    assert np.abs(curve.sampled(even)[0] - smooth).max() <= TOLERANCE_DEG
    assert np.abs(curve.sampled(times - times[0])[0] - truth).max() < TOLERANCE_DEG + 0.6
    still = fitted_keys(even, np.full(len(even), 3.0), TOLERANCE_DEG)
    assert len(still[0]) == 0


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
    hobby = run.invoke(app, ["record-gesture", "maker", "mine", "--mock", "--yes"])
    assert hobby.exit_code != 0 and "hobby servos do not tell where they are" in hobby.stderr
    unsaid = run.invoke(
        app, ["record-gesture", "desk", "mine", "--mock", "--folder", str(tmp_path)]
    )
    assert unsaid.exit_code != 0 and "goes off and stays off" in unsaid.stderr
    assert "hold it and say --yes" in unsaid.stderr


def test_a_page_names_gesture_files_in_its_folder_alone(tmp_path: Path) -> None:
    folder = AllowedFolder(tmp_path)
    folder.changes({"gesture_files": [str(tmp_path / "mine.yaml")]})
    with pytest.raises(ConfigError, match="gesture_files"):
        folder.changes({"gesture_files": [str(tmp_path / "mine.yaml"), "/etc/passwd.yaml"]})
