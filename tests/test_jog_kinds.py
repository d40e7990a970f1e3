"""Moving rigs of every kind by command, over emulated buses in simulated time."""

from collections.abc import Mapping
from math import degrees
from pathlib import Path

import pytest
from mixed_rig import mixed_text

from gazerig.config.schema import Rig, load_rig
from gazerig.robot.app.bus_wiring import rig_bus
from gazerig.robot.app.emulation import emulated_lines, place_of
from gazerig.robot.app.gaze_models import gaze_parts
from gazerig.robot.app.rig_limits import limits, park_rad
from gazerig.robot.bringup.look_at import ends_reached, look_at, met
from gazerig.robot.bringup.manual_control import JogParams, ManualControl
from gazerig.robot.control.body import Body
from gazerig.robot.model.clock import SimulatedClock
from gazerig.robot.safety.guard import Guard
from gazerig.sim_mock.devices import build
from gazerig.sim_mock.in_process_port import InProcessPort

MAKER, FEETECH = load_rig("maker"), load_rig("feetech")


class Bench:
    """A rig on its emulated buses."""

    def __init__(self, rig: Rig) -> None:
        self.rig, self.clock = rig, SimulatedClock()
        self.devices = {
            name: build(line, self.clock.now_s) for name, line in emulated_lines(rig).items()
        }
        ports = {
            name: InProcessPort(device, sleep_until=self.clock.sleep_until)
            for name, device in self.devices.items()
        }
        self.ports = ports
        guard = Guard(rig.guard, limits(rig.joints), rig.names)
        body = Body(rig_bus(rig, ports), rig.joints, park_rad(rig))
        self.control = ManualControl(body, guard, self.clock, JogParams(speed_deg_s=40.0))

    def where(self) -> Mapping[str, float]:
        """Return the true joint angles in degrees."""
        return {
            name: degrees(
                joint.angle_rad(self.devices[joint.bus].positions_steps()[place_of(self.rig, name)])
            )
            for name, joint in self.rig.joints.items()
        }


@pytest.fixture
def mixed(tmp_path: Path) -> Rig:
    path = tmp_path / "mixed.yaml"
    path.write_text(mixed_text(), encoding="utf-8")
    return load_rig(str(path))


def test_hobby_servos_arrive_and_it_is_said_that_this_is_reckoned() -> None:
    bench = Bench(MAKER)
    bench.control.start()
    moved = bench.control.pose({"eyes_pan": -15.0, "left_lower_lid": 12.0})
    assert moved.arrived
    assert str(moved.of("eyes_pan")) == "eyes_pan: wished -15.0, is reckoned at -15.0 deg"
    where = bench.where()
    assert where["eyes_pan"] == pytest.approx(-15.0, abs=1.0)
    assert where["left_lower_lid"] == pytest.approx(12.0, abs=1.0)
    bench.control.stop()


def test_a_jammed_hobby_servo_cannot_be_known_so_nothing_is_called_measured() -> None:
    bench = Bench(MAKER)
    bench.control.start()
    bench.ports[""].faults.command("stick 0")
    moved = bench.control.jog("eyes_pan", 20.0)
    assert moved.arrived and moved.of("eyes_pan").reckoned
    assert bench.where()["eyes_pan"] == pytest.approx(0.0, abs=1.0)
    bench.control.stop()


def test_sts_servos_are_measured() -> None:
    bench = Bench(FEETECH)
    bench.control.start()
    moved = bench.control.jog("neck_yaw", 20.0)
    assert moved.arrived and not moved.of("neck_yaw").reckoned
    assert str(moved.of("neck_yaw")).startswith("neck_yaw: wished 20.0, is at ")
    assert bench.where()["neck_yaw"] == pytest.approx(20.0, abs=2.0)
    bench.control.stop()


def test_joints_of_three_kinds_move_together(mixed: Rig) -> None:
    bench = Bench(mixed)
    bench.control.start()
    moved = bench.control.pose({"eyes_pan": 10.0, "neck_yaw": 15.0, "neck_pitch": -5.0})
    assert moved.arrived
    reckoned = {part.joint for part in moved.joints if part.reckoned}
    assert reckoned == {name for name in mixed.names if not mixed.joints[name].facts.measured}
    where = bench.where()
    for name, angle in (("eyes_pan", 10.0), ("neck_yaw", 15.0), ("neck_pitch", -5.0)):
        assert where[name] == pytest.approx(angle, abs=2.0)
    bench.control.stop()


@pytest.mark.parametrize("point", [(1.0, 0.2, 0.2), (0.3, 0.0, 0.09)])
def test_eyes_on_one_linkage_are_judged_by_their_mean_line_of_sight(
    point: tuple[float, float, float],
) -> None:
    bench = Bench(MAKER)
    kinematics, oculomotor = gaze_parts(MAKER, 0)
    bench.control.start()
    looked = look_at(bench.control, kinematics, oculomotor, point, 2.0)
    assert not looked.converges and looked.error < 1.0
    assert looked.vergence == pytest.approx(0.0, abs=1e-6)
    # Each eye by itself is beside the point by half the vergence that it needs.
    assert max(looked.left_error, looked.right_error) == pytest.approx(
        looked.wished_vergence / 2.0, abs=1.0
    )
    words = "\n".join(met(looked))
    assert "reckoned, not measured" in words and "vergence: none, as one servo" in words
    bench.control.stop()


def test_eyes_that_cannot_turn_so_far_are_said_to_be_at_their_end() -> None:
    bench = Bench(MAKER)
    kinematics, oculomotor = gaze_parts(MAKER, 0)
    bench.control.start()
    looked = look_at(bench.control, kinematics, oculomotor, (0.2, 1.0, 0.1), 2.0)
    assert looked.error > 10.0
    assert any("eyes_pan is at the end" in line for line in ends_reached(
        MAKER.joints, {"eyes_pan": MAKER.ranges.eye_yaw_deg}, looked.moved
    ))  # fmt: skip
    bench.control.stop()


def test_separate_eyes_converge_and_are_measured() -> None:
    bench = Bench(FEETECH)
    kinematics, oculomotor = gaze_parts(FEETECH, 0)
    bench.control.start()
    looked = look_at(bench.control, kinematics, oculomotor, (0.5, 0.0, 0.14), 3.0)
    assert looked.converges and looked.error == max(looked.left_error, looked.right_error) < 2.0
    assert "reckoned" not in "\n".join(met(looked))
    bench.control.stop()


def test_a_mixed_head_looks_with_a_neck_that_is_measured_and_eyes_that_are_not(mixed: Rig) -> None:
    bench = Bench(mixed)
    kinematics, oculomotor = gaze_parts(mixed, 0)
    bench.control.start()
    looked = look_at(bench.control, kinematics, oculomotor, (1.0, 0.5, 0.1), 3.0)
    assert not looked.converges and looked.error < 2.0 and looked.head[0] > 3.0
    assert "reckoned" in met(looked)[0]
    bench.control.stop()
