"""State of a head for programs: joints, gaze and people.

World frame: at the neck base, x ahead, y left, z up. Angles in rad, yaw + left, pitch + up,
roll + right ear down; lengths in m; times in s of the rig's own clock.
"""

from collections.abc import Mapping
from math import degrees
from typing import Literal

from msgspec import Struct

from gazerig.gaze.angles import yaw_pitch
from gazerig.gaze.attention.addressing import Addressing
from gazerig.gaze.types import (
    ORDERED,
    PART_NAMES,
    PARTS,
    Angles2,
    Angles3,
    Face,
    Salience,
    Target,
    Vec3,
)
from gazerig.robot.loop.tick import Tick, cyclopean_direction, target_name
from gazerig.robot.model.reply import (
    NO_CLIENT_CONTROL,
    NO_CONVERSATION,
    ControlSource,
    ControlState,
    ConversationState,
    TrackState,
    control_sentence,
)

EventKind = Literal[
    "message", "saccade_start", "saccade_landing", "blink", "target", "person_arrived",
    "person_left", "addressed", "track_finished", "cue",
]  # fmt: skip
"""message: of the bus, the camera or a program's request; all others are found in the ticks."""


class JointReading(Struct, frozen=True):
    """A joint in one tick.

    Attributes:
        name: Name in the rig file.
        desired_rad: Angle requested by the gaze, a track or a program.
        commanded_rad: Angle that the guard sent to the servo.
        measured_rad: Angle reported by the servo; see ``estimated``.
        velocity_rad_s: Measured speed.
        estimated: Whether the servo has no feedback: ``measured_rad`` is then its goal, moved at
            its known speed.
        limited: Reason why ``commanded_rad`` differs from ``desired_rad``, "" if it does not.
        torque: Whether the torque is on, None if unknown.
        fault: Latched hardware errors, "" for none.
        load: Share of the stall torque, signed, -1..1, None if unknown.
        temperature_c: Temperature, None before the first reading.
        voltage_v: Supply voltage, None before the first reading.
        age_s: Time since the servo's last answer.
    """

    name: str
    desired_rad: float
    commanded_rad: float
    measured_rad: float
    velocity_rad_s: float
    estimated: bool = False
    limited: str = ""
    torque: bool | None = None
    fault: str = ""
    load: float | None = None
    temperature_c: float | None = None
    voltage_v: float | None = None
    age_s: float = 0.0

    @property
    def commanded_deg(self) -> float:
        """Return ``commanded_rad`` in degrees."""
        return degrees(self.commanded_rad)

    @property
    def measured_deg(self) -> float:
        """Return ``measured_rad`` in degrees."""
        return degrees(self.measured_rad)


class GazeReading(Struct, frozen=True):
    """The measured poses of head and eyes, and their target.

    Attributes:
        target: Gaze target, e.g. "face 3: left eye"; while a client is in control, its name.
        reason: Reason for the target.
        point_m: Desired gaze point of both eyes, world.
        direction_rad: Measured (yaw, pitch) of the mean line of sight, world.
        head_m: Point midway between the eyes, world.
        head_rad: (yaw, pitch, roll) of the head.
        lids: Opening of the left and the right upper lid, 0 shut .. 1 open.
        phase: "fixate", "saccade" or "pursue"; "held" while joints are held, "stopped", "parking".
        blink: Whether a blink is in progress.
        kind: Kind of the target: "face", "hand", "thing", "idle" and so on; while something else
            controls the head, that of ``control_source``.
        part: Part of the face, e.g. "left eye", None if the target is no face.
    """

    target: str
    reason: str
    point_m: Vec3
    direction_rad: Angles2
    head_m: Vec3
    head_rad: Angles3
    lids: Angles2
    phase: str
    blink: bool
    kind: str = ""
    part: str | None = None

    @property
    def direction_deg(self) -> Angles2:
        """Return ``direction_rad`` in degrees."""
        yaw, pitch = self.direction_rad
        return degrees(yaw), degrees(pitch)


class Person(Struct, frozen=True):
    """A visible person at the time of the frame.

    Attributes:
        id: Number for ``look_at_person``; it is constant while the person is visible.
        position_m: Middle of the face, the nose, world.
        facing: Unit vector out of the face, world.
        parts_m: Positions of the parts of the face, world: "left eye", "mouth" and so on; left and
            right are the person's own.
        confidence: Confidence of the detector, 0..1.
        distance_from: Source of the distance: "camera", "face size", or "" if unknown.
        age_s: Age of the frame.
        looks_at_head: Whether the person looks at the head, None if that is too uncertain.
        speaks: Whether the mouth moves as in speech, None while it is not seen.
    """

    id: int
    position_m: Vec3
    facing: Vec3
    parts_m: Mapping[str, Vec3]
    confidence: float
    distance_from: str
    age_s: float
    looks_at_head: bool | None = None
    speaks: bool | None = None


class HeadEvent(Struct, frozen=True):
    """An event: a message, or a change of gaze, people or track.

    Attributes:
        number: Number of the event, from 1.
        t_s: The rig's own time.
        text: Description in one line.
        kind: Kind of event.
        subject: Number of the person, name of the target, of the track or of the cue, "" for none.
    """

    number: int
    t_s: float
    text: str
    kind: EventKind = "message"
    subject: int | str = ""


