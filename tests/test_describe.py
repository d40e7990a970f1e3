"""The command describe: files that other programs read, and errors if it cannot write them."""

import io
import json
import struct
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import invoked
from described_rigs import SHIPPED, Poses, compare, random_angles, shipped

from gazerig.config.schema import Rig
from gazerig.robot.app.rig_description import description_of
from gazerig.robot.description.build import joint_torques_nm
from gazerig.robot.description.files import description_files
from gazerig.robot.description.links import Description, Inertia
from gazerig.robot.description.mass import carried_links, join_inertias
from gazerig.robot.description.mjcf import Mjcf, mjcf
from gazerig.robot.description.urdf import Urdf, urdf
from gazerig.robot.model.coupling import CouplingParams
from gazerig.robot.model.mass_params import HeadMassParams, MassParams


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("described") / "deep" / "out"
    done = invoked("describe", "expressive", str(folder))
    assert done.code == 0, done.err
    assert "scene.xml" in done.err and "python -m mujoco.viewer" in done.err
    return folder


def test_all_files_are_read_by_others(written: Path) -> None:
    import mujoco
    import trimesh
    import yourdfpy

    model = mujoco.MjModel.from_xml_path(str(written / "scene.xml"))
    assert model.njnt == 11 and model.nu == 9
    robot = yourdfpy.URDF.load(str(written / "expressive.urdf"), load_collision_meshes=True)
    assert robot.validate() and robot.errors == []
    looks = [visual.name for link in _links("expressive") for visual in link.visuals]
    assert len(robot.scene.geometry) == len(looks)
    again = mujoco.MjModel.from_xml_path(str(written / "expressive.urdf"))
    assert {again.body(i).name for i in range(again.nbody)} >= {"base_link", "head", "jaw_link"}
    scene = trimesh.load_scene(written / "expressive.glb")
    assert {link.name for link in _links("expressive")} <= set(scene.graph.nodes)
    assert sum(path.stat().st_size for path in written.rglob("*") if path.is_file()) < 8e6


def _links(rig: str) -> tuple[Any, ...]:
    return description_of(shipped(rig)).links


def test_joints_of_a_urdf_have_limits_and_followers() -> None:
    import yourdfpy

    rig = shipped("minimal")
    text = description_files(description_of(rig), ["urdf"])["minimal.urdf"]
    robot = yourdfpy.URDF.load(io.BytesIO(text), load_meshes=False)
    joint = robot.joint_map["eyes_pan"]
    assert np.degrees([joint.limit.lower, joint.limit.upper, joint.limit.velocity]) == (
        pytest.approx([-35.0, 35.0, 600.0])
    )
    assert joint.limit.effort == pytest.approx(0.215, rel=0.2)  # an XL330-M077 at 5 V
    assert robot.joint_map["right_eyes_pan"].mimic.joint == "eyes_pan"
    assert robot.actuated_joint_names == ["eyes_pan", "eyes_tilt"]


def _glb(rig: Rig) -> bytes:
    from gazerig.robot.description.gltf import gltf

    return gltf(description_of(rig))


def _tree(data: bytes) -> dict[str, Any]:
    size, kind = struct.unpack("<I4s", data[12:20])
    assert data[:4] == b"glTF" and kind == b"JSON"
    tree: dict[str, Any] = json.loads(data[20 : 20 + size])
    return tree


def test_a_joint_has_the_torque_of_all_its_servos() -> None:
    joint = shipped("desk").joints["neck_pitch"]
    joints = {"neck_pitch": joint, "neck_roll": replace(joint, ratio=2.0, torque_limit=0.5)}
    alone = joint_torques_nm(joints, {})
    assert alone["neck_pitch"] == joint.model_facts.stall_torque_nm
    assert alone["neck_roll"] == pytest.approx(alone["neck_pitch"])
    pair = CouplingParams("neck_pitch", "neck_roll", 1.5, 1.0)
    both = joint_torques_nm(joints, {"neck": pair})
    assert both["neck_pitch"] == pytest.approx(1.5 * 2.0 * joint.model_facts.stall_torque_nm)
    assert both["neck_roll"] == pytest.approx(2.0 * joint.model_facts.stall_torque_nm)


@pytest.mark.parametrize("name", SHIPPED)
def test_gltf_is_one_tree_of_named_nodes_with_the_joints_in_it(name: str) -> None:
    description = description_of(shipped(name))
    tree = _tree(_glb(shipped(name)))
    nodes = tree["nodes"]
    names = [node["name"] for node in nodes]
    assert len(set(names)) == len(names)
    children = [child for node in nodes for child in node.get("children", ())]
    assert sorted(children) == sorted(set(range(len(nodes))) - set(tree["scenes"][0]["nodes"]))
    for joint in description.joints:
        (node,) = (node for node in nodes if node.get("extras", {}).get("joint") == joint.name)
        assert node["extras"]["axis"] == list(joint.axis)
        assert node["extras"]["low_rad"] == joint.low_rad


