"""Values of the machine: joints as desired, commanded and measured, and what the page is shown.

Radians, metres, seconds; joints in the order of ``in_order``.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple

from gazerig.gaze.angles import Mat3, Vec3
from gazerig.robot.model.leader import Leader

if TYPE_CHECKING:
    from gazerig.gaze.types import Salience

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
"""The joints that gaze moves. A rig has some of them: eyes that turn each by itself or both by
one linkage (``eyes_pan``, ``eyes_tilt``), any of the lids, any axes of the neck. Joints of any
other name (jaw, brows, ears) are moved by gestures, expressions, levels and programs."""

JOINT_NAME = re.compile(r"[a-z][a-z0-9_]{0,39}")
"""What a joint may be called."""

JointAngles = tuple[float, ...]
"""One angle a joint, in the order of the rig's joints (``in_order``)."""


def in_order(names: Iterable[str]) -> tuple[str, ...]:
    """Return a rig's joints in the order in which all sequences of joints have them.

    Those that gaze moves come first, in the order of ``GAZE_JOINTS``, then all others by name.
    """
    there = set(names)
    others = sorted(there.difference(GAZE_JOINTS))
    return (*(name for name in GAZE_JOINTS if name in there), *others)


def further(names: Iterable[str]) -> tuple[str, ...]:
    """Return those of a rig's joints that gaze does not move, in the order of ``in_order``."""
    return tuple(name for name in in_order(names) if name not in GAZE_JOINTS)


Level = Literal["ok", "limited", "hold", "torque_off"]


class JointState(NamedTuple):
    """Joints as measured.

    position_rad, velocity_rad_s: last fresh values
    measured_s: host time of each joint's last fresh answer
    missing: joints without a fresh answer in this tick

    What follows is empty where nothing is known, else has one value a joint:

    torque: the torque is on
    fault: latched hardware errors in words, "" where none
    load: share of the servo's stall torque, signed, -1..1
    temperature_c, voltage_v: None before the first reading
    rearmed: the torque came on again with the measured position as goal
    measured: False where the servo tells nothing: position and velocity are its goal moved
        by the speed it is known to have
    """

    position_rad: JointAngles
    velocity_rad_s: JointAngles
    measured_s: tuple[float, ...]
    missing: tuple[str, ...]
    torque: tuple[bool, ...] = ()
    fault: tuple[str, ...] = ()
    load: tuple[float, ...] = ()
    temperature_c: tuple[float | None, ...] = ()
    voltage_v: tuple[float | None, ...] = ()
    rearmed: tuple[bool, ...] = ()
    measured: tuple[bool, ...] = ()


class JointOutcome(NamedTuple):
    """What became of what was desired of one joint.

    desired_rad: as it was asked for; commanded_rad: as it was sent
    reason: why they differ, "" where nothing stood in the way
    """

    desired_rad: float
    commanded_rad: float
    reason: str


class GuardResult(NamedTuple):
    """What the guard let through.

    command_rad: permitted joint angles
    level: ok, limited (changed), hold (neck or all stand still), torque_off (torque must be
        switched off)
    reasons: "joint: reason" for every joint that was changed, empty when ok
    desired_rad: what was asked for
    why: one reason a joint, "" where it was not changed; empty when ok
    critical_reasons: those of the reasons that make the level what it is
    joints: the names of the joints
    """

    command_rad: JointAngles
    level: Level
    reasons: tuple[str, ...]
    desired_rad: JointAngles = ()
    why: tuple[str, ...] = ()
    critical_reasons: tuple[str, ...] = ()
    joints: tuple[str, ...] = ()

    def applied(self, joint: str) -> JointOutcome:
        """Return what became of what was desired of one joint.

        Raises:
            ValueError: there is no such joint; the message lists those there are.
        """
        if joint not in self.joints:
            raise ValueError(f"no joint {joint!r}; there is {', '.join(self.joints)}")
        i = self.joints.index(joint)
        return JointOutcome(
            self.desired_rad[i], self.command_rad[i], self.why[i] if self.why else ""
        )


@dataclass(frozen=True, slots=True)
class SeenFace:
    """A face as the page draws it: identity, centre, axes and the eight parts, world frame.

    v_world_m_s: velocity of the centre; places are those at the frame's capture
    looks_at_head: whether the person looks at the head, None where that is too uncertain
    speaks: whether the mouth moves as of a speaking person, None where it is not found
    """

    id: int
    p_world_m: Vec3
    R_world_face: Mat3
    parts_world_m: tuple[Vec3, ...]
    v_world_m_s: Vec3 = (0.0, 0.0, 0.0)
    looks_at_head: bool | None = None
    speaks: bool | None = None


@dataclass(frozen=True, slots=True)
class SeenBody:
    """A moving body as the page draws it, world frame."""

    id: int
    kind: str
    p_world_m: Vec3
    radius_m: float


class CommandedPose(NamedTuple):
    """Where desired angles would have head and eyes: names and frames are those of Snapshot."""

    R_world_head: Mat3
    p_world_head_m: Vec3
    p_world_eyes_m: tuple[Vec3, Vec3]
    gaze_world: tuple[Vec3, Vec3]
    lids: tuple[float, float]
    lower_lids: tuple[float, float] | None = None


