"""Values of the machine: desired, commanded and measured joints, and the loop's timing.

Units are rad, m and s. Joints are in the order of ``order_joints``.
"""

import re
from collections.abc import Iterable
from typing import Literal

from msgspec import Struct

GAZE_JOINTS = (
    "left_eye_pan",
    "left_eye_tilt",
    "right_eye_pan",
    "right_eye_tilt",
    "eyes_pan",
    "eyes_tilt",
    "left_upper_lid",
    "right_upper_lid",
    "left_lower_lid",
    "right_lower_lid",
    "neck_yaw",
    "neck_pitch",
    "neck_roll",
)
"""The joints that gaze moves. A rig has some of them: eyes that turn separately or on a common
linkage (``eyes_pan``, ``eyes_tilt``), any of the lids, any axes of the neck. Joints with other
names (jaw, brows, ears) are moved by tracks, expressions, levels and programs."""

JOINT_NAME = re.compile(r"[a-z][a-z0-9_]{0,39}")
"""Pattern of joint names."""

JointAngles = tuple[float, ...]
"""One angle per joint, in the order of the rig's joints (``order_joints``)."""


def order_joints(names: Iterable[str]) -> tuple[str, ...]:
    """Return a rig's joints in the order of all sequences of joints.

    Joints that gaze moves come first, in the order of ``GAZE_JOINTS``, then all others by name.
    """
    there = set(names)
    others = sorted(there.difference(GAZE_JOINTS))
    return (*(name for name in GAZE_JOINTS if name in there), *others)


def further_joints(names: Iterable[str]) -> tuple[str, ...]:
    """Return a rig's joints that gaze does not move, in the order of ``order_joints``."""
    return tuple(name for name in order_joints(names) if name not in GAZE_JOINTS)


Level = Literal["ok", "limited", "hold", "torque_off"]


class JointState(Struct, frozen=True, gc=False):
    """The measured joints. The fields from ``torque`` on are empty if unknown.

    Attributes:
        position_rad, velocity_rad_s: Last fresh values.
        measured_s: Host time of each joint's last fresh answer.
        missing: Joints without a fresh answer in this tick.
        torque: Whether the torque is on.
        fault: Latched hardware errors as text, "" for none.
        load: Share of the servo's stall torque, signed, -1..1.
        temperature_c, voltage_v: Readings, None before the first.
        rearmed: Whether torque was switched on again with the measured position as goal.
        measured: False without feedback: position and velocity are then those of the goal,
            moved at the servo's known speed.
    """

    position_rad: JointAngles
    velocity_rad_s: JointAngles
    measured_s: tuple[float, ...]
    missing: tuple[str, ...]
    torque: tuple[bool, ...] = ()
    fault: tuple[str, ...] = ()
    load: tuple[float, ...] = ()
    temperature_c: tuple[int | float | None, ...] = ()
    voltage_v: tuple[float | None, ...] = ()
    rearmed: tuple[bool, ...] = ()
    measured: tuple[bool, ...] = ()


class GuardResult(Struct, frozen=True, gc=False):
    """The guard's result of a tick.

    Attributes:
        command_rad: Permitted joint angles.
        level: ok, limited (changed), hold (the neck or all joints hold still), torque_off (the
            torque must be switched off).
        reasons: "joint: reason" for every changed joint, empty if ok.
        desired_rad: Requested joint angles.
        why: One reason per joint, "" if it was not changed; empty if all are "".
        critical_reasons: The reasons that determine the level.
        joints: Names of the joints.
    """

    command_rad: JointAngles
    level: Level
    reasons: tuple[str, ...]
    desired_rad: JointAngles = ()
    why: tuple[str, ...] = ()
    critical_reasons: tuple[str, ...] = ()
    joints: tuple[str, ...] = ()


class LoopFigures(Struct, frozen=True):
    """The loop's timing over the last ``over_s`` seconds.

    Attributes:
        overruns: Skipped slots.
        late_share: Share of skipped slots.
        latest_ms: Largest delay of a tick after its slot.
    """

    rate_hz: float
    overruns: int
    over_s: float
    late_share: float
    latest_ms: float
