"""Commands to a running robot from the page, another program or the command line.

A command is plain data. It is sent between processes as JSON and executed at the next tick. A
recording of a run contains it, so that the run can be repeated.

The latch of a stop stores the client that stopped, the shortest duration, and the clients that may
resume. Its times are those of the ticks, so a repeated run is stopped and resumed as recorded.
"""

from collections.abc import Mapping
from typing import Literal, NamedTuple

from gazerig.gaze.angles import Angles2, Vec3

Value = float | int | bool | str | None | tuple["Value", ...] | Mapping[str, "Value"]
"""Value of a key in a rig's YAML."""

Frame = Literal["world", "head"]
HEARTBEAT_S = 1.0
"""A control or conversation without ``stay`` ends if it is not renewed for this time."""
FAR_M = 100.0
"""Distance beyond which the eyes are practically parallel."""


class Ask(NamedTuple):
    """A choice from a menu: a behaviour, a mode of conversation, a motion of the lids."""

    menu: str
    choice: str


class LookAt(NamedTuple):
    """Look at a point in the world instead of the models' target; None frees the gaze.

    Attributes:
        p_world_m: Point in m, x ahead, y left, z up of the neck base.
        who: Name of the client.
        stay: Keep the target until another command; if False, it needs a ``Renew`` at least
            every ``HEARTBEAT_S``.
        for_s: Duration in s, None if unlimited.
        pointer: Whether the point is a person's mouse pointer, for texts.
    """

    p_world_m: Vec3 | None
    who: str = ""
    stay: bool = False
    for_s: float | None = None
    pointer: bool = False


class LookAtInHead(NamedTuple):
    """Look at the world point that is now at a position in the head's frame.

    Attributes:
        p_head_m: Position in m, x ahead, y left, z up of the point midway between the eyes, along
            the head's axes at the time of the command.
        who, stay, for_s: As in LookAt.
    """

    p_head_m: Vec3
    who: str = ""
    stay: bool = False
    for_s: float | None = None


class LookAtDirection(NamedTuple):
    """Look in a direction from the head's present position.

    Attributes:
        direction_rad: (yaw, pitch), yaw + left, pitch + up.
        frame: Axes of the neck base, or of the head at the time of the command.
        distance_m: Distance at which the eyes converge.
        who, stay, for_s: As in LookAt.
    """

    direction_rad: Angles2
    frame: Frame = "world"
    distance_m: float = FAR_M
    who: str = ""
    stay: bool = False
    for_s: float | None = None


class LookAtPerson(NamedTuple):
    """Look at a person and follow until the person has not been visible for some time.

    Attributes:
        id: Perception's number of the person.
        who, stay, for_s: As in LookAt.
    """

    id: int
    who: str = ""
    stay: bool = False
    for_s: float | None = None


class LookAtPixel(NamedTuple):
    """Look at the object at a pixel of a camera frame.

    Attributes:
        pixel_px: (x, y) from the centre of the upper left pixel, x right, y down.
        distance_m: Distance from the camera; None for the measured depth, or without depth for
            the distance of the object detected there.
        captured_s: The frame's time of exposure, None for the newest frame.
        p_world_m: World point of the pixel, set on execution for the recording.
        who, stay, for_s: As in LookAt.
    """

    pixel_px: tuple[float, float]
    distance_m: float | None = None
    captured_s: float | None = None
    p_world_m: Vec3 | None = None
    who: str = ""
    stay: bool = False
    for_s: float | None = None


class Jog(NamedTuple):
    """Hold all joints, these at the given angles; without any, free the gaze again.

    Attributes:
        angles_rad: (joint, angle) pairs.
        who, stay, for_s: As in LookAt.
    """

    angles_rad: tuple[tuple[str, float], ...]
    who: str = ""
    stay: bool = False
    for_s: float | None = None


class Express(NamedTuple):
    """Move to a facial expression of the rig's table.

    Attributes:
        expression: Name of the expression.
        strength: 1 as defined .. 0 none.
    """

    expression: str
    strength: float = 1.0


class SetLevel(NamedTuple):
    """Set a level of the rig's table, 0..1; if it is not set again within 0.5 s it falls to 0."""

    level: str
    value: float


