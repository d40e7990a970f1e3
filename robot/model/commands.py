"""Commands to a running robot from the page, another program or the command line.

A command is plain data: Python, the sockets, HTTP and recordings use these classes as they are. It
is executed at the next tick. A recording of a run contains it, so that the run can be repeated.
"""

import re
from collections.abc import Iterator, Mapping
from math import pi
from typing import Annotated, Any, Literal, TypeVar, get_args

import msgspec
from msgspec import Meta, Struct, structs

from gazerig.gaze.track.track import MAX_DURATION_S, Track
from gazerig.params import suggestion_text, unknown_text

Value = float | int | bool | str | None | tuple["Value", ...] | Mapping[str, "Value"]
"""Value of a key in a rig's YAML."""

HEARTBEAT_S = 1.0
"""A control or conversation without ``stay`` ends if it is not renewed for this time."""
FAR_M = 100.0
"""Distance beyond which the eyes are practically parallel."""
MAX_WORDS = 200
"""Longest name or reason in a command, in characters."""
MAX_SPEECH_S = 1200.0
"""Longest speech; longer ones belong into a track's file."""
OPPONENT_BOX_M = ((0.36, 1.2), (-0.6, 0.6), (-0.4, 0.45))
"""Least and greatest x, y and z to which the opponent's fist can be moved."""
NO_TRACK = "none"
"""Choice in the menu of tracks that ends the present one."""

Frame = Literal["world", "head"]
TalkOrder = Literal["listening", "thinking", "speaking", "idle", "interrupt"]
"""What a voice agent does now; interrupt: the other person has interrupted it."""

_Name = Annotated[str, Meta(max_length=MAX_WORDS)]
_Text = Annotated[str, Meta(max_length=10_000)]
_Share = Annotated[float, Meta(ge=0.0, le=1.0)]
_Coordinate = Annotated[float, Meta(ge=-1000.0, le=1000.0)]
_Point = tuple[_Coordinate, _Coordinate, _Coordinate]
_Distance = Annotated[float, Meta(gt=0.0, le=1000.0)]
_Pixel = Annotated[float, Meta(ge=-20_000.0, le=20_000.0)]
_Angle = Annotated[float, Meta(ge=-2.0 * pi, le=2.0 * pi)]
_Yaw = Annotated[float, Meta(ge=-pi, le=pi)]
_Pitch = Annotated[float, Meta(ge=-0.5 * pi, le=0.5 * pi)]
_Position = Annotated[float, Meta(ge=0.0, le=MAX_DURATION_S)]
_Number = Annotated[int, Meta(ge=0, le=2**53)]
"""Number of a person or a track: every client and recording can hold it."""
_SpeechTime = Annotated[float, Meta(ge=0.0, le=MAX_SPEECH_S)]
_ControlTime = Annotated[float, Meta(gt=0.0, le=86_400.0)]


def _verb(class_name: str) -> str:
    return re.sub(r"(?<!^)(?=[A-Z])", "_", class_name).lower()


class Request(Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag=_verb):
    """A message to a running rig; its verb is the class's name: SetLevel is set_level."""


class Command(Request, frozen=True):
    """A request that a tick executes."""


class ClientCommand(Command, frozen=True, kw_only=True):
    """A command with its client.

    Attributes:
        who: Name of the client.
    """

    who: _Name = ""


class ControlCommand(ClientCommand, frozen=True, kw_only=True):
    """A command that takes control of gaze or joints.

    Attributes:
        stay: Keep it until another command; if False, it needs a ``Renew`` at least every
            ``HEARTBEAT_S``.
        for_s: Duration in s, None if unlimited.
    """

    stay: bool = False
    for_s: _ControlTime | None = None


class Look(ControlCommand, frozen=True):
    """A command that chooses the gaze's target instead of the models."""


class Ask(Command, frozen=True):
    """A choice from a menu: a behaviour, a mode of conversation, a motion of the lids."""

    menu: _Name
    choice: _Name


class LookAt(Look, frozen=True):
    """Look at a point in the world instead of the models' target; None frees the gaze.

    Attributes:
        p_world_m: Point in m, x ahead, y left, z up of the neck base.
        pointer: Whether the point is a person's mouse pointer, for texts.
    """

    p_world_m: _Point | None
    pointer: bool = False


