"""The script of a scene: its room, its people, and their acts over time.

The configuration's loader reads it from YAML. ``--scene`` plays a script without a room: faces and
hands that move through the air. ``--world`` plays one with a room: bodies on its floor. A script
repeats after every round, so every person must end the round at its starting place.

Place frame: the world's, with the neck base of the (first) head above its origin, on the floor.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Annotated, Any, Literal

from gazerig.params import Bounds


@dataclass(frozen=True)
class WorldCameraParams:
    """Pictures of the rig's camera; its mount and lens come from the rig (section camera)."""

    # fmt: off
    width_px: Annotated[int, Bounds(64, 1920), "width of a picture"] = 320
    height_px: Annotated[int, Bounds(48, 1200), "height of a picture"] = 240
    rate_hz: Annotated[float, Bounds(1, 120), "pictures a second"] = 30.0
    latency_ms: Annotated[float, Bounds(0, 500), "age of a picture when it arrives; simulated time alone"] = 60.0
    depth: Annotated[bool, "distances are measured too, as by a stereo camera"] = False
    depth_noise_1_m: Annotated[float, Bounds(0, 0.2), "error of a distance for each metre squared, metres"] = 0.004
    exposure_ms: Annotated[float, Bounds(0, 100), "how long light is collected; a turning head smears the picture"] = 8.0
    sub_exposures: Annotated[int, Bounds(1, 32), "pictures averaged over an exposure; 1: one, smeared by the turn alone"] = 1
    read_out_ms: Annotated[float, Bounds(0, 100), "from the first row to the last (rolling shutter); 0: all at once"] = 0.0
    bands: Annotated[int, Bounds(2, 64), "bands of rows that a rolling shutter is drawn in"] = 8
    blur_px: Annotated[float, Bounds(0, 10), "blur of the lens: standard deviation in pixels"] = 0.0
    noise_grey: Annotated[float, Bounds(0, 60), "standard deviation of the noise of reading, grey values"] = 3.0
    shot_noise_grey: Annotated[float, Bounds(0, 60), "noise of the light itself where a pixel is white, grey values"] = 0.0
    gain: Annotated[float, Bounds(0.05, 20), "brightness as a multiple; what gets over white is over-exposed"] = 1.0
    gamma: Annotated[float, Bounds(0.2, 5), "exponent of grey values between 0 and 1; above 1: darker middle"] = 1.0
    shadow_px: Annotated[int, Bounds(0, 8192), "side of the shadow map; 0: no shadows"] = 512
    samples: Annotated[int, Bounds(0, 16), "samples a pixel against jagged edges; 0: one"] = 4
    reflections: Annotated[bool, "shiny floors mirror what stands on them"] = False
    # fmt: on

    def from_params(self, other: type) -> dict[str, Any]:
        """Return the values of those fields that another dataclass of parameters has too."""
        names = {field.name for field in fields(other)} & {field.name for field in fields(self)}
        return {name: getattr(self, name) for name in names}


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
    "be_hit",
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
    """One thing that a person or a thing does."""

    # fmt: off
    at_s: Annotated[float, Bounds(0, 600), "when it begins, from the beginning of the round"]
    do: Annotated[Do, "what is done"]
    to: Annotated[str, "where to: a place, a seat, a person, or head (the robot's)"] = ""
    via: Annotated[tuple[str, ...], "places that a walk passes"] = ()
    for_s: Annotated[float | None, Bounds(0.1, 600), "how long it takes; null: as long as it usually does"] = None
    side: Annotated[Literal["left", "right"], "which hand, the person's own"] = "right"
    ahead_m: Annotated[float, Bounds(-2, 2), "how far ahead a step goes"] = 0.0
    left_m: Annotated[float, Bounds(-2, 2), "how far to the person's left a step goes"] = 0.0
    speed_m_s: Annotated[float, Bounds(0.2, 2), "speed of a walk"] = 0.9
    thing: Annotated[str, "the thing that is passed"] = ""
    yaw_deg: Annotated[float, Bounds(-60, 60), "how far to its left a face glances off what it looks at"] = 0.0
    pitch_deg: Annotated[float, Bounds(-60, 60), "how far up it glances"] = 0.0
    frees: Annotated[Literal["face", "chest"], "what an open guard leaves free"] = "face"
    vary_s: Annotated[float, Bounds(0, 10), "how much earlier or later it begins at most, by the seed"] = 0.0
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
    """How a hand without an arm waves."""

    # fmt: off
    aside_m: Annotated[float, Bounds(0, 1), "how far from the middle of the face the hand is"] = 0.25
    swing_m: Annotated[float, Bounds(0, 0.3), "how far it swings to each side"] = 0.11
    raise_s: Annotated[float, Bounds(0.1, 2), "how long it takes to rise"] = 0.4
    smooth: Annotated[bool, "whether it rises with minimum jerk; otherwise with constant speed"] = True
    # fmt: on


