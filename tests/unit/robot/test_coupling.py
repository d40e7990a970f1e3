"""Two servos that move two joints together: geometry, servo limits, feedback, and a run."""

from dataclasses import replace
from math import degrees, inf, radians
from typing import Any
from unittest.mock import Mock

import pytest
from command_line import invoked
from expressive_rig import faults
from fakes.runs import ticks

from gazerig.config.load import shipped_path
from gazerig.config.rig import Rig
from gazerig.config.schema import load_rig
from gazerig.drivers.types import Feedback
from gazerig.robot.loop.body import CoupledServos
from gazerig.robot.model.commands import Jog
from gazerig.robot.model.coupling import CouplingParams
from gazerig.robot.model.weight import HeadMassParams, MassParams
from gazerig.robot.run.rig_limits import servo_configs

PITCH, ROLL = 35.0, 25.0
COUPLING = CouplingParams("neck_pitch", "neck_roll", 1.5, 1.2)


def rig_with(coupling: CouplingParams) -> Rig:
    # With a balanced head goals have no part that makes up for its weight.
    balanced = MassParams(head=HeadMassParams(com_mm=(0.0, 0.0, 0.0)))
    return replace(load_rig("desk"), couplings={"neck": coupling}, mass=balanced)


@pytest.mark.parametrize(
    ("coupling", "said"),
    [
        (replace(COUPLING, first_ratio=5.0),
         "the servo of neck_pitch would be at -284, outside the servo's 0..4095 steps"),
        (replace(COUPLING, first="nek_pitch"), "no joint 'nek_pitch'; did you mean 'neck_pitch'? available: left"),
    ],
)  # fmt: skip
def test_a_range_that_the_servos_cannot_do_is_refused_with_its_corner(coupling, said):
    (fault,) = faults(rig_with(coupling))
    assert fault.startswith("couplings.neck") and said in fault


def test_servos_get_the_limits_that_the_whole_range_needs():
    rig = rig_with(COUPLING)
    setups = dict(zip(rig.names, servo_configs(rig), strict=True))
    corners = [
        COUPLING.servo_rad((radians(pitch), radians(roll)))
        for pitch in (-PITCH, 0.0, PITCH)
        for roll in (-ROLL, 0.0, ROLL)
    ]
    for name, angles in zip(COUPLING.joints, zip(*corners, strict=True), strict=True):
        steps = [*map(rig.joints[name].steps, angles)]
        needed = pytest.approx((min(steps), max(steps)), abs=2.0)
        assert (setups[name].min_steps, setups[name].max_steps) == needed


def test_a_coupling_of_a_joint_with_itself_is_refused():
    with pytest.raises(ValueError, match="give two different joints"):
        CouplingParams("jaw", "jaw")


def answered(**changes: object) -> Feedback:
    whole = Feedback(
        (0.0, 1.0, 2.0), (0.0, 0.0, 0.0), (0.0, -0.4, 0.1), (5.0, 5.0, 4.9), (30, 30, 30),
        (5.0, 5.0, 5.0), (True, True, True), ("", "", ""), (True,) * 3, (False,) * 3, (),
    )  # fmt: skip
    return whole._replace(**changes)  # type: ignore[arg-type]


def test_one_servo_of_a_pair_speaks_for_both_joints():
    servos = CoupledServos([COUPLING], ("jaw", "neck_pitch", "neck_roll"))
    servos.share_feedback(answered(), released=False)
    later = answered(
        missing=(2,), at_s=(6.0, 6.0, 4.9), position_steps=(0.5, 9.0, 2.0),
        torque=(True, False, True), rearmed=(False, True, False), fault=("", "", "overheating"),
    )  # fmt: skip
    found = servos.share_feedback(later, released=False)
    assert found.missing == (1, 2) and found.at_s == (6.0, 4.9, 4.9)
    assert found.position_steps == (0.5, 1.0, 2.0)
    assert found.load == (0.0, -0.4, -0.4)
    assert found.torque == (True, False, False) and found.rearmed == (False, True, True)
    assert found.fault == ("", "overheating (of its coupled servo)", "overheating")
    assert servos.share_feedback(later, released=True).torque == (True, True, True)