# A rig's description moves by the program's own geometry in every reader


def _own(description: Description, angles: Mapping[str, float]) -> Poses:
    every = description.angles(tuple(angles), tuple(angles.values()))
    return {name: (np.array(R), np.array(p)) for name, (R, p) in description.poses(every).items()}


def _in_mujoco(description: Description, angles: Mapping[str, float]) -> Poses:
    return _mujoco_poses(mjcf(description, looks=False), description, angles)


def _mujoco_poses(
    text: Mjcf | Urdf, description: Description, angles: Mapping[str, float]
) -> Poses:
    import mujoco

    model = mujoco.MjModel.from_xml_string(text.xml, text.assets)
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
    return _mujoco_poses(urdf(description, looks=False), description, angles)


def _in_yourdfpy(description: Description, angles: Mapping[str, float]) -> Poses:
    import yourdfpy

    text = urdf(description, looks=False).xml.encode()
    robot = yourdfpy.URDF.load(io.BytesIO(text), load_meshes=False)
    assert robot.validate()
    # It moves joints that follow another one.
    robot.update_cfg({name: angles[name] for name in robot.actuated_joint_names})
    found = {link.name: robot.get_transform(link.name) for link in description.links}
    return {name: (matrix[:3, :3], matrix[:3, 3]) for name, matrix in found.items()}


READERS = (_own, _in_mujoco, _in_mujoco_from_urdf, _in_yourdfpy)


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_rigs_move_alike_everywhere(name: str) -> None:
    rig, rng = shipped(name), np.random.default_rng(3)
    description = description_of(rig)
    for _ in range(5):
        angles = random_angles(rig, rng)
        for read in READERS:
            compare(rig, angles, read(description, angles))


@pytest.mark.parametrize("name", SHIPPED)
def test_the_whole_model_is_compiled_with_looks(name: str) -> None:
    import mujoco

    description = description_of(shipped(name))
    text = mjcf(description)
    model = mujoco.MjSpec.from_string(text.xml, assets=text.assets).compile()
    assert {model.joint(i).name for i in range(model.njnt)} == {
        joint.name for joint in description.joints
    }
    assert model.nu == len(shipped(name).joints)
    for joint in description.joints:
        low, high = model.joint(joint.name).range
        limit = shipped(name).joints[joint.follows or joint.name].limit()
        assert (low, high) == pytest.approx((limit.low_rad, limit.high_rad), abs=1e-12)
    assert model.ncam == 1
    looks = [visual.name for link in description.links for visual in link.visuals]
    assert len(set(looks)) == len(looks) == model.nmesh
    # Nothing touches in the parking pose and straight ahead.
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.ncon == 0


def whole_head(rig: Rig) -> Inertia:
    """The head with all it carries, about its own centre, placed from the pitch axis."""
    description = description_of(rig, looks=False)
    links = list(description.links)
    own = description.link("head")
    after = links[links.index(own) + 1 :]
    carried = carried_links([link for link in after if link.parent != "base_link"])
    whole = join_inertias([*carried, own.inertia] if own.inertia is not None else carried)
    geometry = rig.geometry
    pivot = (-geometry.eyes_ahead_mm / 1e3, 0.0, -geometry.eyes_above_mm / 1e3)
    x, y, z = np.subtract(whole.com_m, pivot).tolist()
    return whole._replace(com_m=(x, y, z))


def test_a_head_weighs_what_its_shapes_give() -> None:
    whole = whole_head(shipped("desk"))
    assert whole.mass_kg == pytest.approx(0.6)
    # Shell and servos are above and a little behind the axes of the neck.
    assert np.allclose(np.multiply(whole.com_m, 1e3), (-11.6, 0.0, 61.2), atol=0.5)


def test_a_head_weighs_what_its_file_says() -> None:
    desk = shipped("desk")
    given = HeadMassParams(0.9, (40.0, 2.0, 30.0))
    whole = whole_head(replace(desk, mass=MassParams(head=given)))
    assert whole.mass_kg == pytest.approx(0.9)
    assert np.allclose(whole.com_m, (0.040, 0.002, 0.030), atol=1e-9)


def test_the_camera_sees_what_the_lens_covers() -> None:
    import mujoco

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
