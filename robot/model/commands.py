"""What people ask of a running robot, from the page, another program or the command line.

A command is plain data: it crosses processes as JSON, is obeyed at the next tick, and a
recording of a run holds it, so that the run can be done again.
"""

from collections.abc import Mapping
from math import pi
from typing import Literal, NamedTuple

from gazerig.gaze.gesture import MAX_COUNT, MAX_SPEED, MIN_SPEED
from gazerig.gaze.types import Angles2, Vec3
from gazerig.robot.model.types import JOINT_NAME

Value = float | int | bool | str | None | tuple["Value", ...] | Mapping[str, "Value"]
"""What a key of a rig's YAML can hold."""

Frame = Literal["world", "head"]
FAR_M = 100.0
"""From here on the eyes look straight ahead, to what can be told."""


class Ask(NamedTuple):
    """Choose from a menu: a behaviour, a mode of conversation, what the lids do."""

    menu: str
    choice: str


class LookAt(NamedTuple):
    """Look at a point of the world instead of the models' target; None: choose freely again.

    p_world_m: metres, x ahead, y left, z up of the neck base
    who: who asks, in words; stay: until another command; else for as long as ``Renew`` comes
        at least every ``gazerig.robot.model.lead.HEARTBEAT_S``
    for_s: ends after so many seconds; None: without such an end
    """

    p_world_m: Vec3 | None
    who: str = ""
    stay: bool = False
    for_s: float | None = None


class LookAtInHead(NamedTuple):
    """Look at the point of the world that is now at a place in the head's frame.

    p_head_m: metres, x ahead, y left, z up of the point midway between the eyes, along the head's
        axes at the time of the command
    who, stay, for_s: as in LookAt
    """

    p_head_m: Vec3
    who: str = ""
    stay: bool = False
    for_s: float | None = None


class LookAtDirection(NamedTuple):
    """Look in a direction from where the head is now.

    direction_rad: (yaw, pitch), yaw + left, pitch + up
    frame: whose axes: the neck base's, or the head's at the time of the command
    distance_m: on what the eyes converge
    who, stay, for_s: as in LookAt
    """

    direction_rad: Angles2
    frame: Frame = "world"
    distance_m: float = FAR_M
    who: str = ""
    stay: bool = False
    for_s: float | None = None


class LookAtPerson(NamedTuple):
    """Look at a person and follow, until the person was out of sight for some time.

    id: of the person, as perception counts them
    who, stay, for_s: as in LookAt
    """

    id: int
    who: str = ""
    stay: bool = False
    for_s: float | None = None


class LookAtPixel(NamedTuple):
    """Look at what is at a pixel of a camera frame.

    pixel_px: (x, y), from the centre of the upper left pixel, x right, y down
    distance_m: of it from the camera; None: its depth where the camera measures it, else as far
        as what is seen there
    captured_s: the frame's time of exposure; None: the newest frame
    p_world_m: where it lay; entered when the command is carried out, for the recording
    who, stay, for_s: as in LookAt
    """

    pixel_px: tuple[float, float]
    distance_m: float | None = None
    captured_s: float | None = None
    p_world_m: Vec3 | None = None
    who: str = ""
    stay: bool = False
    for_s: float | None = None


class Jog(NamedTuple):
    """Hold all joints, with these at the given angles; without any, the gaze is free again.

    angles_rad: (joint, angle) pairs
    who, stay, for_s: as in LookAt
    """

    angles_rad: tuple[tuple[str, float], ...]
    who: str = ""
    stay: bool = False
    for_s: float | None = None


class Express(NamedTuple):
    """Move to a facial expression of the rig's table.

    strength: 1 as written, 0 none of it
    """

    expression: str
    strength: float = 1.0


class SetLevel(NamedTuple):
    """Set a level of the rig's table, 0..1; without another within half a second it falls to 0."""

    level: str
    value: float


NO_GESTURE = "none"
"""Chosen from the menu of gestures, it ends the one under way."""


class Play(NamedTuple):
    """Play a gesture once; "" ends the one under way.

    speed: factor on the speed at which it was written
    times: how often it is repeated; 0: as the gesture says
    who: who asks, in words
    """

    gesture: str
    speed: float = 1.0
    times: int = 0
    who: str = ""


class Renew(NamedTuple):
    """The heartbeat of one who leads the gaze or the joints; from others it does nothing."""

    who: str = ""


class Stop(NamedTuple):
    """Switch the torque off at once, without parking; the program goes on reading."""

    why: str
    who: str = ""


class Resume(NamedTuple):
    """Switch the torque on again after a stop, where the joints are, and go on slowly.

    Obeyed by the rules of ``gazerig.robot.model.stop_latch``: of the one who stopped, or confirmed.

    who: who asks, in words
    confirmed: a person has said that no hand is in the mechanism
    """

    who: str = ""
    confirmed: bool = False


