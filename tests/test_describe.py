"""The command describe: files that others read, and what it says where it cannot write them."""

import io
import json
import os
import struct
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
import trimesh
import yourdfpy
from command_line import invoked
from described_rigs import SHIPPED, shipped

from gazerig.robot.app.rig_description import description_of
from gazerig.robot.description.files import description_files
from gazerig.robot.description.gltf import gltf
from gazerig.robot.description.servo_limits import joint_torques_nm
from gazerig.robot.description.urdf import urdf
from gazerig.robot.model.coupling_params import CouplingParams

VALIDATOR = os.environ.get("GLTF_VALIDATOR", "")
"""Folder in which ``npm install gltf-validator`` was run."""


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("described") / "deep" / "out"
    done = invoked("describe", "expressive", str(folder))
    assert done.code == 0, done.err
    assert "scene.xml" in done.err and "python -m mujoco.viewer" in done.err
    return folder


def test_all_files_are_read_by_others(written: Path) -> None:
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
    assert sum(path.stat().st_size for path in written.rglob("*") if path.is_file()) < 5e6


def test_lids_are_open_at_first_and_pupils_free(written: Path) -> None:
    """Joints keep their angles: it is where MuJoCo and glTF begin that differs from 0."""
    model = mujoco.MjModel.from_xml_path(str(written / "expressive.xml"))
    began = {model.joint(i).name: float(np.degrees(model.qpos0[i])) for i in range(model.njnt)}
    lids = {name: began.pop(name) for name in ("left_upper_lid", "right_upper_lid")}
    assert lids == pytest.approx(dict.fromkeys(lids, 16.875))  # 24 deg above the middle
    assert set(began.values()) == {0.0}
    description = description_of(shipped("expressive"), looks=False)
    scene = trimesh.load_scene(written / "expressive.glb")
    upright, _ = scene.graph.get("base_link")
    poses = description.poses({joint.name: joint.awake_rad for joint in description.joints})
    for link in ("left_upper_lid_link", "right_upper_lid_link", "head", "left_eye"):
        matrix, _ = scene.graph.get(link)
        R, p = poses[link]
        assert np.allclose((np.linalg.inv(upright) @ matrix)[:3, :3], R, atol=1e-6)
        assert np.allclose((np.linalg.inv(upright) @ matrix)[:3, 3], p, atol=1e-6)


def _links(rig: str) -> tuple[Any, ...]:
    return description_of(shipped(rig)).links


def test_joints_of_a_urdf_have_limits_and_followers() -> None:
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


def test_only_what_was_asked_for_is_written(tmp_path: Path) -> None:
    assert invoked("describe", "minimal", str(tmp_path / "a"), "--glb").code == 0
    assert [path.name for path in (tmp_path / "a").iterdir()] == ["minimal.glb"]
    assert invoked("describe", "minimal", str(tmp_path / "b"), "--urdf").code == 0
    assert sorted(path.name for path in (tmp_path / "b").iterdir()) == ["meshes", "minimal.urdf"]


def test_files_that_are_there_are_kept_unless_forced(tmp_path: Path) -> None:
    mine = tmp_path / "minimal.glb"
    mine.write_text("mine")
    done = invoked("describe", "minimal", str(tmp_path), "--glb")
    assert done.code == 2 and "--force" in done.err and "minimal.glb" in done.err
    assert mine.read_text() == "mine"
    assert invoked("describe", "minimal", str(tmp_path), "--glb", "--force").code == 0
    assert mine.read_bytes()[:4] == b"glTF"


