"""Tracks in the folder beside a rig."""

from contextlib import suppress
from pathlib import Path

from gazerig.config.load import ConfigError
from gazerig.config.shipped_files import is_path
from gazerig.config.tracks import load_track, track_name
from gazerig.gaze.track.track import Track


class TrackFolder:
    """Tracks in the folder beside a rig, which are found as soon as they are written.

    Args:
        rig: Name or path of the rig; one without a file has no folder.
    """

    def __init__(self, rig: str) -> None:
        self._folder = Path(rig).expanduser().parent / "tracks" if is_path(rig) else None
        self._stamps = self._read_stamps()

    def changes(self) -> dict[str, Track | str]:
        """Return the tracks whose files are new or changed since the last call; or their fault."""
        before = self._stamps
        with suppress(OSError):  # a file has just been removed: the next call finds the others
            self._stamps = self._read_stamps()
        found: dict[str, Track | str] = {}
        for path in [path for path, stamp in self._stamps.items() if before.get(path) != stamp]:
            try:
                found[track_name(str(path))] = load_track(path)
            except ConfigError as error:
                found[path.stem] = str(error)
        return found

    def _read_stamps(self) -> dict[Path, int]:
        files = self._folder.glob("*.yaml") if self._folder is not None else ()
        return {path: path.stat().st_mtime_ns for path in files}
