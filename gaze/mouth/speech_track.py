"""Speech as a track: the mouth on the clock of the sound."""

from collections.abc import Sequence

from gazerig.gaze.track.track import KeyFrame, Track

SPEECH = "speech"
"""Name of the track."""

_FIRST_S = 0.02


def speech_track(
    sound: str, duration_s: float, level: str, mouth: Sequence[tuple[float, float]], volume: float
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
        KeyFrame(time_s, levels={level: opening})
        for time_s, opening in (mouth if level else ())
        if time_s >= _FIRST_S
    ]
    if not frames and not sound:  # a lid's factor 1 moves nothing
        frames = [KeyFrame(max(duration_s, _FIRST_S), lids={"all": 1.0})]
    return Track(SPEECH, tuple(frames), sound=sound, volume=volume)