def test_a_file_is_no_folder_to_write_to(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("mine")
    done = invoked("describe", "minimal", str(tmp_path / "out"))
    assert done.code == 2 and "out is a file: name a folder" in done.err


def test_a_faulty_rig_is_told_as_check_tells_it(tmp_path: Path) -> None:
    path = tmp_path / "my.yaml"
    path.write_text("name: my\nprofile: robot\njoints: {}\n")
    done = invoked("describe", str(path), str(tmp_path / "out"))
    assert done.code == 2
    assert done.err == invoked("check", str(path)).err
    assert not (tmp_path / "out").exists()


def _tree(data: bytes) -> dict[str, Any]:
    size, kind = struct.unpack("<I4s", data[12:20])
    assert data[:4] == b"glTF" and kind == b"JSON"
    tree: dict[str, Any] = json.loads(data[20 : 20 + size])
    return tree


def test_joints_may_be_called_as_parts_of_the_description_are() -> None:
    rig = shipped("minimal")
    names = ("base", "camera", "camera_link", "head", "head_fixed", "skin_mesh", "world")
    joints = {**rig.joints, **dict.fromkeys(names, rig.joints["eyes_pan"])}
    description = description_of(replace(rig, joints=joints))
    nodes = _tree(gltf(description))["nodes"]
    assert len({node["name"] for node in nodes}) == len(nodes)
    assert {node["extras"]["joint"] for node in nodes if "extras" in node} >= set(names)
    text = urdf(description, looks=False)
    assert yourdfpy.URDF.load(io.BytesIO(text.xml.encode()), load_meshes=False).validate()
    assert mujoco.MjModel.from_xml_string(text.xml, text.assets).njnt == len(description.joints)


def test_a_joint_has_the_torque_of_all_its_servos() -> None:
    joint = shipped("desk").joints["neck_pitch"]
    joints = {"neck_pitch": joint, "neck_roll": replace(joint, ratio=2.0, torque_limit=0.5)}
    alone = joint_torques_nm(joints, {})
    assert alone["neck_pitch"] == joint.facts.stall_torque_nm
    assert alone["neck_roll"] == pytest.approx(alone["neck_pitch"])
    pair = CouplingParams("differential", "neck_pitch", "neck_roll", 1.5, 1.0)
    both = joint_torques_nm(joints, {"neck": pair})
    assert both["neck_pitch"] == pytest.approx(1.5 * 2.0 * joint.facts.stall_torque_nm)
    assert both["neck_roll"] == pytest.approx(2.0 * joint.facts.stall_torque_nm)


@pytest.mark.parametrize("name", SHIPPED)
def test_gltf_is_one_tree_of_named_nodes_with_the_joints_in_it(name: str) -> None:
    description = description_of(shipped(name))
    tree = _tree(gltf(description))
    nodes = tree["nodes"]
    names = [node["name"] for node in nodes]
    assert len(set(names)) == len(names)
    children = [child for node in nodes for child in node.get("children", ())]
    assert sorted(children) == sorted(set(range(len(nodes))) - set(tree["scenes"][0]["nodes"]))
    for joint in description.joints:
        (node,) = (node for node in nodes if node.get("extras", {}).get("joint") == joint.name)
        assert node["extras"]["axis"] == list(joint.axis)
        assert node["extras"]["low_rad"] == joint.low_rad
    for accessor in tree["accessors"]:
        assert accessor["count"] > 0 and "bufferView" in accessor
    assert len(tree["images"]) == len(tree["meshes"])
    places = {view["byteOffset"] + view["byteLength"] for view in tree["bufferViews"]}
    assert max(places) <= tree["buffers"][0]["byteLength"]


@pytest.mark.skipif(not VALIDATOR, reason="GLTF_VALIDATOR names no folder with gltf-validator")
@pytest.mark.parametrize("name", SHIPPED)
def test_gltf_is_valid(name: str, tmp_path: Path) -> None:
    path = tmp_path / "rig.glb"
    path.write_bytes(gltf(description_of(shipped(name))))
    script = (
        "require('gltf-validator').validateBytes(new Uint8Array(require('fs').readFileSync("
        "process.argv[1]))).then(r => console.log(JSON.stringify(r.issues)))"
    )
    done = subprocess.run(
        ["node", "-e", script, str(path)],
        capture_output=True, text=True, check=True, cwd=VALIDATOR, timeout=120,
    )  # fmt: skip
    issues = json.loads(done.stdout)
    assert issues["numErrors"] == issues["numWarnings"] == 0, issues["messages"][:5]