class LookAtDirection(Look, frozen=True):
    """Look in a direction from the head's present position.

    Attributes:
        direction_rad: (yaw, pitch), yaw + left, pitch + up.
        frame: Axes of the neck base, or of the head at the time of the command.
        distance_m: Distance at which the eyes converge.
    """

    direction_rad: tuple[_Yaw, _Pitch]
    frame: Frame = "world"
    distance_m: _Distance = FAR_M


class LookAtPerson(Look, frozen=True):
    """Look at a person and follow until the person has not been visible for some time.

    Attributes:
        id: Perception's number of the person.
    """

    id: _Number


class Find(Look, frozen=True):
    """Search for a person, look at the one who is found and follow.

    Attributes:
        sought: Perception's number, or a side of the head on which anybody is wanted.
    """

    sought: _Number | Literal["left", "right", "anybody"] = "anybody"


class LookAtPixel(Look, frozen=True):
    """Look at the object at a pixel of a camera frame.

    Attributes:
        pixel_px: (x, y) from the centre of the upper left pixel, x right, y down.
        distance_m: Distance from the camera; None for the measured depth, or without depth for
            the distance of the object detected there.
        captured_s: The frame's time of exposure, None for the newest frame.
        p_world_m: World point of the pixel, set on execution for the recording.
    """

    pixel_px: tuple[_Pixel, _Pixel]
    distance_m: _Distance | None = None
    captured_s: Annotated[float, Meta(ge=-1e12, le=1e12)] | None = None
    p_world_m: _Point | None = None


class Jog(ControlCommand, frozen=True):
    """Hold all joints, these at the given angles; without any, free the gaze again.

    Attributes:
        angles_rad: (joint, angle) pairs.
    """

    angles_rad: Annotated[tuple[tuple[_Name, _Angle], ...], Meta(max_length=64)]


class Express(Command, frozen=True):
    """Move to a facial expression of the rig's table.

    Attributes:
        expression: Name of the expression.
        strength: 1 as defined .. 0 none.
    """

    expression: _Name
    strength: _Share = 1.0


class SetLevel(Command, frozen=True):
    """Set a level of the rig's table, 0..1; if it is not set again within 0.5 s it falls to 0."""

    level: _Name
    value: _Share


class Play(ClientCommand, frozen=True):
    """Play a track; "" ends all tracks.

    The last three are for recordings: clients cannot set them.

    Attributes:
        track: Name of the track.
        speed: Factor on its defined speed.
        times: Number of repetitions, 0 for the track's own.
        from_s: Position in the track, in s or as the name of a cue, at which it begins.
        loop: Repeat it until it is ended, as a track with ``loop: true`` does.
        sound_s: Duration of its sound.
        definition: The track, if it is a speech, or if its file is newer than the run.
        mouth: (time in s, opening 0..1) pairs of a speech; the mouth shuts at the end.
    """

    track: _Name
    speed: Annotated[float, Meta(ge=0.1, le=4.0)] = 1.0
    times: Annotated[int, Meta(ge=0, le=20)] = 0
    from_s: _Position | _Name = 0.0
    loop: bool = False
    sound_s: _Position = 0.0
    definition: Track | None = None
    mouth: Annotated[tuple[tuple[_SpeechTime, _Share], ...], Meta(max_length=61_000)] = ()


class EndTrack(ClientCommand, frozen=True):
    """End tracks that are playing.

    Attributes:
        track: Name of the track, "" for all.
    """

    track: _Name = ""


class SyncTrack(Command, frozen=True):
    """Position of a track by another clock, at most some ten times per second.

    Attributes:
        number: ``TrackState.number``.
        position_s: Position at which the track should be now.
    """

    number: _Number
    position_s: _Position


class Talk(ClientCommand, frozen=True):
    """Report what a voice agent does, so that the gaze is that of a partner in conversation.

    Attributes:
        state: Present activity; "idle" ends the conversation.
        person: Perception's number of the partner, None if unknown.
        seconds: Time until the planned end of speaking, s; None: estimated from the text.
        text: What is spoken.
        stay: As in ControlCommand.
    """

    state: TalkOrder
    person: _Number | None = None
    seconds: Annotated[float, Meta(gt=0.0, le=600.0)] | None = None
    text: _Text = ""
    stay: bool = False

    @property
    def has_plan(self) -> bool:
        """Return whether it plans a speech, which only belongs to speaking."""
        return self.seconds is not None or bool(self.text)


