"""Limits that bring parts of the model into each other are found, with joint, angle and cure."""

from collections.abc import Mapping
from dataclasses import replace
from math import radians
from pathlib import Path

import mujoco
import pytest
from command_line import invoked
from described_rigs import SHIPPED, shipped

from gazerig.config.schema import Rig
from gazerig.robot.app.rig_description import collision_hints, shape_of
from gazerig.robot.description.build import describe
from gazerig.robot.description.clearance import collisions
from gazerig.robot.description.mjcf import mjcf

Ranges = Mapping[str, tuple[float, float]]
_LITTLE: Ranges = {"neck_pitch": (-10.0, 10.0), "neck_roll": (-5.0, 5.0)}


def _rig(ranges: Ranges) -> Rig:
    """Return the desk rig on a short neck, with other ranges of joints, and further joints."""
    rig = shipped("desk")
    joints = dict(rig.joints)
    for joint, (low, high) in {**_LITTLE, **ranges}.items():
        joints[joint] = replace(rig.joints["neck_pitch"], min_deg=low, max_deg=high)
    return replace(rig, joints=joints, geometry=replace(rig.geometry, pitch_axis_height_mm=10.0))


def _touches(rig: Rig, joint: str, angle_deg: float) -> bool:
    """Return whether MuJoCo finds parts 3 mm in each other."""
    text = mjcf(describe(shape_of(rig)), looks=False).xml
    model = mujoco.MjSpec.from_string(text).compile()
    data = mujoco.MjData(model)
    data.qpos[model.joint(joint).qposadr[0]] = radians(angle_deg)
    mujoco.mj_forward(model, data)
    return any(contact.dist < -0.003 for contact in data.contact)


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_rigs_have_room(name: str) -> None:
    assert collision_hints(shipped(name)) == []


@pytest.mark.parametrize(
    ("joint", "reach"),
    [("neck_pitch", (-80.0, 30.0)), ("lower_neck_pitch", (-60.0, 20.0)), ("jaw", (-2.0, 40.0))],
)
def test_a_part_that_runs_into_the_shoulders_is_found_where_mujoco_finds_it(
    joint: str, reach: tuple[float, float]
) -> None:
    rig = _rig({joint: reach})
    (found,) = collisions(shape_of(rig))
    ((name, angle),) = found.angles_deg.items()
    assert name == joint and "base_link" in found.parts
    assert f"{joint} {angle:.0f} deg" in found.text() and f"joints.{joint}" in found.cure
    assert _touches(rig, joint, 1.4 * angle + (2.0 if angle > 0 else -2.0))
    assert not _touches(rig, joint, 0.6 * angle)
    # The cure cures, as far as the joint alone is the reason.
    low, high = reach
    within = (float(int(angle)), high) if angle < 0.0 else (low, float(int(angle)))
    left = collisions(shape_of(_rig({joint: within})))
    assert all(len(one.angles_deg) == 2 for one in left)


def test_check_and_describe_say_it_and_go_on(tmp_path: Path) -> None:
    path = tmp_path / "short.yaml"
    text = (Path(__file__).parents[1] / "config" / "rigs" / "desk.yaml").read_text("utf-8")
    text = text.replace("pitch_axis_height_mm: 70.0", "pitch_axis_height_mm: 10.0")
    path.write_text(text, encoding="utf-8")
    for command in (("check", str(path)), ("describe", str(path), str(tmp_path), "--glb")):
        done = invoked(*command)
        assert done.code == 0
        assert "neck_pitch -14 deg: head runs into base_link" in done.err
        assert "joints.neck_pitch.min_deg" in done.err
