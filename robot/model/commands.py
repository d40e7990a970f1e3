"""What people ask of a running robot, from the page, another program or the command line.

A command is plain data: it crosses processes as JSON, is obeyed at the next tick, and a
recording of a run holds it, so that the run can be done again.
"""

from collections.abc import Mapping
from typing import Literal, NamedTuple

from gazerig.gaze.angles import Angles2, Vec3

Value = float | int | bool | str | None | tuple["Value", ...] | Mapping[str, "Value"]
"""What a key of a rig's YAML can hold."""

Frame = Literal["world", "head"]
HEARTBEAT_S = 1.0
"""A lead that is not to stay lapses when it was not renewed for so long."""
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
        at least every ``HEARTBEAT_S``
    for_s: ends after so many seconds; None: without such an end
    pointer: the point is somebody's mouse pointer, which is said of who leads
    """

    p_world_m: Vec3 | None
    who: str = ""
    stay: bool = False
    for_s: float | None = None
    pointer: bool = False


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

COMMANDS: dict[str, type[Command]] = {
    "ask": Ask, "look_at": LookAt, "look_at_in_head": LookAtInHead,
    "look_at_direction": LookAtDirection, "look_at_person": LookAtPerson,
    "look_at_pixel": LookAtPixel, "jog": Jog, "express": Express, "set_level": SetLevel,
    "play": Play,
    "renew": Renew, "stop": Stop, "resume": Resume, "tune": Tune,
}  # fmt: skip
