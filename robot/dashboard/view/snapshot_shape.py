"""Geometry of a shown rig: its own, or one derived from a snapshot."""

from math import radians

from gazerig.robot.description.build import RigShape
from gazerig.robot.description.head_shape import HeadMeasures
from gazerig.robot.model.frames import CameraParams
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.kinematics import LIDS, GeometryParams
from gazerig.robot.model.types import Snapshot

_LID_RAD = {"upper": radians(74.0), "lower": radians(22.0)}
"""Rotation of shown lids from closed to open, about that of a person. Servos of a small head
move them less, so that it would always look sleepy."""
_JOINT = JointParams(1, "xl330-m077", -90.0, 90.0, 600.0, 10_000.0)


def shape_of(joints: tuple[str, ...], measures: HeadMeasures, snapshot: Snapshot) -> RigShape:
    """Return a rig with the joints and the dimensions of a snapshot.

    Args:
        joints: their names.
        measures: of the head.
        snapshot: has the pose of the head.
    """
    x, _, z = measures.pivot_m
    pivot_m = snapshot.p_world_pivot_m
    above_base_m = pivot_m[2] if pivot_m is not None else snapshot.p_world_head_m[2] + z
    geometry = GeometryParams(
        max(0.0, 1e3 * above_base_m), -1e3 * x, -1e3 * z, 1e3 * measures.interocular_m
    )
    lids = dict.fromkeys((name for name in LIDS if name in joints), (0.0, 0.0))
    shape = RigShape("rig", geometry, dict.fromkeys(joints, _JOINT), lids, {}, CameraParams())
    return with_shown_lids(shape)


def with_shown_lids(shape: RigShape) -> RigShape:
    """Return a rig whose lids have the rotation that is shown."""
    return shape._replace(lids={name: (0.0, _LID_RAD[name.split("_")[1]]) for name in shape.lids})
