"""Reachability of a commanded gaze or pose, joint by joint, before the rig moves."""

from collections.abc import Sequence
from math import radians

from gazerig.gaze.angles import add, norm, scale, sub, unit
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.gaze.oculomotor.oculomotor import Oculomotor, ReachableGaze
from gazerig.gaze.types import Angles2, Angles3, GazeCommand, Target
from gazerig.robot.model.commands import Jog
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.model.kinematics import NECK, Kinematics, gaze_error
from gazerig.robot.model.reply import CommandReply, JointReply
from gazerig.robot.model.types import JointAngles, JointState

_SAME_RAD = radians(0.1)
_OFF_POINT_RAD = radians(0.5)
"""Distance within which a gaze counts as on its point: converging eyes differ by rounding."""
_AT_END = "at the end of its range"
_TOO_NEAR = "the eyes cannot converge on a nearer point"
_ABSENT = "this rig has none"


def reached_joints(
    reach: ReachableGaze, kinematics: Kinematics, limits: Sequence[JointLimit]
) -> JointAngles:
    """Return the joint angles at which head and eyes come to rest, with open lids."""
    further_rad = kinematics.further_rad(reach.base_rad)
    angles_rad = kinematics.inverse(_command(reach.head_rad, *reach.eyes_rad), further_rad)
    pairs = zip(angles_rad, limits, strict=True)
    return tuple(min(max(angle, limit.low_rad), limit.high_rad) for angle, limit in pairs)


def look_reply(
    target: Target, oculomotor: Oculomotor, kinematics: Kinematics, limits: Sequence[JointLimit]
) -> CommandReply:
    """Return how well eyes and head will reach a stationary point.

    Args:
        target: The point.
        oculomotor: Oculomotor model.
        kinematics: Kinematics of the rig.
        limits: Limits of the joints, in the order of ``kinematics.names``.
    """
    reach = oculomotor.reachable_gaze(target)
    done = reached_joints(reach, kinematics, limits)
    at_rest = (0.0,) * len(done)
    pose = kinematics.forward(JointState(done, at_rest, at_rest, ()))
    error = gaze_error(target.p_world_m, pose, not kinematics.one_pan)
    # A head that stops short because the eyes do the rest is not limited.
    head = reach.facing_rad if error > _OFF_POINT_RAD else reach.head_rad
    further_rad = kinematics.further_rad(reach.base_rad)
    asked = kinematics.inverse(_command(head, *reach.required_eyes_rad), further_rad)
    left, right = line_of_sight(pose, left=True), line_of_sight(pose, left=False)
    far_m = norm(sub(target.p_world_m, pose.p_world_head_m))
    met = add(pose.p_world_head_m, scale(unit(add(left, right)), far_m))
    joints = []
    rows = zip(kinematics.names, asked, done, limits, strict=True)
    for name, wanted, got, (low, high, *_) in rows:
        if name.endswith("lid") or abs(wanted - got) <= _SAME_RAD:
            continue
        if not low + _SAME_RAD < got < high - _SAME_RAD:
            joints.append(JointReply(name, wanted, got, low, high, _AT_END))
        elif reach.too_near:
            joints.append(JointReply(name, wanted, got, low, high, _TOO_NEAR))
    joints += [
        JointReply(name, angle, 0.0, 0.0, 0.0, _ABSENT)
        for name, angle in zip(NECK, head, strict=True)
        if name not in kinematics.names and abs(angle) > _SAME_RAD
    ]
    return CommandReply("", target.p_world_m, met, tuple(joints), error)


def jog_reply(command: Jog, joints: Sequence[str], limits: Sequence[JointLimit]) -> CommandReply:
    """Return the angles that commanded joints will reach."""
    spans = {name: limit[:2] for name, limit in zip(joints, limits, strict=True)}
    found = []
    for name, asked in command.angles_rad:
        low, high = spans[name]
        done = min(max(asked, low), high)
        reason = _AT_END if abs(done - asked) > _SAME_RAD else ""
        found.append(JointReply(name, asked, done, low, high, reason))
    return CommandReply(joints=tuple(found))


def _command(head: Angles3, left: Angles2, right: Angles2) -> GazeCommand:
    return GazeCommand(head, left, right, 1.0, 1.0, "fixate", False, (0.0, 0.0, 0.0), 0, 0, 0)