class Say(ClientCommand, frozen=True):
    """Say a sound file or a text; a run's voice makes a track of it.

    Attributes:
        what: A file, by its ending (.wav, .flac, .mp3, .ogg), or a text.
        volume: Factor 0..1.
    """

    what: str
    volume: _Share = 1.0


class MoveOpponent(Command, frozen=True, tag="opponent"):
    """Move the leading fist of a boxing world's opponent; after 1 s its script continues.

    Attributes:
        p_world_m: Point in m within ``OPPONENT_BOX_M``; the fist follows within its limits.
    """

    p_world_m: tuple[
        Annotated[float, Meta(ge=OPPONENT_BOX_M[0][0], le=OPPONENT_BOX_M[0][1])],
        Annotated[float, Meta(ge=OPPONENT_BOX_M[1][0], le=OPPONENT_BOX_M[1][1])],
        Annotated[float, Meta(ge=OPPONENT_BOX_M[2][0], le=OPPONENT_BOX_M[2][1])],
    ]


class Renew(ClientCommand, frozen=True):
    """Heartbeat of the client in control of gaze, joints or talk; others' have no effect."""


class Stop(ClientCommand, frozen=True):
    """Switch the torque off immediately, without parking; the program continues reading."""

    why: _Name


class Resume(ClientCommand, frozen=True):
    """Switch the torque on again after a stop, at the present angles, and continue slowly.

    Only the client that stopped may resume, or one with ``confirmed``; the rules are in
    ``gazerig.robot.loop.body``.

    Attributes:
        confirmed: A person has confirmed that no hand is in the mechanism.
    """

    confirmed: bool = False


class Tune(Command, frozen=True):
    """Apply parameters.

    Attributes:
        changes: (dotted key of the rig's YAML, value) pairs that have been checked.
    """

    changes: tuple[tuple[str, Any], ...]


AnyCommand = (
    Ask | LookAt | LookAtDirection | LookAtPerson | LookAtPixel | Find | Jog | Express
    | SetLevel | Play | EndTrack | SyncTrack | Talk | Say | MoveOpponent | Renew | Stop | Resume
    | Tune
)  # fmt: skip
REPEATED = (Renew, SetLevel, SyncTrack, MoveOpponent)
"""Commands that programs send many times per second; they create no message and no mark."""


def verb(kind: type[Request]) -> str:
    """Return the verb of a class of requests."""
    return str(kind.__struct_config__.tag)


COMMANDS: dict[str, type[Command]] = {verb(kind): kind for kind in get_args(AnyCommand)}

_C = TypeVar("_C", bound=Command)
_checker: Any = msgspec.msgpack.Decoder(AnyCommand)  # it returns the type it was given


def _plain(value: Any) -> Any:
    """Return a number or an array of NumPy as Python's."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise ValueError(f"{type(value).__name__} is no value of a command")


def check_command(command: _C) -> _C:
    """Return a command whose values are checked, with whole numbers as floats where they belong.

    Raises:
        ValueError: A value is invalid; the message states the rule and the place.
    """
    if isinstance(command, Tune):
        return structs.replace(command, changes=as_value(command.changes))
    try:  # not JSON, in which NaN would become null
        checked: _C = _checker.decode(msgspec.msgpack.encode(command, enc_hook=_plain))
    except ValueError as error:
        kind = type(command)
        raise ValueError(f"{verb(kind)}: {_explain(error, kind)}") from None
    if isinstance(checked, Say) and not checked.what.strip():
        raise ValueError(
            "a text without a word is no speech: give the words, or the name of a sound file"
        )
    if isinstance(checked, Talk) and checked.has_plan and checked.state != "speaking":
        raise ValueError(f"seconds and text belong to speaking: omit them for {checked.state}")
    return checked


def set_client(command: _C, who: str) -> _C:
    """Return a command with its client's name; commands without that field stay unchanged."""
    if isinstance(command, ClientCommand):
        return structs.replace(command, who=who[:MAX_WORDS])
    return command