@dataclass(frozen=True)
class PersonScript:
    """One person: looks, stature, and the acts of a round."""

    # fmt: off
    start: Annotated[str, "the place where the round begins and ends; on a seat the person sits"]
    look: Annotated[int, Bounds(0, 7), "which face, hair and clothes"] = 0
    stature_m: Annotated[float, Bounds(0.9, 2.1), "height of the person who stands upright"] = 1.72
    gloves: Annotated[bool, "wears boxing gloves"] = False
    looks_at: Annotated[str, "what is looked at before the first look_at: a person, a place or head"] = HEAD
    acts: Annotated[tuple[Act, ...], "what is done, in the order of time"] = ()
    level: Annotated[bool, "without a room: the face does not pitch towards what it looks at"] = False
    sway: Annotated[SwayScript | None, "without a room: small motion; null: none"] = None
    wave: Annotated[WaveScript, "without a room: how it waves"] = field(default_factory=WaveScript)
    # fmt: on


@dataclass(frozen=True)
class ThingScript:
    """A thing that people hand to each other, or without a room one that moves by itself."""

    # fmt: off
    held_by: Annotated[str, "the person who holds it when the round begins and ends"] = ""
    side: Annotated[Literal["left", "right"], "in which hand"] = "right"
    kind: Annotated[Literal["cup", "ball", "pinwheel", "hand"], "what it is"] = "cup"
    at: Annotated[str, "without a room: its place, or where a hand is before it reaches"] = ""
    acts: Annotated[tuple[Act, ...], "without a room: when a pinwheel spins, or a hand reaches"] = ()
    # fmt: on


@dataclass(frozen=True)
class ExpectedLook:
    """A time of the round in which the gaze should be on a target."""

    # fmt: off
    name: Annotated[str, "what happens then"]
    kind: Annotated[Literal["face", "hand", "pinwheel", "thing"], "kind of the target"]
    start_s: Annotated[float, Bounds(0, 600), "from when on"]
    end_s: Annotated[float, Bounds(0, 600), "until when"]
    at: Annotated[str, "the place of the target"]
    within_m: Annotated[float, Bounds(0.01, 5), "how far from it the target is at most"] = 0.3
    # fmt: on


@dataclass(frozen=True)
class PlaceScript:
    """A place of the script's own: on the floor, or without a room in the air."""

    x_m: Annotated[float, Bounds(-10, 10), "distance ahead of the neck base"]
    y_m: Annotated[float, Bounds(-10, 10), "distance to the left of it"]
    facing_deg: Annotated[float, Bounds(-180, 180), "where one who stands there faces"] = 180.0
    height_m: Annotated[
        float,
        Bounds(0, 3),
        "height above the floor of a face there, or of what is looked or pointed at",
    ] = 1.3


@dataclass(frozen=True)
class HeadScript:
    """Another head in the same world, controlled by its own robot."""

    # fmt: off
    rig: Annotated[str, "name or file of its rig; empty: that of the first head"] = ""
    x_m: Annotated[float, Bounds(-10, 10), "distance of its neck base ahead of the first one's"] = 0.9
    y_m: Annotated[float, Bounds(-10, 10), "distance of it to the left"] = 0.0
    facing_deg: Annotated[float, Bounds(-180, 180), "where it faces; 180: the first head"] = 180.0
    # fmt: on


@dataclass(frozen=True)
class LightParams:
    """Brightness of the room."""

    # fmt: off
    ambient: Annotated[float, Bounds(0, 1), "light that comes from everywhere"] = 0.5
    window: Annotated[float, Bounds(0, 2), "light that falls in from the window's side"] = 0.44
    lamp: Annotated[float, Bounds(0, 2), "light of the lamp under the ceiling"] = 0.30
    opposite: Annotated[float, Bounds(0, 2), "light from the first head's far side, against the window's"] = 0.0
    shadows: Annotated[bool, "whether the window's light casts shadows, which cost time"] = False
    # fmt: on


@dataclass(frozen=True)
class SceneScript:
    """A room and the people in it for one round."""

    # fmt: off
    people: Annotated[Mapping[str, PersonScript], "who is there, by name"]
    room: Annotated[RoomName, "the room; none: faces and hands alone, for --scene"] = "living-room"
    round_s: Annotated[float, Bounds(2, 600), "length of a round"] = 60.0
    neck_height_m: Annotated[float, Bounds(0.3, 2.0), "height of the robot's neck base above the floor"] = 0.95
    description: Annotated[str, "what happens, in a few words"] = ""
    places: Annotated[Mapping[str, PlaceScript], "places of its own, besides the room's"] = field(default_factory=dict)
    things: Annotated[Mapping[str, ThingScript], "things, such as those that are passed from hand to hand"] = field(default_factory=dict)
    heads: Annotated[Mapping[str, HeadScript], "other heads beside the first, by name"] = field(default_factory=dict)
    light: Annotated[LightParams, "how bright it is"] = field(default_factory=LightParams)
    camera: Annotated[WorldCameraParams, "pictures of the robot's camera"] = field(default_factory=WorldCameraParams)
    expected: Annotated[tuple[ExpectedLook, ...] | None, "when the gaze should be where; null: as the acts suggest"] = None
    # fmt: on


Fault = tuple[str, str]
"""Dotted key path and the broken rule."""
