"""Speech as tracks: the mouth on the clock of the sound, and the sway of the head.

The sway is a track of its own, so that a nod replaces it and not the speech. It consists of three
slow oscillations, larger where the speech is louder: heads of speakers move all the time, more with
the voice (Hadar et al. 1983). The rates of pitch, yaw and roll and the ratio of their sizes are
those of a shipped conversational robot.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from gazerig.gaze.mouth.mouth_keys import MouthKey
from gazerig.gaze.track.track import KeyFrame, Track
from gazerig.gaze.types import Floats

SPEECH, SPEECH_SWAY = "speech", "speech_sway"
"""Names of the tracks."""
SWAY_DEG = 1.5
"""Largest yaw of the sway."""

_FIRST_S = 0.02
_RETURN_S = 0.3
_PART_OF_YAW = {"head_pitch": (2.2, 0.6), "head_yaw": (0.6, 1.0), "head_roll": (1.3, 0.3)}
"""Rate in Hz and size relative to yaw of each axis."""
_AVERAGED_S = 0.5
_LEAST_SHARE = 0.3
_NECK = ("neck_yaw", "neck_pitch", "neck_roll")


def speech_track(
    sound: str, duration_s: float, level: str, mouth: Sequence[MouthKey], volume: float
) -> Track:
    """Return the sound and the mouth of a speech as a track.

    Args:
        sound: Path of its sound, "" without one.
        duration_s: Its duration.
        level: Level that opens the mouth, "" without one.
        mouth: Openings over time.
        volume: Volume of the sound.
    """
    frames = [
        KeyFrame(key.time_s, levels={level: key.opening})
        for key in (mouth if level else ())
        if key.time_s >= _FIRST_S
    ]
    if not frames and not sound:  # a lid's factor 1 moves nothing
        frames = [KeyFrame(max(duration_s, _FIRST_S), lids={"all": 1.0})]
    return Track(
        "speech", tuple(frames), fit="slow", return_s=_RETURN_S, sound=sound, volume=volume
    )


def sway_track(duration_s: float, mouth: Sequence[MouthKey], sway_deg: float) -> Track:
    """Return the sway of a speech as a track.

    Args:
        duration_s: Duration of the speech.
        mouth: Openings over time.
        sway_deg: Largest yaw.
    """
    frames: dict[float, dict[str, Any]] = {}
    for key in sway_keys(mouth, duration_s, sway_deg):
        frames.setdefault(key.time_s, {})[f"{key.axis}_deg"] = key.offset_deg
    frames = frames or {_FIRST_S: {"head_yaw_deg": 0.0}}
    return Track(
        "sway of a speaker",
        tuple(KeyFrame(at_s, **frames[at_s]) for at_s in sorted(frames)),
        fit="slow",
        return_s=_RETURN_S,
        optional=_NECK,
    )


class SwayKey(NamedTuple):
    """Offset of one axis of the head at a time."""

    time_s: float
    axis: str
    offset_deg: float


def sway_keys(mouth: Sequence[MouthKey], duration_s: float, size_deg: float) -> tuple[SwayKey, ...]:
    """Return the turning points of the sway, in the order of their times.

    Args:
        mouth: Keys of the mouth, whose mean opening sets the size; without keys it is full.
        duration_s: Time until the head is at rest again.
        size_deg: Largest yaw.
    """
    keys = []
    for axis, (rate_hz, part) in _PART_OF_YAW.items():
        times_s = np.arange(1, int(duration_s * 2.0 * rate_hz)) / (2.0 * rate_hz)
        shares = _loud_shares(mouth, times_s)
        for k, (time_s, share) in enumerate(zip(times_s, shares, strict=True)):
            keys.append(SwayKey(float(time_s), axis, (-1) ** k * part * size_deg * float(share)))
    return tuple(sorted(keys))


def _loud_shares(mouth: Sequence[MouthKey], times_s: Floats) -> Floats:
    """Return the sizes of the sway at times, at most 1."""
    if not mouth:
        return np.ones(len(times_s))
    around_s = times_s[:, None] + np.linspace(-_AVERAGED_S, _AVERAGED_S, 11)
    opening = np.interp(around_s, [key.time_s for key in mouth], [key.opening for key in mouth])
    shares: Floats = np.minimum(1.0, _LEAST_SHARE + 2.0 * opening.mean(axis=1))
    return shares
