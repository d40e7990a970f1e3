"""Joints that have no torque while they are idle: policy, every kind of bus, and all exits."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

import gazerig
from gazerig.config.load import ConfigError, shipped_path
from gazerig.config.schema import load_rig
from gazerig.robot.loop.limp_joints import LimpJoints

BUSES = {
    "dynamixel": ("{kind: dynamixel, port: /dev/ttyUSB0}", "xl330-m077", "gains: [1200, 0, 12000]"),
    "feetech": ("{kind: feetech, port: /dev/ttyUSB0}", "sts3215", "gains: [32, 0, 64]"),
    "maestro": (
        "{kind: maestro, port: /dev/ttyACM0, maestro: {channels: 12}}", "hobby", "servo_speed_deg_s: 600",
    ),
    "pca9685": ("{kind: pca9685, port: /dev/i2c-1}", "hobby", "servo_speed_deg_s: 600"),
}  # fmt: skip
SMART = ("dynamixel", "feetech")


def rig_file(kind: str, folder: Path, limp: str = "limp_when_idle_s: 1.0") -> str:
    """Write the minimal rig with a jaw on a kind of bus."""
    bus, model, more = BUSES[kind]
    text = shipped_path("rigs", "minimal").read_text()
    for old, new in zip(BUSES["dynamixel"], (bus, model, more), strict=True):
        text = text.replace(old, new)
    jaw = f"""  jaw: {{id: 3, model: {model}, min_deg: -2, max_deg: 25, max_speed_deg_s: 300, max_accel_deg_s2: 12000, {more}, {limp}}}
levels:
  mouth: {{joint: jaw, low_deg: 0, high_deg: 12}}
"""
    path = folder / f"{kind}.yaml"
    path.write_text(text.replace("# position_mm:", f"{jaw}# position_mm:"))
    return str(path)


class Jaw(NamedTuple):
    """A simulated head, its jaw, and its emulated servos."""

    head: Any

    @property
    def now(self) -> Any:
        return self.head.state.joints["jaw"]

    @property
    def bus(self) -> Any:
        return self.head._composed.assembly.robot.body.bus

    def emulate(self, command: str) -> str:
        return str(self.bus._port.faults.command(command))

    def open_wide(self) -> list[float]:
        """Open the mouth; return the measured angles."""
        found = []
        for _ in range(40):
            self.head.level("mouth", 0.5)
            self.head.step(0.01)
            found.append(self.now.measured_deg)
        return found


@pytest.fixture(params=BUSES)
def kind(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def jaw(kind: str, tmp_path: Path) -> Iterator[Jaw]:
    lines: list[str] = []
    with gazerig.open(rig_file(kind, tmp_path), fast=True, say=lines.append) as head:
        head.step(2.5)
        yield Jaw(head)
    assert not [line for line in lines if "restarted" in line or "held" in line], lines


def test_an_idle_jaw_is_limp_and_moves_again_without_a_jump(jaw: Jaw, kind: str) -> None:
    assert jaw.now.torque is False and jaw.now.limited == "limp"
    state = jaw.head.state
    assert state.reasons == () and state.joints["eyes_pan"].torque is True
    smart = kind in SMART
    moved = jaw.emulate("turn 3 80")  # a hand opens it, in steps of the servo
    assert "turned" in moved
    jaw.head.step(0.2)
    before = jaw.now.measured_deg
    assert (abs(before) > 2.0) == smart and jaw.now.limited == "limp"
    found = jaw.open_wide()
    steps = [abs(b - a) for a, b in zip([before, *found], found, strict=False)]
    assert max(steps) < 3.3  # 300 deg/s
    assert jaw.now.torque is True and jaw.now.limited == ""
    assert found[-1] == pytest.approx(6.0, abs=0.5) and found[5] > 2.0  # at the usual speed
    jaw.head.step(2.0)
    assert jaw.now.limited == "limp"


def test_a_stop_and_a_resume_of_a_limp_jaw(jaw: Jaw) -> None:
    jaw.head.stop("a hand")
    jaw.head.step(2.1)
    assert not any(one.torque for one in jaw.head.state.joints.values())
    assert jaw.now.limited == "stopped"
    jaw.head.resume(confirmed=True)
    jaw.head.step(0.5)
    assert all(one.torque for one in jaw.head.state.joints.values())
    jaw.head.step(2.0)
    assert jaw.now.limited == "limp"


@pytest.mark.parametrize("stopped", [False, True])
def test_at_every_end_no_servo_has_torque(kind: str, stopped: bool, tmp_path: Path) -> None:
    with gazerig.open(rig_file(kind, tmp_path), fast=True) as head:
        head.step(2.5)
        it = Jaw(head)
        it.emulate("turn 3 80")
        head.step(0.1)
        assert it.now.limited == "limp"
        port = it.bus._port
        if stopped:
            head.stop("at the end")
            head.step(0.1)
    status = json.loads(port.faults.command("status"))
    found = status["servos"]
    if kind in SMART and not stopped:  # it has parked
        assert abs(next(one["position"] for one in found if one["id"] == 3) - 2048) < 20
    assert not [one for one in found if one.get("torque") or one.get("target")]


def test_the_policy() -> None:
    joints = LimpJoints((None, 1.0))
    assert not joints.step((0.0, 0.0), (True, True), 0.0, False)
    assert joints.step((0.5, 0.0), (True, True), 1.0, False) and joints.limp == {1}
    assert not joints.step((0.5, 0.0), (True, False), 2.0, False)
    assert joints.step((0.5, 0.1), (True, False), 3.0, False) and not joints.limp
    joints.step((0.0, 0.0), (True, True), 4.0, False)
    assert joints.step((0.0, 0.0), (True, True), 5.0, False)
    assert joints.step((0.0, 0.0), (True, True), 5.1, False) and not joints.limp  # set up again
    assert not joints.step((0.0, 0.0), (True, True), 5.2, True)
    joints.step((0.0, float("nan")), (True, True), 9.0, False)
    assert not joints.limp


@pytest.mark.parametrize("joint", ["neck_pitch", "left_eye_pan"])
def test_other_joints_are_refused(joint: str, tmp_path: Path) -> None:
    text = shipped_path("rigs", "nine_xl330").read_text()
    begin = text.index(f"  {joint}:")
    at = text.index("{", begin) + 1
    path = tmp_path / "rig.yaml"
    path.write_text(f"{text[:at]}limp_when_idle_s: 1.0, {text[at:]}")
    with pytest.raises(
        ConfigError, match=rf"{joint}.limp_when_idle_s: remove it: only a further joint"
    ):
        load_rig(str(path))


def test_a_warm_jaw_is_reported_once(tmp_path: Path) -> None:
    lines: list[str] = []
    with gazerig.open(rig_file("feetech", tmp_path), fast=True, say=lines.append) as head:
        head.step(2.0)
        Jaw(head).emulate("temperature 3 60")
        head.step(3.0)
    found = [line for line in lines if "warm" in line]
    assert len(found) == 1 and "jaw is warm, " in found[0] and "stops at" in found[0], lines
