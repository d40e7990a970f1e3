"""The script of a scene: its room, its people, and their acts over time.

The configuration's loader reads it from YAML. ``--scene`` plays a script without a room: faces and
hands that move through the air. ``--world`` plays one with a room: bodies on its floor. A script
repeats after every round, so every person must end the round at its starting place.

Place frame: the world's, with the neck base of the (first) head above its origin, on the floor.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from gazerig.params import Bounds
from gazerig.robot.model.commands import TalkOrder


@dataclass(frozen=True)
class WorldCameraParams:
    """Pictures of the rig's camera; its mount and lens come from the rig (section camera)."""

    # fmt: off
    width_px: Annotated[int, Bounds(64, 1920), "width of a picture"] = 320
    height_px: Annotated[int, Bounds(48, 1200), "height of a picture"] = 240
    rate_hz: Annotated[float, Bounds(1, 120), "pictures per second"] = 30.0
    samples: Annotated[int, Bounds(0, 16), "samples per pixel against jagged edges; 0: one"] = 4
    # fmt: on


Do = Literal[
    "walk",
    "step",
    "turn",
    "sit",
    "stand",
    "look_at",
    "speak",
    "nod",
    "shake",
    "wave",
    "gesture",
    "point",
    "reach",
    "push",
    "pass",
    "guard",
    "punch",
    "feint",
    "open_guard",
    "glance",
    "spin",
]
"""The acts of a person or a thing."""

RoomName = Literal["none", "living-room", "gym", "hall"]
"""The rooms (gazerig.features.world.room)."""

HEAD, BASE = "head", "base"
"""Names of the robot's head and, without a room, of its neck base in a script."""


@dataclass(frozen=True)
class Act:
    """One action of a person or a thing."""

    # fmt: off
    at_s: Annotated[float, Bounds(0, 600), "start time, from the start of the round"]
    do: Annotated[Do, "kind of action"]
    to: Annotated[str, "target: a place, a seat, a person, or head (the robot's)"] = ""
    via: Annotated[tuple[str, ...], "intermediate places of a walk"] = ()
    for_s: Annotated[float | None, Bounds(0.1, 600), "duration; null: the usual one"] = None
    side: Annotated[Literal["left", "right"], "the hand, from the person's own view"] = "right"
    ahead_m: Annotated[float, Bounds(-2, 2), "length of a step forwards"] = 0.0
    left_m: Annotated[float, Bounds(-2, 2), "length of a step to the person's left"] = 0.0
    speed_m_s: Annotated[float, Bounds(0.2, 2), "speed of a walk"] = 0.9
    thing: Annotated[str, "the thing that is passed"] = ""
    yaw_deg: Annotated[float, Bounds(-60, 60), "angle of a glance to the face's left, relative to its gaze target"] = 0.0
    pitch_deg: Annotated[float, Bounds(-60, 60), "angle of a glance upwards"] = 0.0
    frees: Annotated[Literal["face", "chest"], "part of the body that an open guard leaves uncovered"] = "face"
    vary_s: Annotated[float, Bounds(0, 10), "largest random shift of its start, drawn from the seed"] = 0.0
    # fmt: on


@dataclass(frozen=True)
class SwayScript:
    """Small motion of a face: a sine along each axis of the world."""

    # fmt: off
    m: Annotated[tuple[float, float, float], Bounds(0, 0.1), "amplitudes, metres"] = (0.005, 0.009, 0.003)
    hz: Annotated[tuple[float, float, float], Bounds(0, 3), "rates"] = (0.21, 0.17, 0.29)
    rad: Annotated[tuple[float, float, float], Bounds(-7, 7), "phases at the start"] = (0.0, 1.0, 2.0)
    # fmt: on


@dataclass(frozen=True)
class WaveScript:
    """Waving of a hand without an arm."""

    # fmt: off
    aside_m: Annotated[float, Bounds(0, 1), "distance of the hand from the middle of the face"] = 0.25
    swing_m: Annotated[float, Bounds(0, 0.3), "amplitude of its swing to each side"] = 0.11
    raise_s: Annotated[float, Bounds(0.1, 2), "time that it takes to rise"] = 0.4
    smooth: Annotated[bool, "whether it rises with minimum jerk; otherwise with constant speed"] = True
    # fmt: on


