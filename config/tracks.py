"""Tracks by name: shipped ones, and those of a rig's own files; all are checked."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Annotated

from gazerig.config.load import (
    ConfigError,
    ConfigFault,
    find_file,
    load,
    shipped_names,
    shipped_path,
)
from gazerig.config.shipped_files import file_in_folders
from gazerig.gaze.track.track import Track
from gazerig.robot.model.types import GAZE_JOINTS, JOINT_NAME

_GAZE_JOINT = (
    "is a joint of gaze: write head_yaw_deg, head_pitch_deg, head_roll_deg, eyes_yaw_deg, "
    "eyes_pitch_deg or lids of the frame instead"
)
_LARGEST = 20_000_000  # bytes: a show of four hours


def load_track(path: Path) -> Track:
    """Return the track of a file.

    Raises:
        gazerig.config.load.ConfigError: lists every fault.
    """
    track = load(path, Track, checks=[partial(_faults, path)], largest=_LARGEST)
    return replace(track, sound=str(path.parent / track.sound)) if track.sound else track


def _faults(path: Path, track: Track) -> Iterable[tuple[str, str]]:
    yield from track.faults()
    try:
        if track.sound:
            file_in_folders([path.parent], track.sound)
    except ValueError as error:
        yield "sound", f"{error}; put the sound next to the track's file"
    for i, frame in enumerate(track.frames):
        for joint in frame.joints_deg:
            if joint in GAZE_JOINTS:
                yield f"frames.{i}.joints_deg.{joint}", _GAZE_JOINT


@cache
def shipped_tracks() -> Mapping[str, Track]:
    """Return the tracks of this package by name."""
    return {name: load_track(shipped_path("tracks", name)) for name in shipped_names("tracks")}


def tracks_of(files: Sequence[str]) -> dict[str, Track]:
    """Return the tracks of a rig: shipped ones, and its own by the names of their files.

    Args:
        files: Paths of its own tracks; they replace shipped tracks of the same name.

    Raises:
        gazerig.config.load.ConfigError: lists every fault of the first file that has one.
    """
    own = {track_name(file): load_track(find_file("tracks", file)) for file in files}
    return {**shipped_tracks(), **own}


@dataclass(frozen=True)
class TrackSet:
    """Tracks as stored in a recording."""

    tracks: Annotated[Mapping[str, Track], "tracks of the rig by name"]


def track_name(file: str) -> str:
    """Return the name of a track in a file.

    Raises:
        gazerig.config.load.ConfigError: it is not a valid name.
    """
    name = Path(file).stem
    if JOINT_NAME.fullmatch(name):
        return name
    rule = "the file name is the track's name: lower-case letters, digits and _, beginning with a letter, at most 40 characters"
    raise ConfigError([ConfigFault(file, None, "", rule)])
