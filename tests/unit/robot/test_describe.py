"""The command describe: files that other programs read, and errors if it cannot write them."""

import io
import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import degrees, radians
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import invoked
from described_rigs import SHIPPED, Poses, compare, random_angles, shipped
from emulated_rig import EmulatedRig

from gazerig.config.schema import Rig
from gazerig.robot.description.export import Model, mjcf, urdf
from gazerig.robot.description.links import Description
from gazerig.robot.loop.body import Body
from gazerig.robot.model.weight import CounterweightParams, HeadMassParams, MassParams
from gazerig.robot.run.buses import rig_bus
from gazerig.robot.run.rig_description import (
    description_of,
    neck_loads,
    sag_compensation,
    statics_of,
)


@pytest.fixture(scope="module")
def written(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("described") / "deep" / "out"
    done = invoked("describe", "expressive", str(folder))
    assert done.code == 0, done.err
    assert "scene.xml" in done.err and "python -m mujoco.viewer" in done.err
    return folder


def test_all_files_are_read_by_others(written):
    import mujoco
    import trimesh
    import yourdfpy

    model = mujoco.MjModel.from_xml_path(str(written / "scene.xml"))
    assert model.njnt == 11 and model.nu == 9
    robot = yourdfpy.URDF.load(str(written / "expressive.urdf"), load_collision_meshes=True)
    assert robot.validate() and robot.errors == []
    links = description_of(shipped("expressive")).links
    looks = [visual.name for link in links for visual in link.visuals]
    assert len(robot.scene.geometry) == len(looks)
    again = mujoco.MjModel.from_xml_path(str(written / "expressive.urdf"))
    assert {again.body(i).name for i in range(again.nbody)} >= {"base_link", "head", "jaw_link"}
    scene = trimesh.load_scene(written / "expressive.glb")
    nodes = {link.joint.name if link.joint else link.name for link in links}
    assert nodes <= set(scene.graph.nodes)
    assert sum(path.stat().st_size for path in written.rglob("*") if path.is_file()) < 8e6


def _tree(data: bytes) -> dict[str, Any]:
    size, kind = struct.unpack("<I4s", data[12:20])
    assert data[:4] == b"glTF" and kind == b"JSON"
    tree: dict[str, Any] = json.loads(data[20 : 20 + size])
    return tree


def test_a_joint_has_the_torque_of_its_servo():
    rig = shipped("desk")
    joint = replace(rig.joints["neck_pitch"], torque_limit=0.5)
    description = description_of(replace(rig, joints={**rig.joints, "neck_pitch": joint}))
    (found,) = [one for one in description.joints if one.name == "neck_pitch"]
    assert found.max_torque_nm == pytest.approx(0.5 * joint.model_facts.stall_torque_nm)


@pytest.mark.parametrize("name", SHIPPED)
def test_gltf_is_one_tree_of_named_nodes_with_the_joints_in_it(name):
    from gazerig.robot.description.gltf import gltf

    description = description_of(shipped(name))
    tree = _tree(gltf(description))
    nodes = tree["nodes"]
    names = [node["name"] for node in nodes]
    assert len(set(names)) == len(names)
    children = [child for node in nodes for child in node.get("children", ())]
    assert sorted(children) == sorted(set(range(len(nodes))) - set(tree["scenes"][0]["nodes"]))
    for joint in description.joints:
        (node,) = (node for node in nodes if node["name"] == joint.name)
        assert "matrix" not in node and len(node["rotation"]) == 4, "it can be animated"


# A rig's description moves by the program's own geometry in every reader


def _own(description: Description, angles: Mapping[str, float]) -> Poses:
    every = description.angles(tuple(angles), tuple(angles.values()))
    return {name: (np.array(R), np.array(p)) for name, (R, p) in description.poses(every).items()}


def _in_mujoco(description: Description, angles: Mapping[str, float]) -> Poses:
    return _mujoco_poses(mjcf(description, looks=False), description, angles)


def _in_pose(text: Model, description: Description, angles: Mapping[str, float]) -> tuple[Any, Any]:
    """Return MuJoCo's model and data of a description at joint angles."""
    import mujoco

    model = mujoco.MjModel.from_xml_string(text.xml, text.assets)
    data = mujoco.MjData(model)
    for name, angle in description.angles(tuple(angles), tuple(angles.values())).items():
        data.qpos[model.joint(name).qposadr[0]] = angle
    mujoco.mj_forward(model, data)
    return model, data


def _mujoco_poses(text: Model, description: Description, angles: Mapping[str, float]) -> Poses:
    _, data = _in_pose(text, description, angles)
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
def test_shipped_rigs_move_alike_everywhere(name):
    rig, rng = shipped(name), np.random.default_rng(3)
    description = description_of(rig)
    for _ in range(5):
        angles = random_angles(rig, rng)
        for read in READERS:
            compare(rig, angles, read(description, angles))


@pytest.mark.parametrize("name", SHIPPED)
def test_the_whole_model_is_compiled_with_looks(name):
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
    looks = [visual.name for link in description.links for visual in link.visuals]
    assert len(set(looks)) == len(looks) == model.nmesh
    # Nothing touches in the parking pose and straight ahead.
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.ncon == 0


# ---- Masses of a rig: torques of its weight, and a neck that does not sag


REAL = MassParams(head=HeadMassParams(com_mm=(40.0, 0.0, 30.0)))
"""A realistic skull and jaw."""


def heavy(name: str, mass: MassParams = REAL) -> Rig:
    return replace(shipped(name), mass=mass)


def mujoco_loads_nm(rig: Rig, angles: Mapping[str, float]) -> dict[str, float]:
    description = description_of(rig)
    model, data = _in_pose(mjcf(description, looks=False), description, angles)
    found = dict.fromkeys(rig.joints, 0.0)
    for joint in description.joints:
        name = joint.follows or joint.name
        at = model.joint(joint.name).dofadr[0]
        found[name] += data.qfrc_passive[at] - data.qfrc_bias[at]
    return found


@pytest.mark.parametrize("name", ["desk", "feetech", "expressive"])
def test_torques_are_those_of_mujoco(name):
    rng = np.random.default_rng(4)
    weights = {"back": CounterweightParams(0.2, (-60.0, 5.0, 20.0))}
    rig = heavy(name, replace(REAL, counterweights=weights))
    statics = statics_of(rig)
    for _ in range(5):
        angles = {
            name: rng.uniform(radians(joint.min_deg), radians(joint.max_deg))
            for name, joint in statics.joints.items()
        }
        expected = mujoco_loads_nm(rig, angles)
        loads = statics.load_nm(angles)
        assert loads == pytest.approx({name: expected[name] for name in loads}, abs=1e-9)
    light = statics_of(heavy(name)).load_nm(angles)  # without the counterweight
    assert abs(light["neck_pitch"] - loads["neck_pitch"]) > 0.05


class Neck:
    """A neck's pitch on emulated servos, with all other joints at 0."""

    def __init__(self, rig: Rig, compensated: bool = True) -> None:
        self.emulated = EmulatedRig(rig)
        sag = sag_compensation(rig) if compensated else None
        bus = rig_bus(rig, self.emulated.ports)
        self.body = Body(bus, rig.joints, sag=sag)
        self.at = self.body.names.index("neck_pitch")
        self.goal = list(self.body.start(self.emulated.clock))
        self.t_s = 0.0

    def hold(self, angle_deg: float, for_s: float) -> list[float]:
        """Turn to an angle at 40 deg/s, hold it, and return the errors in degrees."""
        errors, end_s = [], self.t_s + for_s
        while self.t_s < end_s:
            off = radians(angle_deg) - self.goal[self.at]
            step = radians(0.4)
            self.goal[self.at] += min(max(off, -step), step)
            self.body.write(tuple(self.goal))
            self.t_s += 0.01
            self.emulated.clock.sleep_until(self.t_s)
            state = self.body.read(self.t_s)
            errors.append(degrees(state.position_rad[self.at] - self.goal[self.at]))
        return errors


@pytest.mark.parametrize("name", ["desk", "feetech"])
def test_a_heavy_head_does_not_sag(name):
    rig = heavy(name)
    plain = Neck(rig, compensated=False)
    made_up = Neck(rig)
    for angle in (0.0, 20.0, -20.0):
        before, after = plain.hold(angle, 3.0)[-1], made_up.hold(angle, 3.0)[-1]
        assert before < -0.35 and abs(after) < 0.25, (angle, before, after)


def test_sag_is_made_up_for_without_a_jump_and_within_the_limits(monkeypatch):
    neck = Neck(heavy("desk"))
    goals: list[int] = []
    write = neck.body.bus.write

    def note(steps: Sequence[int]) -> None:
        goals.append(steps[neck.at])
        write(steps)

    monkeypatch.setattr(neck.body.bus, "write", note)
    joint = neck.emulated.rig.joints["neck_pitch"]
    goals.append(round(joint.steps(neck.goal[neck.at])))
    neck.hold(degrees(neck.goal[neck.at]), 2.0)
    assert max(abs(b - a) for a, b in zip(goals, goals[1:], strict=False)) <= 1
    assert abs(goals[-1] - goals[0]) > 10
    # At the end of the range nothing is left to make up with: the bus clips the goal.
    assert neck.hold(35.0, 3.0)[-1] < -0.3
    assert neck.emulated.where()["neck_pitch"] <= 35.0


def test_check_names_a_load_that_is_too_much_and_a_head_that_sinks():
    told = [one for one in neck_loads(heavy("desk")) if one[0] == "neck_pitch"]
    assert [bool(remedy) for _, _, remedy in told] == [False, True]
    assert "32% of its stall torque, at neck_pitch -35" in told[0][1] and "sinks" in told[1][1]
    far = MassParams(head=HeadMassParams(com_mm=(60.0, 0.0, 30.0)))
    hot = [one for one in neck_loads(heavy("desk", far)) if one[0] == "neck_pitch"]
    assert "42%" in hot[0][1] and "hot" in hot[0][2]
    assert not any(remedy for _, _, remedy in neck_loads(shipped("desk")))