class Tune(NamedTuple):
    """Apply parameters.

    changes: (dotted key of the rig's YAML, value) pairs, checked beforehand
    """

    changes: tuple[tuple[str, Value], ...]


Look = LookAt | LookAtInHead | LookAtDirection | LookAtPerson | LookAtPixel
Leading = Look | Jog
"""Commands that take the lead of gaze or joints."""
Command = Ask | Leading | Express | SetLevel | Play | Renew | Stop | Resume | Tune

REPEATED = (Renew, SetLevel)
"""Commands that programs send many times a second: no message or mark tells of each."""

MAX_COORDINATE_M = 1000.0
"""No point to look at lies farther away along any axis."""
MAX_ANGLE_RAD = 2.0 * pi
"""No joint is sent farther than a turn to either side."""
MAX_JOINTS = 64
"""A command moves no more joints than this."""
MAX_WORDS = 200
"""Longest name or reason that a command may carry, in characters."""
MAX_LEAD_S = 86400.0
"""Longest time that a lead may be given."""
MAX_PIXEL = 20000.0
"""No pixel lies farther from the corner of its frame."""
_MAX_TIME_S = 1e12

COMMANDS: dict[str, type[Command]] = {
    "ask": Ask, "look_at": LookAt, "look_at_in_head": LookAtInHead,
    "look_at_direction": LookAtDirection, "look_at_person": LookAtPerson,
    "look_at_pixel": LookAtPixel, "jog": Jog, "express": Express, "set_level": SetLevel,
    "play": Play,
    "renew": Renew, "stop": Stop, "resume": Resume, "tune": Tune,
}  # fmt: skip
_NAMES = {kind: name for name, kind in COMMANDS.items()}


def as_json(command: Command) -> dict[str, object]:
    """Return a command as plain JSON: its name under "do", and its fields."""
    return {"do": _NAMES[type(command)], **command._asdict()}


def as_recorded(command: Command) -> dict[str, object]:
    """Return a command as recordings hold it: its name under "order", and its fields."""
    return {"order": _NAMES[type(command)], **command._asdict()}


def from_json(data: object) -> Command:
    """Read what ``as_json`` or ``as_recorded`` gave; fields with defaults may be left out.

    Raises:
        ValueError: it is no command; the message says what is wrong and what there is.
    """
    key = "order" if isinstance(data, dict) and "order" in data else "do"
    name = data.get(key) if isinstance(data, dict) else None
    kind = COMMANDS.get(name) if isinstance(name, str) else None
    if kind is None or not isinstance(data, dict):
        raise ValueError(f"no command; there is {', '.join(COMMANDS)}")
    fields = {field: _frozen(value) for field, value in data.items() if field != key}
    needed = set(kind._fields).difference(kind._field_defaults)
    if not needed <= set(fields) <= set(kind._fields):
        raise ValueError(f"{name} takes {', '.join(kind._fields)}; given {', '.join(fields)}")
    command = kind(**fields)  # type: ignore[arg-type]
    check(command)
    return command


def from_recording(data: dict[str, object]) -> Command:
    """Read a command of a recorded run.

    Those of runs made before leads could lapse and stops be guarded say nothing of it: they
    stayed, and any client could resume.

    Raises:
        ValueError: as ``from_json``.
    """
    old = {"look_at": {"stay": True}, "jog": {"stay": True}, "resume": {"confirmed": True}}
    name = data.get("order")
    return from_json({**old.get(name if isinstance(name, str) else "", {}), **data})


def signed(command: Command, who: str) -> Command:
    """Return a command with who asks for it; commands that do not tell stay as they are."""
    if isinstance(command, Leading | Play | Renew | Stop | Resume):
        return command._replace(who=who[:MAX_WORDS])
    return command


def check(command: Command) -> None:
    """See that a command's values can be meant.

    Raises:
        ValueError: with the rule.
    """
    match command:
        case Ask(menu, choice):
            if not isinstance(menu, str) or not isinstance(choice, str):
                raise ValueError("menu and choice are names")
        case LookAt() | LookAtInHead() | LookAtDirection() | LookAtPerson() | LookAtPixel():
            _check_look(command)
            _check_lead(command)
        case Jog(angles):
            _check_angles(angles)
            _check_lead(command)
        case Express(expression, strength):
            _check_share("an expression", "strength", expression, strength)
        case SetLevel(level, value):
            _check_share("a level", "value", level, value)
        case Play(gesture, speed, times, who):
            _check_play(gesture, speed, times)
            _check_who(who)
        case Renew(who):
            _check_who(who)
        case Stop(why, who):
            if not isinstance(why, str) or len(why) > MAX_WORDS:
                raise ValueError(f"the reason of a stop is text of at most {MAX_WORDS} characters")
            _check_who(who)
        case Resume(who, confirmed):
            _check_who(who, confirmed)
        case Tune(changes):
            pairs = isinstance(changes, tuple) and all(
                isinstance(c, tuple) and len(c) == 2 and isinstance(c[0], str) for c in changes
            )
            if not pairs:
                raise ValueError("changes are pairs of a dotted key and a value")


