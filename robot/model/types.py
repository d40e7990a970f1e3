"""Values of the machine: desired, commanded and measured joints, and the page's snapshot.

Units are rad, m and s. Joints are in the order of ``order_joints``.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple

from msgspec import Struct

from gazerig.gaze.angles import Mat3, Vec3
from gazerig.robot.model.control_source import ControlSource, TrackState
from gazerig.robot.model.conversation import NO_CONVERSATION, ConversationState

if TYPE_CHECKING:
    from gazerig.gaze.types import Face, Salience

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


class JointOutcome(NamedTuple):
    """The guard's result for one joint.

    Attributes:
        desired_rad: Requested angle.
        commanded_rad: Sent angle.
        reason: Reason why they differ, "" if they do not.
    """

    desired_rad: float
    commanded_rad: float
    reason: str


LIMP = "limp"
"""The guard's remark about a joint that has no torque because it is idle."""


class GuardResult(Struct, frozen=True, gc=False):
    """The guard's result of a tick.

    Attributes:
        command_rad: Permitted joint angles.
        level: ok, limited (changed), hold (the neck or all joints hold still), torque_off (the
            torque must be switched off).
        reasons: "joint: reason" for every changed joint, empty if ok.
        desired_rad: Requested joint angles.
        why: One reason per joint, or ``LIMP``, "" if it was not changed; empty if all are "".
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

    @property
    def limp(self) -> tuple[str, ...]:
        """Return the joints that have no torque because they are idle."""
        found = zip(self.joints, self.why, strict=False)
        return tuple([joint for joint, why in found if why == LIMP])

    def applied(self, joint: str) -> JointOutcome:
        """Return the result for one joint.

        Raises:
            ValueError: There is no such joint; the message lists the joints.
        """
        if joint not in self.joints:
            raise ValueError(f"no joint {joint!r}; available: {', '.join(self.joints)}")
        i = self.joints.index(joint)
        return JointOutcome(
            self.desired_rad[i], self.command_rad[i], self.why[i] if self.why else ""
        )


@dataclass(frozen=True, slots=True)
class SeenBody:
    """A moving body for the page, world frame."""

    id: int
    kind: str
    p_world_m: Vec3
    radius_m: float


class CommandedPose(NamedTuple):
    """The poses of head and eyes at the desired angles; names and frames as in Snapshot."""

    R_world_head: Mat3
    p_world_head_m: Vec3
    p_world_eyes_m: tuple[Vec3, Vec3]
    gaze_world: tuple[Vec3, Vec3]
    lids: tuple[float, float]
    lower_lids: tuple[float, float] | None = None


class SeenCamera(NamedTuple):
    """The camera's pose (optical axes: x right, y down, z forward) and field of view.

    Attributes:
        horizontal_rad: Horizontal field of view.
        aspect: Width of the image over its height.
    """

    R_world_camera: Mat3
    p_world_camera_m: Vec3
    horizontal_rad: float
    aspect: float


class Trail(NamedTuple):
    """The joints of one tick: desired, commanded and measured."""

    t_s: float
    desired_rad: JointAngles
    commanded_rad: JointAngles
    measured_rad: JointAngles


class ServoLimits(NamedTuple):
    """The limits of the servos' readings, one value per joint.

    Attributes:
        warm_c, hot_c: Temperatures at which the guard slows the joint down and stops it.
        low_v, high_v: Voltages outside which the guard slows the joint down.
        heavy: Share of the stall torque that is allowed continuously.
    """

    warm_c: tuple[float, ...]
    hot_c: tuple[float, ...]
    low_v: tuple[float, ...]
    high_v: tuple[float, ...]
    heavy: tuple[float, ...]


class Servos(NamedTuple):
    """The servos' readings, one value per joint; empty if unknown.

    Attributes:
        temperature_c, voltage_v: Readings, None before the first.
        load: Signed share of the stall torque, -1..1.
        torque: Whether the torque is on.
        fault: Latched errors as text.
        age_s: Time since the last answer.
        unanswered: Ticks without an answer since the start, empty if they are not counted.
        limits: Limits of the readings.
        limp: Names of joints without torque because they are idle.
    """

    temperature_c: tuple[float | None, ...] = ()
    voltage_v: tuple[float | None, ...] = ()
    load: tuple[float, ...] = ()
    torque: tuple[bool, ...] = ()
    fault: tuple[str, ...] = ()
    age_s: tuple[float, ...] = ()
    unanswered: tuple[int, ...] = ()
    limits: ServoLimits | None = None
    limp: tuple[str, ...] = ()


class LoopFigures(NamedTuple):
    """The loop's timing over the last ``over_s`` seconds.

    Attributes:
        p50_ms, p99_ms, worst_ms: Deviation of the time between two ticks from whole slots.
        overruns: Slots skipped in these seconds.
        overruns_ever: Slots skipped since the start.
        late_share: Share of skipped slots.
        latest_ms: Largest delay of a tick after its slot.
    """

    rate_hz: float
    p50_ms: float
    p99_ms: float
    worst_ms: float
    overruns: int
    overruns_ever: int
    over_s: float
    late_share: float = 0.0
    latest_ms: float = 0.0


class SeenSaccade(NamedTuple):
    """A saccade, with the angle by which the measured gaze has moved."""

    onset_s: float
    duration_s: float
    amplitude_deg: float


class SeenBlink(NamedTuple):
    """A blink."""

    start_s: float
    duration_s: float


SeenEvent = SeenSaccade | SeenBlink


@dataclass(frozen=True, slots=True)
class Snapshot:
    """A snapshot of the running rig for the page.

    Attributes:
        measured_rad, desired_rad, commanded_rad: Angles of the joints.
        R_world_head, p_world_head_m: Measured head frame.
        p_world_eyes_m: Left and right eye centres.
        gaze_world: Unit lines of sight of the left and the right eye.
        lids: Measured left and right opening, 0..1.
        target_name, why: Target, e.g. "face 3: left eye", and the reason for it; while a client
            is in control, the client and its command.
        health: State of the bus as text.
        behaviour: Present behaviour.
        saliences: Saliences of the winner and the next bodies, highest first.
        perception: Age of the frame, distances and their sources, apparent motion of still things.
        target_kind, target_part: Target as in gaze.types.Target; while a client is in
            control, the kind of control and None.
        character, conversation: Present ones, "" if unknown.
        stopped: Reason for a stop, "" while the robot moves.
        control_source: Source of control.
        headline: Present activity of the head in one sentence.
        frame_age_s: Age of the newest frame, None before the first.
        commanded_pose: Poses of head and eyes at the desired angles.
        camera: Pose and field of view of the camera.
        servos, timing: Health of the servos and timing of the loop.
        busy: Text if the computer is too busy, otherwise "".
        worst: The guard's worst level since the last snapshot.
        trail, events: Joints and finished eye movements since the last snapshot, oldest first.
        joints: Names of the joints.
        estimated: Joints without feedback, whose measured angle is their goal, moved at their
            servos' known speed.
        lower_lids: Openings of the lower lids, None if the rig has none.
        p_world_pivot_m: Intersection of the neck's pitch and roll axes, None if unknown.
        plan: Choice of the action planner and its reason, "" without one or under a client's
            control.
        expressed: Names of the present track and expression, "" for none.
        tracks: Tracks that play, and the last ones that have ended.
        talk: State of the conversation, as a voice agent reports it.
    """

    t_s: float
    measured_rad: JointAngles
    desired_rad: JointAngles
    R_world_head: Mat3
    p_world_head_m: Vec3
    p_world_eyes_m: tuple[Vec3, Vec3]
    gaze_world: tuple[Vec3, Vec3]
    lids: tuple[float, float]
    p_world_target_m: Vec3
    target_name: str
    why: str
    phase: str
    level: Level
    reasons: tuple[str, ...]
    faces: tuple["Face", ...]
    bodies: tuple[SeenBody, ...]
    health: str = ""
    behaviour: str = ""
    saliences: tuple["Salience", ...] = ()
    perception: str = ""
    commanded_rad: JointAngles = ()
    target_kind: str = ""
    target_part: str | None = None
    character: str = ""
    conversation: str = ""
    stopped: str = ""
    control_source: ControlSource = ControlSource()
    headline: str = ""
    frame_age_s: float | None = None
    commanded_pose: CommandedPose | None = None
    camera: SeenCamera | None = None
    servos: Servos = Servos()
    timing: LoopFigures | None = None
    busy: str = ""
    worst: Level = "ok"
    trail: tuple[Trail, ...] = ()
    events: tuple[SeenEvent, ...] = ()
    joints: tuple[str, ...] = ()
    estimated: tuple[str, ...] = ()
    lower_lids: tuple[float, float] | None = None
    p_world_pivot_m: Vec3 | None = None
    plan: str = ""
    expressed: tuple[str, ...] = ()
    tracks: tuple[TrackState, ...] = ()
    talk: ConversationState = NO_CONVERSATION
