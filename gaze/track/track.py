"""Tracks as data: key frames of motion that is added to gaze, their state, and what they change.

A frame sets head, eyes, lids and further joints at a time, relative to their positions by gaze. A
channel without a value in a frame continues to the next frame that has one. Between the frames
everything moves with least jerk (``gazerig.gaze.track.motion``), from rest and back to rest.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import radians
from typing import Annotated, NamedTuple

from msgspec import Struct

from gazerig.params import Bounds, unknown_text

MAX_DURATION_S = 4 * 3600.0
"""Longest track."""
LIMIT_SHARE = 0.8
"""Share of the joints' speed and acceleration limits that a track may use; the rest is for gaze."""
RETURN_S = 0.4
"""Time in which what is displaced in the last frame returns to rest."""
FINISHED = "finished"
"""End reason of a track that was played to its end."""
SHOWN_S = 2.0
"""Time for which an ended track is shown."""
HEAD_CHANNELS = ("head_yaw", "head_pitch", "head_roll")
EYE_CHANNELS = ("eyes_yaw", "eyes_pitch")
LID_CHANNELS = ("left_upper_lid", "right_upper_lid", "left_lower_lid", "right_lower_lid")
GROUPS = {"neck": HEAD_CHANNELS, "eyes": EYE_CHANNELS, "lids": LID_CHANNELS}
"""Groups of channels that a track may own by one name."""
POSE_CHANNELS = (*HEAD_CHANNELS, *EYE_CHANNELS, *LID_CHANNELS)
"""The channels of all rigs; the joints that gaze does not move follow them."""
HEAD, EYES, LIDS = slice(0, 3), slice(3, 5), slice(5, 9)
"""Their places."""
LID_GROUPS = {
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


_Angle = Annotated[float | None, Bounds(-90, 90)]


@dataclass(frozen=True)
class KeyFrame:
    """Positions at one time of a track; anything that is not named does not move."""

    # fmt: off
    time_s: Annotated[float, Bounds(0.02, MAX_DURATION_S), "time since the start of the track"]
    head_yaw_deg: Annotated[_Angle, "head turn to the left, added to the gaze"] = None
    head_pitch_deg: Annotated[_Angle, "head turn upwards, added to the gaze"] = None
    head_roll_deg: Annotated[_Angle, "head tilt towards the right shoulder"] = None
    eyes_yaw_deg: Annotated[_Angle,
        "line of sight to the left of its target; eyes that it owns: to the left in the head"] = None
    eyes_pitch_deg: Annotated[_Angle,
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
        for name in self.lids:
            if name not in LID_GROUPS:
                raise ValueError(unknown_text("lids", name, LID_GROUPS))
        if not self.values():
            raise ValueError("names no motion; give e.g. head_pitch_deg")

    def values(self) -> dict[str, float]:
        """Return radians and factors - 1 of lids by channel, and levels by name."""
        angles = {name: getattr(self, f"{name}_deg") for name in (*HEAD_CHANNELS, *EYE_CHANNELS)}
        angles |= self.joints_deg
        found = {name: radians(angle) for name, angle in angles.items() if angle is not None}
        for group, channels in LID_GROUPS.items():
            if group in self.lids:
                found |= dict.fromkeys(channels, self.lids[group] - 1.0)
        return found | {f"{LEVEL}{name}": value for name, value in self.levels.items()}


@dataclass(frozen=True, eq=False)
class Track:
    """Motion and sound on one clock; each is hashed as one object, whatever its length."""

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

    def series(self) -> dict[str, list[tuple[float, float]]]:
        """Return the times and values of what its frames set, from rest to rest."""
        keys: dict[str, list[tuple[float, float]]] = {}
        for frame in self.frames:
            for name, value in frame.values().items():
                keys.setdefault(name, [(0.0, 0.0)]).append((frame.time_s, value))
        for pairs in keys.values():
            if pairs[-1][1] != 0.0:
                pairs.append((pairs[-1][0] + RETURN_S, 0.0))
        return keys


class TrackState(Struct, frozen=True):
    """A track on a rig: in the list of tracks, in the reply to an order, and after each tick.

    An ended one is shown for ``SHOWN_S``, the newest one always.

    Attributes:
        name: Its name.
        description: Its description.
        duration_s: Time until everything is at rest again, from the order on.
        length_s: Its last position, which is its duration at its own speed.
        limited: What the rig's limits change, and what the rig lacks; "" if nothing.
        refused: Reason why this rig cannot play it, "" if it can.
        owns: Joints that gaze does not move meanwhile.
        sound: Path of the sound, "" without one.
        volume: Volume of the sound, 0..1.
        cues: Names and positions of its cues in s.
        speed: Factor on its own speed.
        rounds: Number of repetitions, 0: until it is ended.
        who: Name of the client, "" if unknown.
        number: Number of the track since the start, from 1; 0 of one that has not been played.
        position_s: Position in the track; below 0 while the motion begins before the sound.
        end_reason: Reason for its end, ``FINISHED`` at its own end, "" while it plays.
    """

    name: str
    description: str = ""
    duration_s: float = 0.0
    length_s: float = 0.0
    limited: str = ""
    refused: str = ""
    owns: tuple[str, ...] = ()
    sound: str = ""
    volume: float = 1.0
    cues: tuple[tuple[str, float], ...] = ()
    speed: float = 1.0
    rounds: int = 1
    who: str = ""
    number: int = 0
    position_s: float = 0.0
    end_reason: str = ""

    @property
    def is_playing(self) -> bool:
        """Return whether it has begun and has not ended."""
        return not self.end_reason

    def text(self) -> str:
        """Return one line about the order to play it."""
        return f"{self.name} takes {self.duration_s:.1f} s{self.limited and f'; {self.limited}'}"


class PoseOffset(NamedTuple):
    """Factors on the values by gaze, and what is added to them, by channel.

    The channels are ``POSE_CHANNELS`` and the joints that gaze does not move. Angles are in
    radians, lids are openings 0..1. The eyes compensate a change of the head's angles.
    """

    factors: tuple[float, ...]
    added: tuple[float, ...]

    def change(self, channels: slice, values: Sequence[float]) -> list[float]:
        """Return the values of some channels for those by gaze."""
        rows = zip(self.factors[channels], values, self.added[channels], strict=True)
        return [factor * value + more for factor, value, more in rows]

    @property
    def joints_rad(self) -> tuple[float, ...]:
        """Return the angles of the joints that gaze does not move."""
        return self.added[len(POSE_CHANNELS) :]


NO_OFFSET = PoseOffset((1.0,) * len(POSE_CHANNELS), (0.0,) * len(POSE_CHANNELS))