NO_TRACK = "none"
"""Choice in the menu of tracks that ends the present one."""


class Play(NamedTuple):
    """Play a track; "" ends all tracks.

    Attributes:
        track: Name of the track.
        speed: Factor on its defined speed.
        times: Number of repetitions, 0 for the track's own.
        who: Name of the client.
        from_s: Position in the track, in s or as the name of a cue, at which it begins.
        loop: Repeat it until it is ended, as a track with ``loop: true`` does.
        lead_s: Latencies of all joints, by which the motion of a track with sound is early; set on
            execution for the recording.
        sound_s: Duration of its sound, set on execution.
    """

    track: str
    speed: float = 1.0
    times: int = 0
    who: str = ""
    from_s: float | str = 0.0
    loop: bool = False
    lead_s: tuple[float, ...] | None = None
    sound_s: float = 0.0


class EndTrack(NamedTuple):
    """End tracks that are playing.

    Attributes:
        track: Name of the track, "" for all.
        who: Name of the client.
    """

    track: str = ""
    who: str = ""


class SyncTrack(NamedTuple):
    """Position of a track by another clock, at most some ten times per second.

    Attributes:
        number: ``TrackState.number``.
        position_s: Position at which the track should be now.
        clock: Source of the position.
    """

    number: int
    position_s: float
    clock: Literal["sound", "external"] = "external"


TalkOrder = Literal["listening", "thinking", "speaking", "idle", "interrupt"]
"""What a voice agent does now; interrupt: the other person has interrupted it."""


class Talk(NamedTuple):
    """Report what a voice agent does, so that the gaze is that of a partner in conversation.

    Attributes:
        state: Present activity; "idle" ends the conversation.
        person: Perception's number of the partner, None if unknown.
        seconds: Time until the planned end of speaking, s; None: estimated from words or text.
        text: What is spoken.
        words: (word, start in s after this command) pairs of the speech.
        sound: Path of the sound file that is spoken.
        who: Name of the client.
        stay: As in LookAt.
    """

    state: TalkOrder
    person: int | None = None
    seconds: float | None = None
    text: str = ""
    words: tuple[tuple[str, float], ...] = ()
    sound: str = ""
    who: str = ""
    stay: bool = False


class Say(NamedTuple):
    """Say a sound file or a text; a run's voice makes a ``Speak`` of it.

    Attributes:
        what: A file, by its ending (.wav, .flac, .mp3, .ogg), or a text.
        volume: Factor 0..1.
        sway: Whether the head sways.
        spoken: (phoneme or word, begin in s) of the file, if known.
        who: Name of the client.
    """

    what: str
    volume: float = 1.0
    sway: bool = True
    spoken: tuple[tuple[str, float], ...] = ()
    who: str = ""


class Speak(NamedTuple):
    """Speak: a track with a sound, its mouth and a sway.

    Attributes:
        sound: Path of the sound, "" without one.
        duration_s: Duration in s.
        level: Level of the rig's table that opens the mouth, "" without one.
        mouth: (time in s, opening 0..1) pairs; the mouth shuts at the end.
        sway_deg: Largest yaw of the sway.
        volume: Factor 0..1.
        who: Name of the client.
        lead_s: As in Play.
    """

    sound: str
    duration_s: float
    level: str = ""
    mouth: tuple[tuple[float, float], ...] = ()
    sway_deg: float = 0.0
    volume: float = 1.0
    who: str = ""
    lead_s: tuple[float, ...] | None = None


OPPONENT_BOX_M = ((0.36, 1.2), (-0.6, 0.6), (-0.4, 0.45))
"""Least and greatest x, y and z to which the opponent's fist can be moved."""


class MoveOpponent(NamedTuple):
    """Move the leading fist of a boxing world's opponent; after 1 s its script continues.

    Attributes:
        p_world_m: Point in m within ``OPPONENT_BOX_M``; the fist follows within its limits.
    """

    p_world_m: Vec3


class Renew(NamedTuple):
    """Heartbeat of the client in control of gaze, joints or talk; others' have no effect."""

    who: str = ""


