"""A rig's tables of expressions and levels, from joint angles in degrees to offsets of the pose."""

from collections.abc import Mapping
from math import radians

from gazerig.config.rig import Rig
from gazerig.gaze.gesture.animation import AnimationTables
from gazerig.gaze.gesture.level import LevelParams, LevelRange
from gazerig.gaze.gesture.pose_offset import NO_OFFSET, PoseOffset
from gazerig.robot.app.rig_limits import lid_ends
from gazerig.robot.model.kinematics import LIDS, NECK
from gazerig.robot.model.types import further


def animation_tables(rig: Rig) -> AnimationTables:
    """Return what expressions and levels add to the pose."""
    expressions = {name: pose_offset(rig, angles) for name, angles in rig.expressions.items()}
    levels = {name: _level(rig, level) for name, level in rig.levels.items()}
    return AnimationTables(expressions, rig.expression_blend_s, levels)


def pose_offset(rig: Rig, offsets_deg: Mapping[str, float]) -> PoseOffset:
    """Return angles added to joints as an offset of the pose.

    The angle of a lid becomes a factor of its opening, such that it is added where the lid is
    open and nothing where it is shut: blinks still shut it.

    Args:
        rig: its joints and the ends of its lids.
        offsets_deg: joint -> angle; none of an eye.
    """
    offsets = {name: radians(angle) for name, angle in offsets_deg.items()}
    spans = {name: wide - shut for name, (shut, wide) in lid_ends(rig).items()}
    yaw, pitch, roll = (offsets.get(name, 0.0) for name in NECK)
    a, b, c, d = (1.0 + offsets.get(name, 0.0) / spans.get(name, 1.0) for name in LIDS)
    joints = tuple(offsets.get(name, 0.0) for name in further(rig.joints))
    return NO_OFFSET._replace(head_rad=(yaw, pitch, roll), lids=(a, b, c, d), joints_rad=joints)


def _level(rig: Rig, level: LevelParams) -> LevelRange:
    low, high = (
        pose_offset(rig, {level.joint: angle}) for angle in (level.low_deg, level.high_deg)
    )
    return LevelRange(low, high, level.smoothing_ms / 1e3)
