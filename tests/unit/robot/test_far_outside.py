"""A joint far outside its range gets no torque at the start, unless its recovery is requested."""

from collections.abc import Mapping
from dataclasses import replace
from math import degrees, radians

import pytest
from command_line import typed
from true_shafts import Bench

import gazerig
from gazerig.config.rig import Rig
from gazerig.config.schema import load_rig
from gazerig.drivers.errors import ServoMissing, SetupError
from gazerig.robot.run import emulated

EYE = "left_eye_pan"
FAR = 176.0
SAID = "left_eye_pan is at 176 deg, 141 deg outside its range -35..35 deg: a slipped horn, "
Terminal = pytest.CaptureFixture[str]


def place(patch: pytest.MonkeyPatch, angles_deg: Mapping[str, float]) -> None:
    """Let emulated servos begin at these joint angles, with stops far outside the ranges."""
    patch.setattr(emulated, "_CROOKED_DEG", angles_deg)
    patch.setattr(emulated, "STOP_BEYOND_DEG", 150.0)


def rig_of(name: str) -> Rig:
    """Return a shipped rig, or the desk's with the eye on a bus of its own."""
    if name != "two buses":
        return load_rig(name)
    rig = load_rig("desk")
    joints = {**rig.joints, EYE: replace(rig.joints[EYE], bus="eye")}
    return replace(rig, buses={"eye": rig.bus}, joints=joints)


@pytest.fixture
def slipped(monkeypatch) -> None:
    place(monkeypatch, {EYE: FAR})


class FarBench(Bench):
    """A bench whose desired angles are 0, and what it said of its recovery."""

    def __init__(self, rig: Rig, recover: bool = False) -> None:
        self.said = list[str]()
        super().__init__(rig, recover=self.said.append if recover else None)
        self.shafts.looking = False

    def angle_deg(self) -> float:
        """Return where the eye truly is."""
        return degrees(self.shafts.truth()[self.names.index(EYE)])

    def run(self, seconds: float) -> list[float]:
        """Run; return the true angle of the eye in every tick."""
        angles = []
        for _ in range(round(seconds / self.period_s)):
            self.tick((0.0,) * len(self.names))
            angles.append(self.angle_deg())
        return angles

    def command(self, text: str) -> None:
        self.shafts.devices[""].faults.command(text)


@pytest.mark.parametrize("rig", ["desk", "feetech", "two buses"])
@pytest.mark.usefixtures("slipped")
def test_no_servo_of_the_rig_gets_torque(rig):
    bench = FarBench(rig_of(rig))
    with pytest.raises(SetupError, match=SAID) as refused:
        bench.start()
    assert "gazerig doctor" in str(refused.value) and "\n" not in str(refused.value)
    assert not any(
        servo.torque if hasattr(servo, "torque") else servo.drive.torque
        for device in bench.shafts.devices.values()
        for servo in device.servos  # type: ignore[attr-defined]
    )
    assert bench.angle_deg() == pytest.approx(FAR, abs=0.2)


@pytest.mark.parametrize("rig", ["feetech", "two buses"])
@pytest.mark.usefixtures("slipped")
def test_on_request_it_moves_inside_slowly_and_the_run_goes_on(rig):
    bench = FarBench(rig_of(rig), recover=True)
    bench.start()
    angles = bench.run(7.0)
    assert bench.said == [
        f"{SAID}a changed homing offset or extended position mode? It moves slowly into its range",
    ]
    # Mean speeds over 0.2 s: the emulated motor runs unevenly.
    ways = [abs(b - a) for a, b in zip(angles, angles[40:], strict=False) if b > 35.0]
    assert max(ways) / (40 * bench.period_s) < 1.2 * 30.0
    assert abs(angles[-1]) < 1.0


def test_a_joint_a_little_outside_moves_inside_without_request(monkeypatch):
    place(monkeypatch, {EYE: 44.0})
    bench = FarBench(load_rig("feetech"))
    bench.start()
    assert abs(bench.run(3.0)[-1]) < 1.0


@pytest.mark.parametrize("rig", ["desk", "feetech"])
def test_a_servo_that_restarts_far_outside_stays_limp_until_it_is_turned_back(rig, monkeypatch):
    place(monkeypatch, {})
    bench = FarBench(load_rig(rig))
    bench.start()
    bench.run(1.5)
    joint = bench.rig.joints[EYE]
    far = round(joint.steps(radians(FAR)) - joint.steps(0.0))
    bench.command(f"brown-out {joint.id}")
    bench.command(f"turn {joint.id} {far}")
    angles = bench.run(2.0)
    assert angles[-1] > 100.0 and max(angles) - min(angles[20:]) < 1.0
    (fault,) = bench.body.bus.faults()
    assert "far outside its range" in fault and "a slipped horn" in fault
    assert not bench.joints.torque[0] and all(bench.joints.torque[1:])
    bench.command(f"turn {joint.id} {-far}")
    assert abs(bench.run(2.0)[-1]) < 1.0
    assert bench.body.bus.faults() == () and all(bench.joints.torque)


def test_a_stop_holds_when_a_hand_has_turned_a_joint_far_outside(monkeypatch):
    place(monkeypatch, {})
    bench = FarBench(load_rig("desk"))
    bench.start()
    bench.run(0.5)
    bench.body.disable_torque()
    joint = bench.rig.joints[EYE]
    bench.command(f"turn {joint.id} {round(joint.steps(radians(60.0)) - joint.steps(0.0))}")
    bench.run(0.1)
    with pytest.raises(SetupError, match="25 deg outside its range"):
        bench.body.enable_torque()


@pytest.mark.usefixtures("slipped")
def test_a_servo_without_a_position_is_not_taken_for_one_inside():
    bench = FarBench(load_rig("desk"))
    opened = bench.body.bus.open

    def open_and_lose() -> None:
        opened()
        bench.command("lose 1")

    bench.body.bus.open = open_and_lose  # type: ignore[method-assign]
    with pytest.raises(ServoMissing, match=f"no position from {EYE}"):
        bench.start()


@pytest.mark.parametrize("bus", ["ideal", "emulated"])
@pytest.mark.usefixtures("slipped")
def test_the_command_is_refused_in_one_line_and_recovers_on_request(bus, capfd):
    words = (
        "run",
        "desk",
        "--mock",
        "--fast",
        "--bus",
        bus,
        "--no-page",
        "--seconds",
        "6",
        "--rate",
        "50",
    )
    assert typed(*words) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert line.startswith(SAID) and "gazerig doctor desk --mock" in line
    assert "gazerig run desk --mock --recover" in line
    assert typed(*words, "--recover") == 0
    said = capfd.readouterr().err
    assert SAID in said


@pytest.mark.usefixtures("slipped")
def test_the_doctor_says_the_same(capfd):
    pytest.importorskip("gazerig.features.bringup")
    assert typed("doctor", "desk", "--mock") == 1
    said = capfd.readouterr().out
    assert f"left_eye_pan (servo 1): {SAID.removeprefix(f'{EYE} ')}" in said
    assert "gazerig calibrate desk --mock --joint left_eye_pan" in said
    assert "is at step" not in said


@pytest.mark.usefixtures("slipped")
def test_a_head_of_a_program_has_the_same_rule():
    for head in (gazerig.open("desk", fast=True), gazerig.open("desk", mock=True, bus="ideal")):
        with pytest.raises(SetupError, match=SAID), head:
            pass