def _check_look(command: Look) -> None:
    """See that what is to be looked at can be."""
    match command:
        case LookAt(None):
            pass
        case LookAt(p) | LookAtInHead(p):
            _check_point(p)
        case LookAtDirection(direction, frame, distance):
            if not (_numbers(direction, 2, pi) and -pi / 2 <= direction[1] <= pi / 2):
                raise ValueError(
                    "a direction is a finite yaw within +-180 deg (left above 0) and a pitch "
                    "within +-90 deg (up above 0)"
                )
            if frame not in ("world", "head"):
                raise ValueError(f"frame {frame!r:.40}: there is world, head")
            _check_distance(distance)
        case LookAtPerson(person):
            if isinstance(person, bool) or not isinstance(person, int) or person < 0:
                raise ValueError(
                    f"a person is named by a whole number from 0 on, not {person!r:.40}"
                )
        case LookAtPixel(pixel, distance, captured_s, p):
            if not _numbers(pixel, 2, MAX_PIXEL):
                raise ValueError("a pixel is two finite numbers, x right and y down")
            if distance is not None:
                _check_distance(distance)
            if captured_s is not None and not _within(captured_s, _MAX_TIME_S):
                raise ValueError("captured_s is the time of a frame in seconds")
            if p is not None:
                _check_point(p)


def _check_point(p: object) -> None:
    if not _numbers(p, 3, MAX_COORDINATE_M):
        raise ValueError(
            "a point is three finite numbers in metres, x ahead, y left, z up, none "
            f"beyond +-{MAX_COORDINATE_M:g} m"
        )


def _check_distance(distance: object) -> None:
    if not (_within(distance, MAX_COORDINATE_M) and distance > 0.0):  # type: ignore[operator]
        raise ValueError(f"a distance is above 0 and at most {MAX_COORDINATE_M:g} m")


def _check_lead(command: Leading) -> None:
    _check_who(command.who, command.stay)
    for_s = command.for_s
    if for_s is not None and not (_within(for_s, MAX_LEAD_S) and for_s > 0.0):
        raise ValueError(f"for_s is above 0 and at most {MAX_LEAD_S:g} s")


def _check_who(who: object, flag: object = False) -> None:
    if not isinstance(who, str) or len(who) > MAX_WORDS:
        raise ValueError(f"who asks is text of at most {MAX_WORDS} characters")
    if not isinstance(flag, bool):
        raise ValueError("stay and confirmed are true or false")


def _check_angles(angles: object) -> None:
    if not isinstance(angles, tuple) or len(angles) > MAX_JOINTS:
        raise ValueError("angles are pairs of a joint and an angle in radians, one a joint")
    for pair in angles:
        if not (isinstance(pair, tuple) and len(pair) == 2 and _within(pair[1], MAX_ANGLE_RAD)):
            raise ValueError(
                "angles are pairs of a joint and a finite angle in radians within +-360 deg"
            )
        if not (isinstance(pair[0], str) and JOINT_NAME.fullmatch(pair[0])):
            raise ValueError(f"{pair[0]!r:.40} is no name of a joint: such as neck_yaw or jaw")


def _check_play(gesture: object, speed: object, times: object) -> None:
    if not isinstance(gesture, str) or len(gesture) > MAX_WORDS:
        raise ValueError("a gesture is given by its name")
    if not _within(speed, MAX_SPEED) or speed < MIN_SPEED:  # type: ignore[operator]
        raise ValueError(f"the speed of a gesture is a number {MIN_SPEED:g}..{MAX_SPEED:g}")
    if type(times) is not int or not 0 <= times <= MAX_COUNT:
        raise ValueError(f"the times of a gesture are a whole number 0..{MAX_COUNT}")


def _check_share(what: str, key: str, name: object, value: object) -> None:
    if not isinstance(name, str) or len(name) > MAX_WORDS:
        raise ValueError(f"{what} is given by its name")
    if not _within(value, 1.0) or value < 0.0:  # type: ignore[operator]
        raise ValueError(f"the {key} of {what} is a number 0..1")


def _numbers(values: object, count: int, most: float) -> bool:
    """Return whether it is a tuple of so many finite numbers within +-most."""
    of_them = isinstance(values, tuple) and len(values) == count
    return of_them and all(_within(value, most) for value in values)  # type: ignore[attr-defined]


def _within(value: object, most: float) -> bool:
    # A comparison is false of NaN, and takes whole numbers that no float can hold.
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and -most <= value <= most  # type: ignore[operator]


def _frozen(value: object) -> object:
    """Return JSON's lists as tuples."""
    if isinstance(value, list | tuple):
        return tuple(_frozen(item) for item in value)
    if isinstance(value, dict):
        return {key: _frozen(item) for key, item in value.items()}
    return value
