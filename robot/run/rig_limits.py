"""Conversion of a rig's file to radians, metres and servos, for the parts of the robot."""

from collections.abc import Mapping
from math import radians

import numpy as np

from gazerig.config.rig import Rig
from gazerig.drivers.types import ServoConfig
from gazerig.gaze.track.animation import NEUTRAL, Face
from gazerig.gaze.track.track import EYE_CHANNELS
from gazerig.gaze.types import Angles2, Floats, Vec3
from gazerig.robot.loop.tracks import TrackFit
from gazerig.robot.model.coupling import servo_setups
from gazerig.robot.model.joint import JointLimit, JointParams
from gazerig.robot.model.kinematics import LIDS, NECK, LidEnds
from gazerig.robot.model.types import further_joints, order_joints

EyeLimits = tuple[tuple[Angles2, Angles2], tuple[Angles2, Angles2]]
"""Limits of the left and the right eye: ((yaw low, high), (pitch low, high)), radians."""


def limits(joints: Mapping[str, JointParams]) -> tuple[JointLimit, ...]:
    """Return the joints' limits, in the order of ``order_joints``."""
    return tuple(joints[name].limit() for name in order_joints(joints))


def bus_names(rig: Rig) -> tuple[str, ...]:
    """Return the names of the buses with joints; the unnamed one, "", is the first."""
    used = {joint.bus for joint in rig.joints.values()}
    return tuple(name for name in ("", *rig.buses) if name in used)


def joints_on(rig: Rig, name: str) -> tuple[str, ...]:
    """Return the joints of one bus, in the order of all joints."""
    return tuple(joint for joint in rig.names if rig.joints[joint].bus == name)


def servo_configs(rig: Rig) -> tuple[ServoConfig, ...]:
    """Return the configuration of a rig's servos for the buses, in the order of its joints."""
    gentle_deg_s = rig.guard.soft_start_speed_deg_s
    return servo_setups(rig.joints, park_rad(rig), gentle_deg_s, rig.couplings.values())


def face_parts_m(rig: Rig) -> dict[str, Vec3]:
    """Return the rig's own positions of face parts in metres."""
    return {code: (x / 1e3, y / 1e3, z / 1e3) for code, (x, y, z) in rig.face_parts_mm.items()}


def lid_ends(rig: Rig) -> dict[str, LidEnds]:
    """Return the joint angles of the rig's shut and open lids."""
    ends = {}
    for name in LIDS:
        pair = rig.lid_joints.ends_deg(name)
        if name in rig.joints and pair is not None:
            ends[name] = (radians(pair[0]), radians(pair[1]))
    return ends


def lid_spans(rig: Rig) -> dict[str, float]:
    """Return the travel of each lid from shut to open, in radians."""
    return {name: wide - shut for name, (shut, wide) in lid_ends(rig).items()}


def eye_limits(rig: Rig) -> EyeLimits:
    """Return the eyes' ranges: the narrower of the joints' and the profile's."""
    return (_eye_ranges(rig, "left"), _eye_ranges(rig, "right"))


def head_limits(rig: Rig) -> tuple[float, tuple[Angles2, Angles2], Angles2]:
    """Return the smallest eye limit and the neck's ranges.

    Returns:
        The limit, ((yaw low, high), (pitch low, high)) and (roll low, high), radians.
    """
    smallest = min(abs(end) for eye in eye_limits(rig) for span in eye for end in span)
    neck = (
        _joint_range(rig, "neck_yaw", rig.ranges.neck_yaw_deg),
        _joint_range(rig, "neck_pitch", 180.0),
    )
    return smallest, neck, neck_span(rig, "neck_roll")


def neck_span(rig: Rig, name: str) -> Angles2:
    """Return the range of an axis of the neck; (0, 0) without it."""
    return _joint_range(rig, name, 180.0)


def _eye_ranges(rig: Rig, side: str) -> tuple[Angles2, Angles2]:
    yaw = _joint_range(rig, _eye_joint(rig, side, "pan"), rig.ranges.eye_yaw_deg)
    return yaw, _joint_range(rig, _eye_joint(rig, side, "tilt"), rig.ranges.eye_pitch_deg)


def _eye_joint(rig: Rig, side: str, axis: str) -> str:
    """Return the name of the joint that turns an eye: its own, or that of both eyes."""
    own = f"{side}_eye_{axis}"
    return own if own in rig.joints else f"eyes_{axis}"


def _joint_range(rig: Rig, name: str, most_deg: float) -> Angles2:
    """Return a joint's range within +-most_deg, in radians; (0, 0) without it."""
    joint = rig.joints.get(name)
    if joint is None:
        return (0.0, 0.0)
    return radians(max(joint.min_deg, -most_deg)), radians(min(joint.max_deg, most_deg))


def park_rad(rig: Rig) -> dict[str, float]:
    """Return the parking pose by joint; omitted joints go to 0."""
    return {name: radians(angle) for name, angle in rig.park_deg.items()}


def faces(rig: Rig) -> dict[str, Face]:
    """Return the expressions of a rig, neutral first, and its levels."""
    expressions = {NEUTRAL: {}, **rig.expressions} if rig.expressions else {}
    found = {
        name: Face("expression", offsets(rig, {}), offsets(rig, angles), rig.expression_blend_s)
        for name, angles in expressions.items()
    }
    for name, level in rig.levels.items():
        low = offsets(rig, {level.joint: level.low_deg})
        change = offsets(rig, {level.joint: level.high_deg - level.low_deg})
        found[name] = Face("level", low, change, level.smoothing_ms / 1e3)
    return found


def track_fit(rig: Rig) -> TrackFit:
    """Return the fit of tracks to a rig."""
    return TrackFit(rig.names, lid_spans(rig), faces(rig))


def offsets(rig: Rig, angles_deg: Mapping[str, float]) -> Floats:
    """Return angles added to joints as offsets of the channels from rest.

    The angle of a lid becomes a factor of its opening, such that the open lid moves by this angle
    and the shut lid stays: blinks still shut it.

    Args:
        rig: Defines its joints and the ends of its lids.
        angles_deg: Angles by joint, without eyes.
    """
    spans, joints = lid_spans(rig), (*NECK, *EYE_CHANNELS, *LIDS, *further_joints(rig.joints))
    return np.array([radians(angles_deg.get(one, 0.0)) / spans.get(one, 1.0) for one in joints])
