"""Speech as tracks: the mouth on the clock of the sound, and the sway of the head.

The sway is a track of its own, so that a nod replaces it and not the speech.
"""

from collections.abc import Sequence
from typing import Any

from gazerig.gaze.mouth.mouth_keys import MouthKey
from gazerig.gaze.mouth.speech_sway import sway_keys
from gazerig.gaze.track.track import KeyFrame, Track

SPEECH, SPEECH_SWAY = "speech", "speech_sway"
"""Names of the tracks."""

_FIRST_S = 0.02
_RETURN_S = 0.3
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