class OtherHead(NamedTuple):
    """Another head of the same world.

    name: in the world's script; headline: what it does now, in one sentence
    level: of its guard
    """

    name: str
    headline: str
    level: Level = "ok"


class SeenCamera(NamedTuple):
    """Where the camera is (optical axes: x right, y down, z forward) and what it covers.

    horizontal_rad: field of view from side to side; aspect: the image's width over height
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
    """From where one servo's figures are no longer good, each a value a joint.

    warm_c, hot_c: the guard slows the joint down, and stops it
    low_v, high_v: the guard slows the joint down outside
    heavy: share of the stall torque that may last
    """

    warm_c: tuple[float, ...]
    hot_c: tuple[float, ...]
    low_v: tuple[float, ...]
    high_v: tuple[float, ...]
    heavy: tuple[float, ...]


class Servos(NamedTuple):
    """What the servos say of themselves, each a value a joint; empty where nothing is known.

    temperature_c, voltage_v: None before the first reading; load: signed, -1..1
    fault: latched errors in words; age_s: since the last answer
    unanswered: ticks without an answer since the start, empty if they are not counted
    """

    temperature_c: tuple[float | None, ...] = ()
    voltage_v: tuple[float | None, ...] = ()
    load: tuple[float, ...] = ()
    torque: tuple[bool, ...] = ()
    fault: tuple[str, ...] = ()
    age_s: tuple[float, ...] = ()
    unanswered: tuple[int, ...] = ()
    limits: ServoLimits | None = None


class LoopFigures(NamedTuple):
    """How the loop keeps its time, over the last ``over_s`` seconds.

    p50_ms, p99_ms, worst_ms: how far the time between two ticks is off its slots
    overruns: slots skipped in these seconds; overruns_ever: since the start
    late_share: slots skipped, of all; latest_ms: how much later than its slot a tick came at worst
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
    """A jump of the eyes, as measured."""

    onset_s: float
    duration_s: float
    amplitude_deg: float
    peak_deg_s: float


class SeenFixation(NamedTuple):
    """A rest of the eyes; part: face part code where it lay on a face."""

    start_s: float
    duration_s: float
    part: str | None


class SeenBlink(NamedTuple):
    """A blink."""

    start_s: float
    duration_s: float


SeenEvent = SeenSaccade | SeenFixation | SeenBlink


@dataclass(frozen=True, slots=True)
class Snapshot:
    """One frozen look at the running rig, for people to watch.

    joints: names of the joints; measured_rad, desired_rad, commanded_rad: their angles
    estimated: joints whose servos tell nothing: what stands for a measurement is their goal
        moved by the speed they are known to have
    R_world_head, p_world_head_m: measured head frame
    p_world_eyes_m: left and right eye centres; gaze_world: their unit lines of sight
    lids: left and right opening 0..1, measured; lower_lids: that of the lower lids, None
        where the rig has none
    leader: who leads; leads_words: the same in one sentence
    headline: what the head does now, in one sentence
    target_name: e.g. "face 3: left eye", and why it won; while somebody leads, who and with what
    rate_hz: control rate of the last second; health: bus figures in words
    behaviour: the behaviour in force; saliences: of the winner and the next bodies, highest first
    perception: age of the frame, distances and what they rest on, still things that seem to move
    target_kind, target_id, target_part: the target as in gaze.types.Target; while somebody leads,
        the kind of leader, -1 and None
    character, conversation: those in force, "" if unknown
    stopped: why the robot was stopped, "" while it moves
    led: who leads gaze or joints and how well the head can follow, "" while no client leads
    frame_age_s: None before the first frame
    commanded_pose: head and eyes at the desired angles; camera: where the camera is
    field_deg: what an eye can see, towards temple, nose, above and below
    servos, timing: health of servos and loop; busy: that the computer is too busy, and how it
        shows, "" where it is not
    worst: the guard's gravest level since the last snapshot
    trail, events: joints, and eye movements that ended, since the last snapshot, oldest first
    p_world_pivot_m: where the pitch and roll axes of the neck meet, None where it is not known
    plan: what the action planner has chosen and why, "" without one and while somebody leads
    others: the other heads of the same world
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
    faces: tuple[SeenFace, ...]
    bodies: tuple[SeenBody, ...]
    rate_hz: float
    health: str
    behaviour: str = ""
    saliences: tuple["Salience", ...] = ()
    perception: str = ""
    commanded_rad: JointAngles = ()
    target_kind: str = ""
    target_id: int = -1
    target_part: str | None = None
    character: str = ""
    conversation: str = ""
    stopped: str = ""
    led: str = ""
    leader: Leader = Leader()
    leads_words: str = ""
    headline: str = ""
    frame_age_s: float | None = None
    commanded_pose: CommandedPose | None = None
    camera: SeenCamera | None = None
    field_deg: tuple[float, float, float, float] | None = None
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
    others: tuple[OtherHead, ...] = ()
