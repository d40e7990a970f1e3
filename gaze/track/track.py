"""Tracks as data: key frames of motion that is added to gaze, such as a nod.

A frame sets head, eyes, lids and further joints at a time, relative to their positions by gaze. A
channel without a value in a frame continues to the next frame that has one. Between the frames
everything moves with least jerk (``gazerig.gaze.track.minimum_jerk_curve``), from rest and back
to rest.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from math import radians
from typing import Annotated

from gazerig.params import Bounds

MIN_SPEED, MAX_SPEED = 0.1, 4.0
"""Range of factors on the original speed of a track."""
MAX_COUNT = 20
"""Largest number of repetitions of a track by one command."""
MAX_FRAMES = 200_000
"""Largest number of frames of a track."""
MAX_DURATION_S = 4 * 3600.0
"""Longest track."""
LIMIT_SHARE = 0.8
"""Share of the joints' speed and acceleration limits that a track may use; the rest is for gaze."""
RETURN_S = 0.4
"""Time in which what is displaced in the last frame returns to rest."""
BLEND_IN_S, BLEND_OUT_S = 0.4, 0.25
"""Shortest times in which a track takes over its joints, and returns to rest if interrupted."""
HEAD_CHANNELS = ("head_yaw", "head_pitch", "head_roll")
EYE_CHANNELS = ("eyes_yaw", "eyes_pitch")
LID_CHANNELS = ("left_upper_lid", "right_upper_lid", "left_lower_lid", "right_lower_lid")
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
"""Start of the name of a level among channels."""
KEEP = ""
"""Value of ``look_at`` in a frame that does not change the gaze."""
_FAR_M = 1000.0


def is_look(look: object) -> bool:
    """Return whether a value is a valid ``look_at``."""
    if isinstance(look, tuple | list):
        numbers = [isinstance(x, int | float) and not isinstance(x, bool) for x in look]
        return len(look) == 3 and all(numbers) and all(-_FAR_M <= x <= _FAR_M for x in look)
    if isinstance(look, int) and not isinstance(look, bool):
        return look >= 0
    return look is None or look in (KEEP, "person")


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
    look_at: Annotated[object, "gaze from this time on: a point [x, y, z] in the world, m; person: the nearest; "
        "the number of a person; null: gaze chooses again"] = KEEP
    express: Annotated[str, "expression of the rig's table from this time on"] = ""
    strength: Annotated[float, Bounds(0, 1), "strength of the expression"] = 1.0
    levels: Annotated[Mapping[str, float], Bounds(0, 1), "levels of the rig's table, e.g. the opening of a jaw"] = field(
        default_factory=dict
    )
    # fmt: on

    def __post_init__(self) -> None:
        """Check that the frame has valid contents.

        Raises:
            ValueError: it names nothing, unknown lids or an invalid point.
        """
        if not is_look(self.look_at):
            raise ValueError(
                f"look_at {self.look_at!r:.60}: give [x, y, z] in m within +-{_FAR_M:g}, person, "
                "the number of a person, or null"
            )
        unknown = [name for name in self.lids if name not in LID_GROUPS]
        if unknown:
            raise ValueError(f"unknown lids {unknown[0]!r}; available: {', '.join(LID_GROUPS)}")
        if not (self.values() or self.levels or self.express or self.look_at != KEEP):
            raise ValueError("names no motion; give e.g. head_pitch_deg")

    def values(self) -> dict[str, float]:
        """Return the value of each channel that the frame names: radians, and factors of lids."""
        angles = {
            name: getattr(self, f"{name}_deg") for name in (*HEAD_CHANNELS, *EYE_CHANNELS)
        } | dict(self.joints_deg)
        found = {name: radians(angle) for name, angle in angles.items() if angle is not None}
        for group, channels in LID_GROUPS.items():
            if group in self.lids:
                found.update(dict.fromkeys(channels, self.lids[group]))
        return found


