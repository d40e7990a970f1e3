"""Rigs whose descriptions are compared with the program's own geometry, shipped and others."""

from collections.abc import Mapping
from functools import cache
from math import radians
from typing import NamedTuple

import numpy as np
from gaze_targets import joints_at

from gazerig.config.schema import Rig, load_rig
from gazerig.gaze.types import Floats, GazeState
from gazerig.robot.model.frames import CameraMount
from gazerig.robot.model.kinematics import LIDS
from gazerig.robot.run.models import rig_kinematics
from gazerig.robot.run.rig_limits import lid_ends

SHIPPED = (
    "desk", "expressive", "feetech", "maker", "minimal", "six_hobby", "six_xl330", "nine_xl330",
)  # fmt: skip
ANGLE_RAD, PLACE_M = 1e-9, 1e-6
"""How far a description may be from the program's own geometry."""


class Expected(NamedTuple):
    """Places of a rig's parts by the program: its own geometry, and the camera's pose."""

    state: GazeState
    camera: tuple[Floats, Floats]


def expected(rig: Rig, angles: Mapping[str, float]) -> Expected:
    """Return where everything is according to robot/model/kinematics.py."""
    kinematics = rig_kinematics(rig)
    values = [angles[name] for name in rig.names]
    state = kinematics.forward(joints_at(values))
    R, p = CameraMount(rig.camera).pose(state.R_world_head, state.p_world_head_m)
    return Expected(state, (np.array(R), np.array(p)))


Poses = Mapping[str, tuple[Floats, Floats]]
"""R_world_link and p_world_link_m by the name of the link."""


def compare(rig: Rig, angles: Mapping[str, float], poses: Poses) -> None:
    """Assert that links are at the places of the program's geometry."""
    state, camera = expected(rig, angles)
    _same(poses["head"], (np.array(state.R_world_head), np.array(state.p_world_head_m)))
    _same(poses["camera_optical_frame"], camera)
    for side, p_eye, (yaw, pitch) in (
        ("left", state.p_world_eye_left_m, state.eye_left_rad),
        ("right", state.p_world_eye_right_m, state.eye_right_rad),
    ):
        R, p = poses[f"{side}_eye"]
        assert np.abs(p - p_eye).max() < PLACE_M
        ahead = np.array((np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), np.sin(pitch)))
        sight = np.array(state.R_world_head) @ ahead
        assert np.linalg.norm(np.cross(R[:, 0], sight)) < ANGLE_RAD and R[:, 0] @ sight > 0.0
    openings = (state.lid_left, state.lid_right, state.lower_left, state.lower_right)
    for name, opening in zip(LIDS, openings, strict=True):
        if name in lid_ends(rig):
            _compare_lid(rig, name, opening, angles[name], poses)


def _compare_lid(rig: Rig, name: str, opening: float, angle: float, poses: Poses) -> None:
    """Assert that a lid turned about its eye's centre as far as it is open."""
    shut, wide = lid_ends(rig)[name]
    R_head = poses["head"][0]
    R, p = poses[f"{name}_link"]
    turned = R_head.T @ R
    up = np.arctan2(turned[2, 0], turned[0, 0])
    assert np.abs(turned[:, 1] - (0.0, 1.0, 0.0)).max() < ANGLE_RAD
    side = name.split("_")[0]
    assert np.abs(p - poses[f"{side}_eye"][1]).max() < PLACE_M
    opens_up = (1.0 if "upper" in name else -1.0) * (1.0 if wide > shut else -1.0)
    assert abs(up - opens_up * angle) < ANGLE_RAD
    share = min(1.0, max(0.0, (opens_up * up - shut) / (wide - shut)))
    assert abs(share - opening) < 1e-8


def _same(one: tuple[Floats, Floats], other: tuple[Floats, Floats]) -> None:
    assert np.abs(one[0] - other[0]).max() < ANGLE_RAD
    assert np.abs(one[1] - other[1]).max() < PLACE_M


@cache
def shipped(name: str) -> Rig:
    """Return a shipped rig; it is read once."""
    return load_rig(name)


def random_angles(rig: Rig, rng: np.random.Generator) -> dict[str, float]:
    """Return angles of all joints, each anywhere in its range."""
    return {
        name: radians(rng.uniform(joint.min_deg, joint.max_deg))
        for name, joint in rig.joints.items()
    }
