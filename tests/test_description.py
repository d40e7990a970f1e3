"""A rig's description moves as the program's own geometry says, for everybody who reads it."""

import io
from collections.abc import Mapping

import mujoco
import numpy as np
import pytest
import yourdfpy
from described_rigs import SHIPPED, Poses, compare, random_angles, rigs, shipped
from hypothesis import given, settings
from hypothesis import strategies as st

from gazerig.config.schema import Rig
from gazerig.robot.app.rig_description import description_of
from gazerig.robot.description import head_mesh
from gazerig.robot.description.head_shape import JAW_HALF
from gazerig.robot.description.links import Description
from gazerig.robot.description.mass import (
    HEAD_LOAD_KG_M2,
    SHELL_M,
    about,
    joined,
    sheet,
    skull,
    turned,
)
from gazerig.robot.description.mjcf import mjcf
from gazerig.robot.description.paint import merged
from gazerig.robot.description.urdf import urdf


def _own(description: Description, angles: Mapping[str, float]) -> Poses:
    every = description.angles(tuple(angles), tuple(angles.values()))
    return {name: (np.array(R), np.array(p)) for name, (R, p) in description.poses(every).items()}


def _in_mujoco(description: Description, angles: Mapping[str, float]) -> Poses:
    model = mujoco.MjSpec.from_string(mjcf(description, looks=False).xml).compile()
    return _mujoco_poses(model, description, angles)


def _in_mujoco_awake(description: Description, angles: Mapping[str, float]) -> Poses:
    text = mjcf(description, looks=False, awake=True).xml
    return _mujoco_poses(mujoco.MjModel.from_xml_string(text), description, angles)


def _mujoco_poses(
    model: mujoco.MjModel, description: Description, angles: Mapping[str, float]
) -> Poses:
    data = mujoco.MjData(model)
    for name, angle in description.angles(tuple(angles), tuple(angles.values())).items():
        data.qpos[model.joint(name).qposadr[0]] = angle
    mujoco.mj_kinematics(model, data)
    return {
        link.name: (
            data.body(link.name).xmat.reshape(3, 3).copy(),
            data.body(link.name).xpos.copy(),
        )
        for link in description.links
    }


def _in_mujoco_from_urdf(description: Description, angles: Mapping[str, float]) -> Poses:
    text = urdf(description, looks=False)
    model = mujoco.MjModel.from_xml_string(text.xml, text.assets)
    return _mujoco_poses(model, description, angles)


def _in_yourdfpy(description: Description, angles: Mapping[str, float]) -> Poses:
    text = urdf(description, looks=False).xml.encode()
    robot = yourdfpy.URDF.load(io.BytesIO(text), load_meshes=False)
    assert robot.validate()
    # What follows another joint it moves by itself.
    robot.update_cfg({name: angles[name] for name in robot.actuated_joint_names})
    found = {link.name: robot.get_transform(link.name) for link in description.links}
    return {name: (matrix[:3, :3], matrix[:3, 3]) for name, matrix in found.items()}


READERS = (_own, _in_mujoco, _in_mujoco_awake, _in_mujoco_from_urdf, _in_yourdfpy)


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_rigs_move_alike_everywhere(name: str) -> None:
    rig, rng = shipped(name), np.random.default_rng(3)
    description = description_of(rig)
    for _ in range(5):
        angles = random_angles(rig, rng)
        for read in READERS:
            compare(rig, angles, read(description, angles))


@settings(max_examples=40, deadline=None)
@given(rigs(), st.integers(0, 10**6))
def test_any_rig_moves_alike_everywhere(rig: Rig, seed: int) -> None:
    description = description_of(rig, looks=False)
    angles = random_angles(rig, np.random.default_rng(seed))
    for read in READERS:
        compare(rig, angles, read(description, angles))


@pytest.mark.parametrize("name", SHIPPED)
def test_the_whole_model_is_compiled_with_looks(name: str) -> None:
    description = description_of(shipped(name))
    text = mjcf(description, "one_")
    model = mujoco.MjSpec.from_string(text.xml, assets=text.assets).compile()
    assert {model.joint(i).name for i in range(model.njnt)} == {
        f"one_{joint.name}" for joint in description.joints
    }
    assert model.nu == len(shipped(name).joints)
    for joint in description.joints:
        low, high = model.joint(f"one_{joint.name}").range
        limit = shipped(name).joints[joint.follows.joint if joint.follows else joint.name].limit()
        assert (low, high) == pytest.approx((limit.low_rad, limit.high_rad), abs=1e-12)
    assert model.ncam == 1
    looks = [visual.name for link in description.links for visual in link.visuals]
    assert len(set(looks)) == len(looks) == model.nmesh
    # Nothing touches with all joints where the rig parks or looks straight ahead.
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.ncon == 0


def test_the_head_is_balanced_and_weighs_what_its_emulated_servos_carry() -> None:
    description = description_of(shipped("desk"))
    poses = description.poses(description.angles((), ()))
    carried = [
        turned(link.inertia, *poses[link.name])
        for link in description.links
        if link.inertia is not None and link.name not in ("base_link", "neck_yaw_link")
        and link.name != "neck_pitch_link" and link.name != "neck_roll_link"
    ]  # fmt: skip
    whole = joined(carried)
    pivot = poses["neck_roll_link"][1]
    assert whole.mass_kg == pytest.approx(0.6)
    assert np.linalg.norm(np.subtract(whole.com_m, pivot)) < 0.002
    x, y, z = np.diag(np.array(about(whole, pivot))).tolist()
    measured = {"neck_roll": x, "neck_pitch": y, "neck_yaw": z}
    for name, expected in HEAD_LOAD_KG_M2.items():
        assert measured[name] == pytest.approx(expected, rel=0.15), measured


def test_a_skull_weighs_as_its_mesh_does() -> None:
    skin = head_mesh.skin()
    mesh = merged([skin.head, skin.jaw]).mesh
    # The walls beside the jaw are not of the shell.
    walls = np.isclose(np.abs(mesh.vertices[:, 1]), JAW_HALF)[mesh.faces].all(axis=1)
    mesh = mesh._replace(faces=mesh.faces[~walls])
    for unit in (0.03, 0.0619, 0.15):
        found, expected = skull(unit), sheet(mesh.vertices * unit, mesh.faces, SHELL_M)
        assert found.mass_kg == pytest.approx(expected.mass_kg, rel=1e-3)
        assert np.allclose(found.com_m, expected.com_m, atol=1e-3 * unit)
        size = np.abs(expected.tensor_kg_m2).max()
        assert np.allclose(found.tensor_kg_m2, expected.tensor_kg_m2, atol=1e-3 * size)


def test_a_description_without_looks_is_the_same_mechanism() -> None:
    for name in ("desk", "expressive"):
        assert description_of(shipped(name), looks=False) == (
            description_of(shipped(name)).without_looks()
        )


def test_the_camera_sees_what_the_lens_covers() -> None:
    rig = shipped("desk")
    model = mujoco.MjSpec.from_string(mjcf(description_of(rig), looks=False).xml).compile()
    height = 2.0 * np.tan(np.radians(model.cam_fovy[0] / 2.0))
    width = height * rig.webcam.width_px / rig.webcam.height_px
    assert np.degrees(2.0 * np.arctan(width / 2.0)) == pytest.approx(69.0)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    # It looks ahead, with its upper side up.
    assert np.allclose(data.cam_xmat[0].reshape(3, 3) @ (0, 0, -1), (1, 0, 0), atol=1e-9)
    assert np.allclose(data.cam_xmat[0].reshape(3, 3) @ (0, 1, 0), (0, 0, 1), atol=1e-9)
