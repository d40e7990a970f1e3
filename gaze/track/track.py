"""Tracks as data: key frames of motion that is added to gaze, such as a nod.

A frame sets head, eyes, lids and further joints at a time, relative to their positions by gaze. A
channel without a value in a frame continues to the next frame that has one. Between the frames
everything moves with least jerk (``gazerig.gaze.track.curves``), from rest and back
to rest.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from math import radians
from typing import Annotated

from gazerig.params import Bounds

MIN_SPEED, MAX_SPEED = 0.1, 4.0
"""Range of factors on the original speed of a track."""
MAX_COUNT = 20
"""Most rounds of a track by one command."""
MAX_DURATION_S = 4 * 3600.0
"""Longest track."""
LIMIT_SHARE = 0.8
"""Share of the joints' speed and acceleration limits that a track may use; the rest is for gaze."""
RETURN_S = 0.4
"""Time in which what is displaced in the last frame returns to rest."""
FINISHED = "finished"
"""End reason of a track that was played to its end."""
HEAD_CHANNELS = ("head_yaw", "head_pitch", "head_roll")
EYE_CHANNELS = ("eyes_yaw", "eyes_pitch")
LID_CHANNELS = ("left_upper_lid", "right_upper_lid", "left_lower_lid", "right_lower_lid")
GROUPS = {"neck": HEAD_CHANNELS, "eyes": EYE_CHANNELS, "lids": LID_CHANNELS}
"""Groups of channels that a track may own by one name."""
POSE_CHANNELS = (*HEAD_CHANNELS, *EYE_CHANNELS, *LID_CHANNELS)
"""The channels of all rigs, in the order of PoseOffset.flat(); further joints follow them."""
LID_GROUPS: Mapping[str, tuple[str, ...]] = {
    "all": LID_CHANNELS,
    "upper": LID_CHANNELS[:2],
    "lower": LID_CHANNELS[2:],
    "left": LID_CHANNELS[::2],
    "right": LID_CHANNELS[1::2],
    **{name: (name,) for name in LID_CHANNELS},
}
"""Lids that a frame may name, groups before single lids."""


LEVEL = "level "
"""Start of the name of a level or an expression among channels."""


@dataclass(frozen=True)
class KeyFrame:
    """Positions at one time of a track; anything that is not named does not move."""

    # fmt: off
    time_s: Annotated[float, Bounds(0.02, MAX_DURATION_S), "time since the start of the track"]
    head_yaw_deg: Annotated[float | None, Bounds(-90, 90), "head turn to the left, added to the gaze"] = None
    head_pitch_deg: Annotated[float | None, Bounds(-90, 90), "head turn upwards, added to the gaze"] = None
    head_roll_deg: Annotated[float | None, Bounds(-90, 90), "head tilt towards the right shoulder"] = None
    eyes_yaw_deg: Annotated[float | None, Bounds(-90, 90),
        "line of sight to the left of its target; eyes that it owns: to the left in the head"] = None
    eyes_pitch_deg: Annotated[float | None, Bounds(-90, 90),
        "line of sight above its target; eyes that it owns: up in the head"] = None
    lids: Annotated[Mapping[str, float], Bounds(0, 3),
        "factor on the opening of lids: all, upper, lower, left, right or a lid's joint; 0: shut, 1: unchanged"] = field(
        default_factory=dict
    )
    joints_deg: Annotated[Mapping[str, float], Bounds(-180, 180), "offsets of further joints by name"] = field(
        default_factory=dict
    )
    levels: Annotated[Mapping[str, float], Bounds(0, 1), "levels of the rig, e.g. a mouth, and strengths of expressions"] = field(
        default_factory=dict
    )
    # fmt: on

    def __post_init__(self) -> None:
        """Check that the frame has valid contents.

        Raises:
            ValueError: it names nothing, or unknown lids.
        """
        unknown = [name for name in self.lids if name not in LID_GROUPS]
        if unknown:
            raise ValueError(f"unknown lids {unknown[0]!r}; available: {', '.join(LID_GROUPS)}")
        if not self.values():
            raise ValueError("names no motion; give e.g. head_pitch_deg")

    def values(self) -> dict[str, float]:
        """Return what the frame sets: radians and factors of lids by channel, levels by name."""
        angles = {
            name: getattr(self, f"{name}_deg") for name in (*HEAD_CHANNELS, *EYE_CHANNELS)
        } | dict(self.joints_deg)
        found = {name: radians(angle) for name, angle in angles.items() if angle is not None}
        for group, channels in LID_GROUPS.items():
            if group in self.lids:
                found.update(dict.fromkeys(channels, self.lids[group]))
        return found | {f"{LEVEL}{name}": value for name, value in self.levels.items()}


@dataclass(frozen=True)
class Track:
    """Motion and sound on one clock."""

    # fmt: off
    description: Annotated[str, "meaning of the track"]
    frames: Annotated[tuple[KeyFrame, ...], "key frames in the order of their times; everything returns to rest after the last one"] = ()
    owns: Annotated[tuple[str, ...],
        "neck, eyes, lids or joints whose angles, from the neutral pose, the track gives; gaze does not move them"] = ()
    sound: Annotated[str, "sound file, relative to this file"] = ""
    volume: Annotated[float, Bounds(0, 1), "volume of the sound"] = 1.0
    cues: Annotated[Mapping[str, float], Bounds(0, MAX_DURATION_S), "named times, reported when they are passed"] = field(
        default_factory=dict
    )
    loop: Annotated[bool, "repeat the track until it is ended"] = False
    # fmt: on

    def faults(self) -> Iterator[tuple[str, str]]:
        """Yield the faults between its parts: key, and rule."""
        if not self.frames and not self.sound:
            yield "frames", "a track needs at least one frame, or a sound"
        for i, (one, other) in enumerate(pairwise(self.frames)):
            if other.time_s <= one.time_s:
                rule = f"must be later than the previous frame, which is at {one.time_s:g} s"
                yield f"frames.{i + 1}.time_s", rule


def rest_value(channel: str) -> float:
    """Return the neutral value of a channel."""
    return 1.0 if channel in LID_CHANNELS else 0.0
