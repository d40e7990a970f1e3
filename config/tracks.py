"""Tracks by name: shipped ones, and those of a rig's own files; all are checked."""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path

from gazerig.config.load import ConfigError, ConfigFault, find_file, load, shipped_names
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
    check_name(path)
    track = load(path, Track, checks=[partial(_faults, path)], largest=_LARGEST)
    return replace(track, sound=str(path.parent / track.sound)) if track.sound else track


def check_name(path: Path) -> None:
    """Check that the name of a file is that of a track.

    Raises:
        gazerig.config.load.ConfigError: it is not a valid name.
    """
    if not JOINT_NAME.fullmatch(path.stem):
        rule = "the file name is the track's name: lower-case letters, digits and _, beginning with a letter, at most 40 characters"
        raise ConfigError([ConfigFault(str(path), None, "", rule)])


def _faults(path: Path, track: Track) -> Iterable[tuple[str, str]]:
    if not track.frames and not track.sound:
        yield "frames", "a track needs at least one frame, or a sound"
    try:
        if track.sound:
            file_in_folders([path.parent], track.sound)
    except ValueError as error:
        yield "sound", f"{error}; put the sound next to the track's file"
    before_s = 0.0
    for i, frame in enumerate(track.frames):
        if frame.time_s <= before_s:
            rule = f"must be later than the previous frame, which is at {before_s:g} s"
            yield f"frames.{i}.time_s", rule
        before_s = frame.time_s
        for joint in frame.joints_deg:
            if joint in GAZE_JOINTS:
                yield f"frames.{i}.joints_deg.{joint}", _GAZE_JOINT


class TrackFiles:
    """The tracks of a rig by name: shipped ones, its own, and those in the folder beside it.

    Args:
        rig: Name or path of the rig.
        files: Paths of its own tracks; they replace shipped tracks of the same name.

    Raises:
        gazerig.config.load.ConfigError: lists every fault of the first file that has one.
    """

    def __init__(self, rig: str, files: Sequence[str]) -> None:
        self._folder = find_file("rigs", rig).parent / "tracks"
        self._written = self._times_written()
        paths = [find_file("tracks", name) for name in (*shipped_names("tracks"), *files)]
        self._tracks: dict[str, Track | ConfigError] = {one.stem: load_track(one) for one in paths}

    def read(self) -> Mapping[str, Track | ConfigError]:
        """Return all tracks, with those that have been written into the folder, or their faults."""
        written = self._written
        with suppress(OSError):  # a file has just been removed: the next call finds the others
            written = self._times_written()
        for path, written_ns in written.items():
            if self._written.get(path) != written_ns:
                try:
                    self._tracks[path.stem] = load_track(path)
                except ConfigError as error:
                    self._tracks[path.stem] = error
        self._written = written
        return self._tracks

    def _times_written(self) -> dict[Path, int]:
        return {path: path.stat().st_mtime_ns for path in self._folder.glob("*.yaml")}
