"""Parts of a tick as messages for viewers, named as in Foxglove's message schemas.

Quaternions are x, y, z, w. Frames: world at the neck base, head between the eyes, left_eye
and right_eye with x along the line of sight.
"""

import base64
from collections.abc import Sequence
from typing import Any

from gazerig.gaze.angles import add, compose, norm, rotate, rotation, sub
from gazerig.gaze.types import GazeState, Mat3, Vec3
from gazerig.robot.model.frames import quaternion
from gazerig.robot.model.types import JointState
from gazerig.robot.recording.run_format import UNUSED

Json = dict[str, Any]

_INFO = 2
_LINE_LIST = 2
_STILL: Json = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
_AT_HEAD = {"position": {"x": 0.0, "y": 0.0, "z": 0.0}, "orientation": _STILL}
_FOREVER = {"sec": 0, "nsec": 0}
_FACE_M = 0.11  # half the height of a face; it is drawn as a sphere
_SKIN = {"r": 0.95, "g": 0.72, "b": 0.55, "a": 0.7}
_SIGHT = {"r": 0.2, "g": 0.6, "b": 1.0, "a": 1.0}
_AIM = {"r": 1.0, "g": 0.3, "b": 0.2, "a": 1.0}


def time_stamp(ns: int) -> dict[str, int]:
    """Return a time in nanoseconds as a viewer's time stamp."""
    sec, nsec = divmod(ns, 1_000_000_000)
    return {"sec": sec, "nsec": nsec}


def image_message(jpeg: bytes, captured_s: float, at_ns: int) -> Json:
    """Return a JPEG as foxglove.CompressedImage, with its exposure in the rig's own time."""
    return {
        "timestamp": time_stamp(at_ns),
        "frame_id": "camera",
        "format": "jpeg",
        "data": base64.b64encode(jpeg).decode("ascii"),
        "captured_s": captured_s,
    }


def log_message(text: str, at_ns: int) -> Json:
    """Return a text as foxglove.Log."""
    return {
        "timestamp": time_stamp(at_ns), "level": _INFO, "message": text, "name": "gazerig", "file": "",
        "line": 0,
    }  # fmt: skip


def joint_states(names: Sequence[str], joints: JointState, at_ns: int) -> Json:
    """Return measured joints as foxglove.JointStates in rad and rad/s."""
    rows = zip(names, joints.position_rad, joints.velocity_rad_s, strict=True)
    return {
        "timestamp": time_stamp(at_ns),
        "joints": [{"name": n, "position": q, "velocity": v} for n, q, v in rows],
    }


def transforms(pose: GazeState, at_ns: int) -> Json:
    """Return the measured poses of head and eyes as foxglove.FrameTransforms."""
    head = _transform("world", "head", pose.p_world_head_m, pose.R_world_head, at_ns)
    eyes = (
        ("left_eye", pose.p_world_eye_left_m, pose.eye_left_rad),
        ("right_eye", pose.p_world_eye_right_m, pose.eye_right_rad),
    )
    turned = [
        _transform("world", name, p, compose(pose.R_world_head, rotation((*angles, 0.0))), at_ns)
        for name, p, angles in eyes
    ]
    return {"transforms": [head, *turned]}


def scene_message(pose: GazeState, point_m: Vec3, faces: list[Vec3], at_ns: int) -> Json:
    """Return faces, lines of sight and the gaze point as foxglove.SceneUpdate."""
    sights: list[Vec3] = []
    for p, angles in (
        (pose.p_world_eye_left_m, pose.eye_left_rad),
        (pose.p_world_eye_right_m, pose.eye_right_rad),
    ):
        R = compose(pose.R_world_head, rotation((*angles, 0.0)))
        sights += [p, add(p, rotate(R, (norm(sub(point_m, p)), 0.0, 0.0)))]
    entity: Json = {
        **{kind: [] for kind in UNUSED},
        "timestamp": time_stamp(at_ns), "frame_id": "world", "id": "gaze", "lifetime": _FOREVER,
        "frame_locked": False,
        "spheres": [
            *(_sphere(face, 2.0 * _FACE_M, _SKIN) for face in faces), _sphere(point_m, 0.02, _AIM),
        ],
        "lines": [{
            "type": _LINE_LIST, "pose": _AT_HEAD, "thickness": 2.0, "scale_invariant": True,
            "points": [_xyz(p) for p in sights], "color": _SIGHT, "colors": [], "indices": [],
        }],
    }  # fmt: skip
    return {"deletions": [], "entities": [entity]}


def orientation(R: Mat3) -> dict[str, float]:
    """Return a rotation matrix as a viewer's quaternion."""
    w, x, y, z = quaternion(R)
    return {"x": x, "y": y, "z": z, "w": w}


def _transform(parent: str, child: str, p: Vec3, R: Mat3, at_ns: int) -> Json:
    return {
        "timestamp": time_stamp(at_ns), "parent_frame_id": parent, "child_frame_id": child,
        "translation": _xyz(p), "rotation": orientation(R),
    }  # fmt: skip


def _sphere(p: Vec3, across_m: float, colour: Json) -> Json:
    size = {"x": across_m, "y": across_m, "z": across_m}
    return {"pose": {"position": _xyz(p), "orientation": _STILL}, "size": size, "color": colour}


def _xyz(p: Vec3) -> dict[str, float]:
    return {"x": p[0], "y": p[1], "z": p[2]}