class HeadState(Struct, frozen=True):
    """The state of a head in one tick of the control loop.

    Attributes:
        t_s: Time of the head's own clock: from 0 in simulated time, otherwise as time.monotonic().
        joints: Joints by name.
        gaze: Poses of head and eyes.
        people: Visible people.
        level: Level of the guard: "ok", "limited", "hold" or "torque_off".
        reasons: Limits applied by the guard, "joint: reason".
        stopped: Reason for a stop, "" while the head moves.
        controlled_by: Client in control and its command, "" while the head chooses.
        client_control: State of the newest client's control.
        tracks: Tracks that play, and the last ones that have ended.
        control_source: Present source of control: gaze models, a client, a track, a stop.
        headline: Present activity of the head in one sentence.
        conversation: State of the conversation that a voice agent reports.
        frame_s: Time of the newest camera frame, None before the first.
        saliences: Saliences of the winner and the next bodies, highest first; empty while a client
            is in control.
        plan: Choice of the action planner and its reason, "" without one.
        addressed_by: Number of the person who addresses the head, looks at it to talk with it; None
            if nobody does.
        addressed: The people who do so, with the beginning of the look and the confidence; the one
            in front keeps the head until the end.
    """

    t_s: float
    joints: Mapping[str, JointReading]
    gaze: GazeReading
    people: tuple[Person, ...]
    level: str
    reasons: tuple[str, ...]
    stopped: str
    controlled_by: str
    client_control: ControlState = NO_CLIENT_CONTROL
    tracks: tuple[TrackState, ...] = ()
    frame_s: float | None = None
    control_source: ControlSource = ControlSource()
    headline: str = ""
    conversation: ConversationState = NO_CONVERSATION
    saliences: tuple[Salience, ...] = ()
    plan: str = ""
    addressed_by: int | None = None
    addressed: tuple[Addressing, ...] = ()


class HeadReport(Struct, frozen=True):
    """The newest tick, None before the first, and events; number: that of the newest event."""

    state: HeadState | None
    events: tuple[HeadEvent, ...]
    number: int = 0


def head_state(tick: Tick) -> HeadState:
    """Return the state of a head in a tick."""
    percept, source = tick.percept, tick.control_source
    chooses = not source.overrides_gaze
    gaze, headline = _gaze(tick, source)
    return HeadState(
        tick.t_s,
        _joints(tick),
        gaze,
        tuple(_person(face, percept.age_s(tick.t_s)) for face in percept.faces)
        if percept is not None
        else (),
        tick.guard_result.level,
        tick.guard_result.reasons,
        tick.stopped,
        tick.controlled_by,
        tick.client_control,
        tick.tracks,
        percept.captured_s if percept is not None else None,
        source,
        headline,
        tick.conversation,
        tick.target.saliences if chooses else (),
        tick.target.plan if chooses else "",
        tick.addressed_by,
        tick.addressed,
    )


def _joints(tick: Tick) -> dict[str, JointReading]:
    guard, state = tick.guard_result, tick.joints
    unknown = (None,) * len(guard.joints)
    columns = zip(
        guard.joints,
        guard.desired_rad or tick.desired_rad,
        guard.command_rad,
        state.position_rad,
        state.velocity_rad_s,
        [measured is False for measured in state.measured or unknown],
        [why or "" for why in guard.why or unknown],
        state.torque or unknown,
        [fault or "" for fault in state.fault or unknown],
        state.load or unknown,
        state.temperature_c or unknown,
        state.voltage_v or unknown,
        [tick.t_s - at_s for at_s in state.measured_s] or [0.0] * len(unknown),
        strict=True,
    )
    return {row[0]: JointReading(*row) for row in columns}


def _gaze(tick: Tick, source: ControlSource) -> tuple[GazeReading, str]:
    """Return the gaze and the head's activity; while a client is in control, only that."""
    pose, gaze, target, guard = tick.pose, tick.gaze, tick.target, tick.guard_result
    name, reason, phase, kind = target_name(target), target.why, str(gaze.phase), target.kind
    part = PART_NAMES[target.part] if target.part is not None else None
    headline = _looks_text(target)
    sentence = control_sentence(source)
    if source.kind == "track":
        headline = f"{sentence}, and {headline}"
    elif source.overrides_gaze:
        headline = reason = sentence
        kind, part = source.kind, None
        if limited := tick.client_control.limited:
            headline = reason = f"{sentence}; {limited}"
        if source.kind == "joint":
            name, phase = f"{' and '.join(source.joints)} held", "held"
        elif source.kind in ("stopped", "parking"):
            name = phase = source.kind
    if guard.level == "torque_off" and source.kind not in ("stopped", "parking"):
        headline = reason = f"the torque is off: {' and '.join(guard.critical_reasons[:1])}"
    reading = GazeReading(
        name,
        reason,
        gaze.gaze_point_world_m,
        yaw_pitch(cyclopean_direction(tick)),
        pose.p_world_head_m,
        pose.head_rad,
        (pose.lid_left, pose.lid_right),
        phase,
        gaze.blink,
        kind,
        part,
    )
    return reading, headline


def _looks_text(target: Target) -> str:
    """Return the gaze's activity as the predicate of a sentence about the head."""
    match target.kind:
        case "rest":
            return "looks ahead: nobody is visible"
        case "glance":
            return "looks around: nobody is visible"
        case "search":
            return "looks for a person who has left"
        case "away":
            return "looks away for a moment"
        case "face":
            part = f" ({PART_NAMES[target.part]})" if target.part is not None else ""
            return f"looks at person {target.id}{part}"
        case "thing":
            return "looks at a moving object"
        case kind:
            return "looks at its point" if kind == ORDERED else f"looks at a {kind}"


def _person(face: Face, age_s: float) -> Person:
    R = face.R_world_face
    parts = {PART_NAMES[code]: p for code, p in zip(PARTS, face.parts_world_m, strict=True)}
    return Person(
        face.id,
        face.p_world_m,
        (R[0][0], R[1][0], R[2][0]),
        parts,
        face.confidence,
        face.distance_from,
        age_s,
        face.looks_at_head,
        face.speaks,
    )
