"""The exported MJCF in MuJoCo alone moves as the running world; its URDF has the same masses."""

import io
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from described_rigs import SHIPPED
from exported_bench import Both, Move, exported, moves

from gazerig.config.schema import Rig, load_rig
from gazerig.robot.app.rig_description import description_of
from gazerig.robot.app.run_bus import emulated_lines
from gazerig.robot.app.servo_drives import servo_drives
from gazerig.robot.description.urdf import urdf
from gazerig.robot.model.coupling import CouplingParams

pytestmark = pytest.mark.usefixtures("mujoco")
SHARE = 0.05
JUMP_PEAK_SHARE = 0.25
"""Of the peak speed when the goal of an X330 jumps, which no run writes: the emulated servo brakes
by its speed at the end of a millisecond, the exported one at its start."""

LID_SHARE = 0.1
"""Of the way of a desk's lid at full drive: the exported motor brakes later."""


@pytest.mark.parametrize("move", [*moves()], ids=lambda one: f"{one.rig}-{one.joint}-{one.kind}")
def test_an_exported_model_moves_as_the_running_world(move: Move) -> None:
    both = Both(move)
    world, plain = both.world, both.plain
    if move.kind == "stall":
        assert plain.torque_nm[-1] == pytest.approx(world.torque_nm[-1], rel=SHARE)
        assert abs(world.torque_nm[-1]) > 0.1
        return
    size = abs(float(world.angle_deg[-1] - world.angle_deg[0]))
    assert size > 15.0
    share = LID_SHARE if (move.rig, move.joint) == ("desk", "left_upper_lid") else SHARE
    assert float(np.abs(world.angle_deg - plain.angle_deg).max()) < share * size
    peaks = [float(np.abs(one.speed_deg_s).max()) for one in (world, plain)]
    jump = (move.rig, move.kind) == ("desk", "jump")
    assert peaks[1] == pytest.approx(peaks[0], rel=JUMP_PEAK_SHARE if jump else SHARE)


def test_an_exported_eye_has_the_inertia_of_the_emulated_one(mujoco: Any, desk_rig: Rig) -> None:
    model = exported(desk_rig)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    at = model.joint("left_eye_pan").dofadr[0]
    (line,) = emulated_lines(desk_rig).values()
    rotor = servo_drives(desk_rig)["left_eye_pan"].armature_kg_m2
    load: Any = line
    assert rotor == pytest.approx(2.0e-4, rel=0.01)
    assert full[at, at] == pytest.approx(rotor + load.servos[0].physics.load_kg_m2, rel=0.01)


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
    """As MuJoCo's importer and yourdfpy read them."""
    import yourdfpy

    rig = load_rig(name)
    text = urdf(description_of(rig, looks=False).with_drives(servo_drives(rig)), looks=False)
    read = mujoco.MjModel.from_xml_string(text.xml, text.assets)
    other, model = (
        yourdfpy.URDF.load(io.BytesIO(text.xml.encode()), load_meshes=False),
        exported(rig),
    )
    for i in range(1, model.nbody):
        body = model.body(i)
        inertial = other.link_map[body.name].inertial
        if body.mass[0] == 0.0:
            assert inertial is None
            continue
        same = read.body(body.name)
        assert inertial.mass == pytest.approx(body.mass[0], rel=1e-9)
        assert same.mass[0] == pytest.approx(body.mass[0], rel=1e-9)
        principal = np.linalg.eigvalsh(inertial.inertia)
        assert principal == pytest.approx(np.sort(body.inertia), rel=1e-6, abs=1e-14)
        assert np.sort(same.inertia) == pytest.approx(np.sort(body.inertia), rel=1e-6, abs=1e-14)
        assert principal[0] > 0.0 and principal[0] + principal[1] >= principal[2] * (1.0 - 1e-9)
        origin = np.eye(4) if inertial.origin is None else inertial.origin
        assert origin[:3, 3] == pytest.approx(body.ipos, abs=1e-9)
    for joint, drive in servo_drives(rig).items():
        at = read.joint(joint).dofadr[0]
        dry = drive.friction_nm
        assert read.dof_frictionloss[at] == pytest.approx(dry, rel=1e-6)
        assert read.dof_damping[at] == pytest.approx(drive.damping_nm_s, rel=1e-6)
        assert model.dof_frictionloss[model.joint(joint).dofadr[0]] == pytest.approx(dry, rel=1e-6)
