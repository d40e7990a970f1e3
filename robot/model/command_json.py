"""Commands as plain JSON, between processes and in recordings, and checks of their values.

Every receiver of commands calls these checks first.
"""

from math import pi
from typing import get_args

from gazerig.gaze.track.track import MAX_COUNT, MAX_DURATION_S, MAX_SPEED, MIN_SPEED
from gazerig.robot.model.commands import (
    COMMANDS,
    OPPONENT_BOX_M,
    Ask,
    Command,
    ControlCommand,
    EndTrack,
    Express,
    Jog,
    Look,
    LookAt,
    LookAtDirection,
    LookAtInHead,
    LookAtPerson,
    LookAtPixel,
    MoveOpponent,
    Play,
    Renew,
    Resume,
    Say,
    SetLevel,
    Speak,
    Stop,
    SyncTrack,
    Talk,
    TalkOrder,
    Tune,
)
from gazerig.robot.model.types import JOINT_NAME

MAX_COORDINATE_M = 1000.0
"""Largest coordinate of a point to look at."""
MAX_ANGLE_RAD = 2.0 * pi
"""Largest angle of a joint command to either side."""
MAX_JOINTS = 64
"""Largest number of joints in a command."""
MAX_WORDS = 200
"""Longest name or reason in a command, in characters."""
MAX_CONTROL_S = 86400.0
"""Longest duration of a client's control."""
MAX_TALK_S = 600.0
"""Latest planned end of speaking."""
MAX_TALK_CHARACTERS = 10_000
"""Longest text of speech, and longest path of its sound."""
MAX_TALK_WORDS = 2000
"""Largest number of words with times."""
MAX_SPEECH_S = 1200.0
"""Longest speech; longer ones belong into a track's file."""
MAX_SWAY_DEG = 5.0
"""Largest sway of a speech."""
MAX_MOUTH_KEYS = 40_000
"""Largest number of keys of a speech."""
MAX_PIXEL = 20000.0
"""Largest coordinate of a pixel."""
MAX_NUMBER = 2**53
"""Largest number of a person or a track: every client and recording can hold it."""
NO_SPEECH = "a text without a word is no speech: give the words, or the name of a sound file"
_MAX_TIME_S = 1e12


def check_command(command: Command) -> None:
    """Check that a command's values are valid.

    Raises:
        ValueError: A value is invalid; the message states the rule.
    """
    match command:
        case Ask(menu, choice):
            if not isinstance(menu, str) or not isinstance(choice, str):
                raise ValueError("menu and choice must be names")
        case LookAt() | LookAtInHead() | LookAtDirection() | LookAtPerson() | LookAtPixel():
            _check_look(command)
            _check_control(command)
        case Jog(angles):
            if not isinstance(angles, tuple) or len(angles) > MAX_JOINTS:
                raise ValueError(
                    "angles must be pairs of a joint and an angle in radians, one per joint"
                )
            for pair in angles:
                if not (
                    isinstance(pair, tuple)
                    and len(pair) == 2
                    and _is_within(pair[1], MAX_ANGLE_RAD)
                ):
                    raise ValueError(
                        "angles must be pairs of a joint and a finite angle in radians within +-360 deg"
                    )
                if not (isinstance(pair[0], str) and JOINT_NAME.fullmatch(pair[0])):
                    raise ValueError(f"{pair[0]!r:.40} is not a joint name such as neck_yaw or jaw")
            _check_control(command)
        case Express(expression, strength):
            _check_share("an expression", "strength", expression, strength)
        case SetLevel(level, value):
            _check_share("a level", "value", level, value)
        case Play(track, speed, times, who, from_s, loop, lead_s, sound_s):
            _check_track(track)
            if not _is_within(speed, MAX_SPEED) or speed < MIN_SPEED:
                raise ValueError(
                    f"the speed of a track must be a number {MIN_SPEED:g}..{MAX_SPEED:g}"
                )
            if not (isinstance(from_s, str) and len(from_s) <= MAX_WORDS):
                _check_position(from_s)
            _check_position(sound_s)
            if not isinstance(loop, bool):
                raise ValueError("loop must be true or false")
            _check_lead(lead_s)
            if type(times) is not int or not 0 <= times <= MAX_COUNT:
                raise ValueError(f"the times of a track must be a whole number 0..{MAX_COUNT}")
            _check_who(who)
        case EndTrack(track, who):
            _check_track(track)
            _check_who(who)
        case SyncTrack(number, position_s, clock):
            if type(number) is not int or not 1 <= number <= MAX_NUMBER:
                raise ValueError("number must be that of a track that plays, from 1 on")
            _check_position(position_s)
            if clock not in ("sound", "external"):
                raise ValueError(f"clock {clock!r:.40}: expected sound or external")
        case Talk():
            _check_talk(command)
        case Say() | Speak():
            _check_speech(command)
        case MoveOpponent(p):
            if not _are_numbers(p, 3, MAX_COORDINATE_M) or any(
                not least <= one <= most
                for one, (least, most) in zip(p, OPPONENT_BOX_M, strict=True)
            ):
                box = ", ".join(f"{least:g}..{most:g}" for least, most in OPPONENT_BOX_M)
                raise ValueError(
                    f"the opponent's fist must be moved to three numbers in m within {box}"
                )
        case Renew(who):
            _check_who(who)
        case Stop(why, who):
            if not isinstance(why, str) or len(why) > MAX_WORDS:
                raise ValueError(
                    f"the reason of a stop must be text of at most {MAX_WORDS} characters"
                )
            _check_who(who)
        case Resume(who, confirmed):
            _check_who(who, confirmed)
        case Tune(changes):
            pairs = isinstance(changes, tuple) and all(
                isinstance(c, tuple) and len(c) == 2 and isinstance(c[0], str) for c in changes
            )
            if not pairs:
                raise ValueError("changes must be pairs of a dotted key and a value")