def test_a_coupled_neck_goes_where_it_is_sent_and_the_emulator_sees_servos_only(started):
    """Joints are measured where they are sent, through two servos that know of no joints."""
    rig = rig_with(COUPLING)
    made = started(rig)
    asked = (("neck_pitch", radians(20.0)), ("neck_roll", radians(-15.0)))
    made.robot.command(Jog(asked, stay=True))
    write: Any = Mock(wraps=made.robot.body.bus.write)
    made.robot.body.bus.write = write
    last = [degrees(angle) for angle in ticks(made, 500)[-1].joints.position_rad]
    at = dict(zip(rig.names, last, strict=True))
    assert at["neck_pitch"] == pytest.approx(20.0, abs=0.4)
    assert at["neck_roll"] == pytest.approx(-15.0, abs=0.4)
    servos = COUPLING.servo_rad((radians(20.0), radians(-15.0)))
    goals = dict(zip(rig.names, write.call_args.args[0], strict=True))
    for name, angle in zip(("neck_pitch", "neck_roll"), servos, strict=True):
        assert goals[name] == pytest.approx(rig.joints[name].steps(angle), abs=1.0)


def test_a_lost_servo_of_a_pair_makes_both_joints_stale(started):
    rig = rig_with(COUPLING)
    made = started(rig)
    read = made.robot.body.bus.read
    k = rig.names.index("neck_roll")

    def silent(t_s: float) -> Feedback:
        whole = read(t_s)
        nothing = Feedback.create_missing(len(rig.names))
        columns = [
            (*column[:k], none[k], *column[k + 1 :])
            for column, none in zip(whole[:9], nothing[:9], strict=True)
        ]
        return Feedback._make((*columns, whole.rearmed, (k,)))

    made.robot.body.bus.read = silent
    first, *_, tick = ticks(made, 60)
    assert first.joints.missing == ("neck_pitch", "neck_roll")
    held = {reason.partition(":")[0] for reason in tick.guard_result.reasons}
    assert {"neck_pitch", "neck_roll"} <= held
    assert inf > min(tick.joints.measured_s) > -inf


def coupled_file(tmp_path) -> str:
    text = shipped_path("rigs", "feetech").read_text()
    text += "\ncouplings:\n  neck: {first: neck_pitch, second: neck_roll}\n"
    path = tmp_path / "coupled.yaml"
    path.write_text(text)
    return str(path)


@pytest.mark.usefixtures("simulated_wires")
def test_bring_up_of_a_coupled_neck(tmp_path):
    pytest.importorskip("gazerig.features.bringup")
    rig = coupled_file(tmp_path)
    assert "valid: rig 'feetech'" in invoked("check", rig).err
    jog = invoked("jog", rig, "neck_roll", "6", "--mock")
    assert jog.code == 0 and "neck_roll: desired 6.0, measured" in jog.out + jog.err
    refused = invoked("calibrate", "joints", rig, "--joint", "neck_roll", "--mock", "--dry-run")
    assert refused.code == 2
    assert "neck_roll is moved together with neck_pitch by two servos" in refused.out + refused.err
    doctor = invoked("doctor", rig, "--mock", "--fix")
    # Both at 35 + 25 deg, and both joints' speeds at once on one shaft.
    assert "neck_pitch (servo 8): min position limit 0 -> 1366: done" in doctor.out + doctor.err
    assert "the YAML asks its shaft for 360 deg/s" in doctor.out + doctor.err
    once = invoked("monitor", rig, "--mock", "--once")
    row = next(line.split() for line in once.out.splitlines() if line.startswith("neck_pitch"))
    assert float(row[3]) == pytest.approx(-8.0, abs=0.2)