@dataclass(frozen=True)
class PersonScript:
    """One person: appearance, height, and the acts of a round."""

    # fmt: off
    start: Annotated[str, "the place where the round begins and ends; on a seat the person sits"]
    look: Annotated[int, Bounds(0, 1), "face and hair: 0 short, 1 long"] = 0
    stature_m: Annotated[float, Bounds(0.9, 2.1), "height of the standing person"] = 1.72
    gloves: Annotated[bool, "whether the person wears boxing gloves"] = False
    looks_at: Annotated[str, "gaze target before the first look_at: a person, a place or head"] = HEAD
    acts: Annotated[tuple[Act, ...], "acts in the order of time"] = ()
    level: Annotated[bool, "without a room: the face does not pitch towards its gaze target"] = False
    sway: Annotated[SwayScript | None, "without a room: small motion; null: none"] = None
    wave: Annotated[WaveScript, "without a room: waving of the hand"] = field(default_factory=WaveScript)
    # fmt: on


@dataclass(frozen=True)
class ThingScript:
    """A thing that people hand to each other, or without a room one that moves by itself."""

    # fmt: off
    held_by: Annotated[str, "the person who holds it when the round begins and ends"] = ""
    side: Annotated[Literal["left", "right"], "the hand that holds it"] = "right"
    kind: Annotated[Literal["cup", "ball", "pinwheel", "hand"], "kind of thing"] = "cup"
    at: Annotated[str, "without a room: its place, or the place of a hand before it reaches"] = ""
    acts: Annotated[tuple[Act, ...], "without a room: times at which a pinwheel spins, or a hand reaches"] = ()
    # fmt: on


@dataclass(frozen=True)
class ExpectedLook:
    """A time of the round in which the gaze should be on a target."""

    # fmt: off
    name: Annotated[str, "description of the event"]
    kind: Annotated[Literal["face", "hand", "pinwheel", "thing"], "kind of the target"]
    start_s: Annotated[float, Bounds(0, 600), "start of that time"]
    end_s: Annotated[float, Bounds(0, 600), "until when"]
    at: Annotated[str, "the place of the target"]
    within_m: Annotated[float, Bounds(0.01, 5), "largest distance of the target from that place"] = 0.3
    # fmt: on


@dataclass(frozen=True)
class PlaceScript:
    """A place of the script's own: on the floor, or without a room in the air."""

    x_m: Annotated[float, Bounds(-10, 10), "distance ahead of the neck base"]
    y_m: Annotated[float, Bounds(-10, 10), "distance to the left of it"]
    facing_deg: Annotated[float, Bounds(-180, 180), "direction in which a person faces there"] = (
        180.0
    )
    height_m: Annotated[
        float,
        Bounds(0, 3),
        "height above the floor of a face there, or of a target of looks or of pointing",
    ] = 1.3


@dataclass(frozen=True)
class AgentAct:
    """One report of a simulated voice agent, as a real one sends it to the head."""

    # fmt: off
    at_s: Annotated[float, Bounds(0, 600), "time of the report, from the start of the round"]
    state: Annotated[TalkOrder, "what the agent does from then on; interrupt: a person has interrupted it"]
    person: Annotated[str, "its partner, a person of the script; empty: the same as before"] = ""
    seconds: Annotated[float | None, Bounds(0.1, 600), "planned duration of its speech; null: estimated from the text"] = None
    text: Annotated[str, "what it says"] = ""
    # fmt: on


@dataclass(frozen=True)
class SceneScript:
    """A room and the people in it for one round."""

    # fmt: off
    people: Annotated[Mapping[str, PersonScript], "people by name"]
    room: Annotated[RoomName, "the room; none: faces and hands alone, for --scene"] = "living-room"
    round_s: Annotated[float, Bounds(2, 600), "length of a round"] = 60.0
    neck_height_m: Annotated[float, Bounds(0.3, 2.0), "height of the robot's neck base above the floor"] = 0.95
    description: Annotated[str, "short description of the scene"] = ""
    places: Annotated[Mapping[str, PlaceScript], "additional places besides the room's"] = field(default_factory=dict)
    things: Annotated[Mapping[str, ThingScript], "things, for example objects that people hand to each other"] = field(default_factory=dict)
    agent: Annotated[tuple[AgentAct, ...], "reports of the robot's simulated voice agent, in the order of time"] = ()
    camera: Annotated[WorldCameraParams, "pictures of the robot's camera"] = field(default_factory=WorldCameraParams)
    expected: Annotated[tuple[ExpectedLook, ...] | None, "expected gaze over time; null: derived from the acts"] = None
    # fmt: on


Fault = tuple[str, str]
"""Dotted key path and the broken rule."""