def _check_track(track: object) -> None:
    if not isinstance(track, str) or len(track) > MAX_WORDS:
        raise ValueError("a track must be given by its name")


def _check_position(position_s: object) -> None:
    if not _is_within(position_s, MAX_DURATION_S) or position_s < 0.0:  # type: ignore[operator]
        raise ValueError(f"a position in a track must be a number of seconds 0..{MAX_DURATION_S:g}")


def _check_look(command: Look) -> None:
    """Check the target of a look command."""
    match command:
        case LookAt(pointer=pointer) if not isinstance(pointer, bool):
            raise ValueError("pointer must be true or false")
        case LookAt(None):
            pass
        case LookAt(p) | LookAtInHead(p):
            _check_point(p)
        case LookAtDirection(direction, frame, distance):
            if not (_are_numbers(direction, 2, pi) and -pi / 2 <= direction[1] <= pi / 2):
                raise ValueError(
                    "a direction must be a finite yaw within +-180 deg (left above 0) and a pitch "
                    "within +-90 deg (up above 0)"
                )
            if frame not in ("world", "head"):
                raise ValueError(f"frame {frame!r:.40}: expected world or head")
            _check_distance(distance)
        case LookAtPerson(person):
            _check_person(person)
        case LookAtPixel(pixel, distance, captured_s, p):
            if not _are_numbers(pixel, 2, MAX_PIXEL):
                raise ValueError("a pixel must be two finite numbers, x right and y down")
            if distance is not None:
                _check_distance(distance)
            if captured_s is not None and not _is_within(captured_s, _MAX_TIME_S):
                raise ValueError("captured_s must be the time of a frame in seconds")
            if p is not None:
                _check_point(p)