class Stop(NamedTuple):
    """Switch the torque off immediately, without parking; the program continues reading."""

    why: str
    who: str = ""


class Resume(NamedTuple):
    """Switch the torque on again after a stop, at the present angles, and continue slowly.

    Only the client that stopped may resume, or one with ``confirmed``; the rules are in
    ``gazerig.robot.model.commands``.

    Attributes:
        who: Name of the client.
        confirmed: A person has confirmed that no hand is in the mechanism.
    """

    who: str = ""
    confirmed: bool = False


class Tune(NamedTuple):
    """Apply parameters.

    Attributes:
        changes: (dotted key of the rig's YAML, value) pairs that have been checked.
    """

    changes: tuple[tuple[str, Value], ...]


Look = LookAt | LookAtInHead | LookAtDirection | LookAtPerson | LookAtPixel
ControlCommand = Look | Jog
"""Commands that take control of gaze or joints."""
Command = (
    Ask
    | ControlCommand
    | Express
    | SetLevel
    | Play
    | EndTrack
    | SyncTrack
    | Talk
    | Say
    | Speak
    | MoveOpponent
    | Renew
    | Stop
    | Resume
    | Tune
)

REPEATED = (Renew, SetLevel, SyncTrack, MoveOpponent)
"""Commands that programs send many times per second; they create no message and no mark."""

COMMANDS: dict[str, type[Command]] = {
    "ask": Ask, "look_at": LookAt, "look_at_in_head": LookAtInHead,
    "look_at_direction": LookAtDirection, "look_at_person": LookAtPerson,
    "look_at_pixel": LookAtPixel, "jog": Jog, "express": Express, "set_level": SetLevel,
    "play": Play, "end_track": EndTrack, "sync_track": SyncTrack,
    "talk": Talk, "say": Say, "speak": Speak, "opponent": MoveOpponent,
    "renew": Renew, "stop": Stop, "resume": Resume, "tune": Tune,
}  # fmt: skip


MIN_HOLD_S = 2.0
"""Shortest duration of a stop, also for the client that stopped."""
MIN_RESUME_GAP_S = 1.0
"""A resume within this time of the same client's last one is refused, and counts as the last."""
_MAX_ASKERS = 32


class StopLatch:
    """The latch of a stop, with the rules for a resume.

    Attributes:
        why: Reason for the newest stop, "" while the robot is not stopped.
    """

    def __init__(self) -> None:
        self.why = ""
        self._stoppers: set[str] = set()
        self._stopped_s = 0.0
        self._asked_s: dict[tuple[str, bool], float] = {}

    def stop(self, command: Stop, t_s: float) -> bool:
        """Stop, or renew a stop; return whether it is a new one."""
        new = not self.why
        if new:
            self._stoppers.clear()
        if len(self._stoppers) < _MAX_ASKERS:
            self._stoppers.add(command.who)
        self._stopped_s = t_s
        self.why = command.why or "stopped"
        return new

    @property
    def stopped_by(self) -> str:
        """Return the clients that stopped, "" if unknown."""
        return " and ".join(sorted(filter(None, self._stoppers)))

    def refusal(self, command: Resume, t_s: float) -> str:
        """Return the reason for a refusal of a resume, "" to accept; each call is an attempt."""
        asker = (command.who, command.confirmed)
        last_s = self._asked_s.pop(asker, None)
        self._asked_s[asker] = t_s
        while len(self._asked_s) > _MAX_ASKERS:
            del self._asked_s[next(iter(self._asked_s))]
        if last_s is not None and t_s - last_s < MIN_RESUME_GAP_S:
            return f"too many requests to resume: wait {MIN_RESUME_GAP_S:g} s between two"
        left_s = self._stopped_s + MIN_HOLD_S - t_s
        if left_s > 0.0:
            return f"a stop lasts at least {MIN_HOLD_S:g} s: try again in {left_s:.1f} s"
        if not command.confirmed and self._stoppers != {command.who}:
            by = f"stopped by {self.stopped_by}" if self.stopped_by else "another client stopped it"
            return f"{by}: another client must confirm that no hand is in the mechanism"
        return ""

    def lift(self) -> None:
        """Lift the stop."""
        self.why = ""