def as_value(value: Any) -> Value:
    """Convert JSON's lists to tuples, as the reader of files does."""
    if isinstance(value, list | tuple):
        return tuple(as_value(item) for item in value)
    if isinstance(value, dict):
        return {key: as_value(item) for key, item in value.items()}
    assert value is None or isinstance(value, bool | int | float | str)
    return value


# --- requests besides commands: questions, and changes of parameters


class Hello(Request, frozen=True):
    """Check the version of the messages; return the rig's identity."""

    version: int


class ReadStatus(Request, frozen=True, tag="status"):
    """Name and state of the rig, and its last messages."""


class State(Request, frozen=True):
    """Newest tick, and the events numbered above after."""

    after: int = 0


class ReadMenus(Request, frozen=True, tag="menus"):
    """Behaviours, modes of conversation, lid movements, characters; the present one first."""


class ReadPicture(Request, frozen=True, tag="picture"):
    """The newest picture of the camera as a JPEG, in JSON base64."""


class Tracks(Request, frozen=True):
    """Tracks, and why the rig refuses them."""


class Parameters(Request, frozen=True):
    """Rules and defaults of keys with a prefix."""

    prefix: str = ""


class Get(Request, frozen=True):
    """Present values of keys with a prefix."""

    prefix: str = ""


class Unsaved(Request, frozen=True):
    """Values that differ from the rig's file."""


class Set(Request, frozen=True):
    """Apply values of keys, all of them or none."""

    changes: dict[str, Any]


class Save(Request, frozen=True):
    """Write the values to the rig's file, or to an absolute path."""

    path: str | None = None


class Revert(Request, frozen=True):
    """Apply the values of the rig's file again."""


class SayPiece(Request, frozen=True):
    """Say a piece of a stream, base64 of signed 16 bits; returns the unheard length in s."""

    pcm: bytes
    rate_hz: int
    channels: int = 1
    last: bool = False
    volume: Annotated[float, Meta(ge=0.0, le=1.0)] = 1.0


class Fault(Request, frozen=True):
    """Execute a fault command of emulated servos (gazerig emulate)."""

    text: str


Question = (
    Hello | ReadStatus | State | ReadMenus | ReadPicture | Tracks | Parameters | Get | Unsaved
)
Change = Set | Save | Revert | SayPiece | Fault
SLOW: frozenset[str] = frozenset((*map(verb, get_args(Change)), "say"))
"""Requests that may read or write files."""
ORDERS: dict[str, type[Command]] = {
    name: kind for name, kind in COMMANDS.items() if kind is not Tune
}
"""Commands that programs may send; the request set checks and prepares the other."""
REQUESTS: dict[str, type[Request]] = {
    verb(kind): kind for kind in (*get_args(Question | Change), *ORDERS.values())
}


def read_request(data: object) -> Request:
    """Return a request from the values of its JSON; fields with defaults may be omitted.

    Raises:
        ValueError: It is not a request; the message names the place, the rule and the fields.
    """
    try:
        request: Request = msgspec.convert(data, Question | Change | AnyCommand)
    except msgspec.ValidationError as error:
        kind = REQUESTS.get(str(data.get("do"))) if isinstance(data, dict) else None
        if kind is None:
            name = str(data.get("do", "")) if isinstance(data, dict) else ""
            raise ValueError(unknown_text("request", name, REQUESTS)) from None
        raise ValueError(_explain(error, kind)) from None
    if isinstance(request, Tune):
        raise ValueError("this is done by the request set, which checks it")
    if isinstance(request, Play):
        return structs.replace(request, sound_s=0.0, definition=None, mouth=())
    return request


def _explain(rule: Exception, kind: type[Request]) -> str:
    """Return a broken rule, a choice like the wrong one, and the request's fields and choices."""
    fields, words = list[str](), list[str]()
    for field in structs.fields(kind):
        choices = list(_choices(field.type))
        words += choices
        fields.append(f"{field.name} ({', '.join(choices)})" if choices else field.name)
    wrong = re.match("Invalid enum value '(.*)'", str(rule))
    near = suggestion_text(wrong[1], words) if wrong else ""
    return f"{rule}{near}; {verb(kind)} has {', '.join(fields) or 'no fields'}"


def _choices(kind: object) -> Iterator[str]:
    for part in get_args(kind):
        if isinstance(part, str):
            yield part
        else:
            yield from _choices(part)