def _check_talk(command: Talk) -> None:
    """Check the state of a voice agent, and the plan of its speech."""
    orders = get_args(TalkOrder)
    if command.state not in orders:
        raise ValueError(
            f"state {command.state!r:.40}: expected {', '.join(orders[:-1])} or {orders[-1]}"
        )
    if command.person is not None:
        _check_person(command.person)
    seconds, words = command.seconds, command.words
    if seconds is not None and not (_is_within(seconds, MAX_TALK_S) and seconds > 0.0):
        raise ValueError(
            f"seconds {seconds!r:.40}: the planned end of speaking must be above 0 and at most "
            f"{MAX_TALK_S:g} s from now; omit it if the end is unknown"
        )
    for name, text in (("text", command.text), ("sound", command.sound)):
        if not isinstance(text, str) or len(text) > MAX_TALK_CHARACTERS:
            raise ValueError(f"{name} must be text of at most {MAX_TALK_CHARACTERS} characters")
    if command.text and not _has_words(command.text):
        raise ValueError(NO_SPEECH)
    pairs = isinstance(words, tuple) and len(words) <= MAX_TALK_WORDS
    last_s = 0.0
    for pair in words if pairs else ():
        pairs = pairs and isinstance(pair, tuple) and len(pair) == 2
        pairs = pairs and isinstance(pair[0], str) and len(pair[0]) <= MAX_WORDS
        pairs = pairs and _is_within(pair[1], MAX_TALK_S) and pair[1] >= last_s
        if not pairs:
            break
        last_s = pair[1]
    if not pairs:
        raise ValueError(
            f"words must be at most {MAX_TALK_WORDS} pairs of a word and its start in s after the "
            f"command, from 0 to {MAX_TALK_S:g} in the order of time"
        )
    plan = (seconds is not None, command.text, words, command.sound)
    if command.state != "speaking" and any(plan):
        raise ValueError(
            f"seconds, text, words and sound belong to speaking: omit them for {command.state}"
        )
    _check_who(command.who, command.stay)


def _check_person(person: object) -> None:
    if type(person) is not int or not 0 <= person <= MAX_NUMBER:
        raise ValueError(f"a person must be given by a whole number from 0 on, not {person!r:.40}")


def _has_words(text: str) -> bool:
    """Return whether a text has any visible character."""
    return any(letter.isprintable() and letter != " " for letter in text)


def _check_speech(command: Say | Speak) -> None:
    _check_who(command.who, isinstance(command, Say) and command.sway)
    if not _is_within(command.volume, 1.0) or command.volume < 0.0:
        raise ValueError("the volume of a speech must be a number 0..1")
    if isinstance(command, Say):
        pairs = isinstance(command.spoken, tuple) and all(
            isinstance(one, tuple) and len(one) == 2 and isinstance(one[0], str)
            and _is_within(one[1], MAX_SPEECH_S) and one[1] >= 0.0
            for one in command.spoken
        )  # fmt: skip
        if not isinstance(command.what, str) or not pairs:
            raise ValueError(
                "say a file or a text; spoken must be pairs of a word and its begin in s"
            )
        if not _has_words(command.what):
            raise ValueError(NO_SPEECH)
        return
    if not isinstance(command.sound, str) or not isinstance(command.level, str):
        raise ValueError("sound and level of a speech must be names")
    if not _is_within(command.sway_deg, MAX_SWAY_DEG) or command.sway_deg < 0.0:
        raise ValueError(f"the sway of a speech must be a number 0..{MAX_SWAY_DEG:g} deg")
    if not _is_within(command.duration_s, MAX_SPEECH_S) or command.duration_s <= 0.0:
        raise ValueError(f"a speech must last above 0 and at most {MAX_SPEECH_S:g} s")
    if not isinstance(command.mouth, tuple) or len(command.mouth) > MAX_MOUTH_KEYS:
        raise ValueError(f"a mouth must be at most {MAX_MOUTH_KEYS} pairs of a time and an opening")
    _check_lead(command.lead_s)
    last_s = -1.0
    for key in command.mouth:
        if not _are_numbers(key, 2, MAX_SPEECH_S) or not (0.0 <= key[1] <= 1.0 and key[0] > last_s):
            raise ValueError("a mouth must be pairs of an increasing time in s and an opening 0..1")
        last_s = key[0]


def _check_lead(lead_s: object) -> None:
    if lead_s is not None and not (
        isinstance(lead_s, tuple) and _are_numbers(lead_s, len(lead_s), 1)
    ):
        raise ValueError("lead_s must be null or the latency of each joint, at most 1 s")


def _check_point(p: object) -> None:
    if not _are_numbers(p, 3, MAX_COORDINATE_M):
        raise ValueError(
            "a point must be three finite numbers in metres, x ahead, y left, z up, none "
            f"beyond +-{MAX_COORDINATE_M:g} m"
        )


