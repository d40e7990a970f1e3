"""The exported MJCF in MuJoCo alone moves as the running world; its URDF has the same masses."""

from dataclasses import replace
from math import radians
from typing import Any

import numpy as np
import pytest
from described_rigs import SHIPPED
from world_rigs import WorldBench, arm, write

from gazerig.config.schema import Rig, load_rig
from gazerig.robot.description.mjcf import mjcf
from gazerig.robot.description.urdf import urdf
from gazerig.robot.model.coupling import CouplingParams
from gazerig.robot.run.rig_description import description_of
from gazerig.robot.run.servo_drives import servo_drives

pytestmark = pytest.mark.usefixtures("mujoco")


def exported(rig: Rig) -> Any:
    """Return the MJCF that ``gazerig describe`` writes, compiled."""
    import mujoco

    description = description_of(rig).with_drives(servo_drives(rig))
    return mujoco.MjModel.from_xml_string(mjcf(description, looks=False).xml)


def stall_torque_nm(bench: WorldBench, joint: str, angle_deg: float) -> float:
    """Return the torque in the running world of a stuck joint that is sent to an angle."""
    servo, params = bench.servos[joint], bench.rig.joints[joint]
    servo.shaft.jam(True)
    steps = round(params.steps(radians(angle_deg)))
    if hasattr(servo, "memory"):
        arm(servo, params.gains or ())
        write(servo, "goal_position", steps)
    else:
        (board,) = bench.devices.values()
        board.channels[params.id].set_target(steps)
    bench.pass_ms(200)
    at = bench.world.model.rig.dof[joint]
    return float(bench.world._data.qfrc_actuator[at])


@pytest.mark.parametrize("angle_deg", [2.0, 25.0])
@pytest.mark.parametrize(
    ("name", "joint"), [("desk", "neck_pitch"), ("feetech", "left_eye_pan"), ("maker", "eyes_pan")]
)
def test_an_exported_motor_holds_and_stalls_as_that_of_the_running_world(
    mujoco: Any, name: str, joint: str, angle_deg: float
) -> None:
    bench = WorldBench(name)
    in_world_nm = stall_torque_nm(bench, joint, angle_deg)
    start_rad, model = bench.world.joints_rad(), exported(bench.rig)
    data = mujoco.MjData(model)
    for other, angle in start_rad.items():
        data.qpos[model.joint(other).qposadr[0]] = angle
        data.actuator(other).ctrl[0] = angle
    model.dof_frictionloss[model.joint(joint).dofadr[0]] = 20.0
    data.actuator(joint).ctrl[0] = radians(angle_deg)
    for _ in range(200):
        mujoco.mj_step(model, data)
    torque_nm = data.qfrc_actuator[model.joint(joint).dofadr[0]]
    assert torque_nm == pytest.approx(in_world_nm, rel=0.05)


def test_two_servos_of_a_pair_share_their_joints(desk_rig: Rig) -> None:
    """Each of a differential's joints has the rotors, friction and torque of both."""
    alone = servo_drives(desk_rig)["neck_pitch"]
    pair = CouplingParams("neck_pitch", "neck_roll")
    both = servo_drives(replace(desk_rig, couplings={"neck": pair}))
    for name in ("neck_pitch", "neck_roll"):
        assert both[name].armature_kg_m2 == pytest.approx(2.0 * alone.armature_kg_m2)
        assert both[name].force_nm == pytest.approx(2.0 * alone.force_nm)
        assert both[name].friction_nm == pytest.approx(2.0 * alone.friction_nm)


@pytest.mark.parametrize("name", SHIPPED)
def test_masses_of_a_urdf_are_those_of_the_mjcf_and_possible(mujoco: Any, name: str) -> None:
    """As MuJoCo's importer reads them."""
    rig = load_rig(name)
    text = urdf(description_of(rig).with_drives(servo_drives(rig)), looks=False)
    read, model = mujoco.MjModel.from_xml_string(text.xml, text.assets), exported(rig)
    for i in range(1, model.nbody):
        body = model.body(i)
        if body.mass[0] == 0.0:
            continue
        same = read.body(body.name)
        assert same.mass[0] == pytest.approx(body.mass[0], rel=1e-9)
        assert same.ipos == pytest.approx(body.ipos, abs=1e-9)
        small, middle, large = np.sort(same.inertia)
        assert (small, middle, large) == pytest.approx(np.sort(body.inertia), rel=1e-6, abs=1e-14)
        assert small > 0.0 and small + middle >= large * (1.0 - 1e-9)
    for joint, drive in servo_drives(rig).items():
        at = read.joint(joint).dofadr[0]
        dry = drive.friction_nm
        assert read.dof_frictionloss[at] == pytest.approx(dry, rel=1e-6)
        assert read.dof_damping[at] == pytest.approx(drive.damping_nm_s, rel=1e-6)
        assert model.dof_frictionloss[model.joint(joint).dofadr[0]] == pytest.approx(dry, rel=1e-6)