@dataclass(frozen=True)
class Track:
    """Motion, gaze, face and sound on one clock."""

    # fmt: off
    description: Annotated[str, "meaning of the track"]
    frames: Annotated[tuple[KeyFrame, ...], "key frames in the order of their times; everything returns to rest after the last one"] = ()
    count: Annotated[int, Bounds(1, MAX_COUNT), "number of repetitions"] = 1
    loop_s: Annotated[tuple[float, float] | None, Bounds(0, 60),
        "times of the two frames between which it repeats; null: the whole track repeats"] = None
    optional: Annotated[tuple[str, ...], "joints that a rig may lack; a rig that lacks any other joint is refused the track"] = ()
    frames_without_neck: Annotated[tuple[KeyFrame, ...],
        "alternative frames for rigs that lack a non-optional neck joint of the track"] = ()
    owns: Annotated[tuple[str, ...],
        "neck, eyes, lids or joints whose angles, from the neutral pose, the track gives; gaze does not move them"] = ()
    sound: Annotated[str, "sound file, relative to this file"] = ""
    volume: Annotated[float, Bounds(0, 1), "volume of the sound"] = 1.0
    cues: Annotated[Mapping[str, float], Bounds(0, MAX_DURATION_S), "named times, reported when they are passed"] = field(
        default_factory=dict
    )
    loop: Annotated[bool, "repeat the track until it is ended"] = False
    # fmt: on

    def __post_init__(self) -> None:
        """Check the number of frames.

        Raises:
            ValueError: there are no frames, or too many.
        """
        if not self.frames and not self.sound:
            raise ValueError("a track needs at least one frame, or a sound")
        most = max(len(self.frames), len(self.frames_without_neck))
        if most > MAX_FRAMES:
            raise ValueError(f"{most} frames: a track has at most {MAX_FRAMES}; omit some")

    @property
    def layers(self) -> tuple[str, ...]:
        """Return what its frames move: head, eyes, lids, gaze, expression, levels and joints."""
        found: dict[str, None] = {}
        for frame in self.frames:
            for channel in frame.values():
                kind = (
                    channel.partition("_")[0]
                    if channel in (*HEAD_CHANNELS, *EYE_CHANNELS)
                    else channel
                )
                found["lids" if channel in LID_CHANNELS else kind] = None
            found |= dict.fromkeys(frame.levels)
            if frame.look_at != KEEP:
                found["gaze"] = None
            if frame.express:
                found["expression"] = None
        return tuple(found)


def rest_value(channel: str) -> float:
    """Return the neutral value of a channel."""
    return 1.0 if channel in LID_CHANNELS else 0.0


def frame_faults(frames: tuple[KeyFrame, ...]) -> list[tuple[int, str]]:
    """Return the faults between frames: index of the frame, and the rule."""
    return [
        (i + 1, f"must be later than the previous frame, which is at {one.time_s:g} s")
        for i, (one, other) in enumerate(pairwise(frames))
        if other.time_s <= one.time_s
    ]


def loop_fault(track: Track) -> str:
    """Return the fault of the times of a loop, "" without one."""
    if track.loop_s is None:
        return ""
    begin_s, end_s = track.loop_s
    for frames in filter(None, (track.frames, track.frames_without_neck)):
        times = [frame.time_s for frame in frames]
        absent = [t for t in (begin_s, end_s) if t not in times and t != 0.0]
        if absent:
            listed = ", ".join(f"{t:g}" for t in times)
            return f"{absent[0]:g} s is not the time of a frame; frames are at {listed} s"
    if begin_s >= end_s:
        return f"the first time must be before the second: {begin_s:g}, {end_s:g}"
    return ""


def channel_keys(
    track: Track, frames: tuple[KeyFrame, ...], count: int
) -> dict[str, list[tuple[float, float]]]:
    """Return (time, value) keys of each channel and each level, by ``LEVEL`` and its name.

    The loop is repeated, and everything ends at rest.

    Args:
        track: defines the loop.
        frames: those of its frames that are played.
        count: number of repetitions.
    """
    last_s = frames[-1].time_s if frames else 0.0
    begin_s, end_s = track.loop_s or (0.0, last_s)
    found: dict[str, list[tuple[float, float]]] = {}
    for frame in frames:
        rounds = range(count) if begin_s < frame.time_s <= end_s else [0]
        if frame.time_s > end_s:
            rounds = [count - 1]
        levels = {f"{LEVEL}{name}": value for name, value in frame.levels.items()}
        for name, value in {**frame.values(), **levels}.items():
            keys = found.setdefault(name, [])
            keys += [(frame.time_s + i * (end_s - begin_s), value) for i in rounds]
    for name, keys in found.items():
        keys.sort()
        if keys[-1][1] != rest_value(name):
            keys.append((keys[-1][0] + RETURN_S, rest_value(name)))
    return found