def _check_distance(distance: object) -> None:
    if not (_is_within(distance, MAX_COORDINATE_M) and distance > 0.0):  # type: ignore[operator]
        raise ValueError(f"a distance must be above 0 and at most {MAX_COORDINATE_M:g} m")


def _check_control(command: ControlCommand) -> None:
    _check_who(command.who, command.stay)
    for_s = command.for_s
    if for_s is not None and not (_is_within(for_s, MAX_CONTROL_S) and for_s > 0.0):
        raise ValueError(f"for_s must be above 0 and at most {MAX_CONTROL_S:g} s")


def _check_who(who: object, flag: object = False) -> None:
    if not isinstance(who, str) or len(who) > MAX_WORDS:
        raise ValueError(f"who must be text of at most {MAX_WORDS} characters")
    if not isinstance(flag, bool):
        raise ValueError("stay, sway and confirmed must be true or false")


def _check_share(what: str, key: str, name: object, value: object) -> None:
    if not isinstance(name, str) or len(name) > MAX_WORDS:
        raise ValueError(f"{what} must be given by its name")
    if not _is_within(value, 1.0) or value < 0.0:  # type: ignore[operator]
        raise ValueError(f"the {key} of {what} must be a number 0..1")


def _are_numbers(values: object, count: int, most: float) -> bool:
    """Return whether this is a tuple of ``count`` finite numbers within +-most."""
    of_them = isinstance(values, tuple) and len(values) == count
    return of_them and all(_is_within(value, most) for value in values)  # type: ignore[attr-defined]


def _is_within(value: object, most: float) -> bool:
    # A comparison is false for NaN, and accepts integers too large for a float.
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and -most <= value <= most  # type: ignore[operator]


_NAMES = {kind: name for name, kind in COMMANDS.items()}


def as_json(command: Command) -> dict[str, object]:
    """Return a command as plain JSON: its name under "do", and its fields."""
    return {"do": _NAMES[type(command)], **command._asdict()}


def as_recorded_json(command: Command) -> dict[str, object]:
    """Return a command as JSON for recordings: its name under "order", and its fields."""
    return {"order": _NAMES[type(command)], **command._asdict()}


def from_json(data: object) -> Command:
    """Read the result of ``as_json`` or ``as_recorded_json``; fields with defaults may be omitted.

    Raises:
        ValueError: It is not a command; the message lists the commands or fields.
    """
    key = "order" if isinstance(data, dict) and "order" in data else "do"
    name = data.get(key) if isinstance(data, dict) else None
    kind = COMMANDS.get(name) if isinstance(name, str) else None
    if kind is None or not isinstance(data, dict):
        raise ValueError(f"not a command; available: {', '.join(COMMANDS)}")
    fields = {field: _to_tuples(value) for field, value in data.items() if field != key}
    needed = set(kind._fields).difference(kind._field_defaults)
    if not needed <= set(fields) <= set(kind._fields):
        raise ValueError(
            f"{name} has the fields {', '.join(kind._fields)}; given {', '.join(fields)}"
        )
    command = kind(**fields)  # type: ignore[arg-type]
    check_command(command)
    return command


def from_recorded_json(data: dict[str, object]) -> Command:
    """Read a command of a recorded run.

    Old recordings lack the fields ``stay`` and ``confirmed``: in their runs a control never
    timed out, and any client could resume.

    Raises:
        ValueError: As ``from_json``.
    """
    old = {"look_at": {"stay": True}, "jog": {"stay": True}, "resume": {"confirmed": True}}
    name = data.get("order")
    return from_json({**old.get(name if isinstance(name, str) else "", {}), **data})


def set_client(command: Command, who: str) -> Command:
    """Return a command with its client's name; commands without that field stay unchanged."""
    named = ControlCommand | Play | EndTrack | Say | Speak | Talk | Renew | Stop | Resume
    if isinstance(command, named):
        return command._replace(who=who[:MAX_WORDS])
    return command


def _to_tuples(value: object) -> object:
    """Convert lists to tuples, recursively."""
    if isinstance(value, list | tuple):
        return tuple(_to_tuples(item) for item in value)
    if isinstance(value, dict):
        return {key: _to_tuples(item) for key, item in value.items()}
    return value
