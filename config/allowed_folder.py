"""Files that a browser may name: shipped files, and files in the rig's folder.

A page that controls a running rig names characters, walks, profiles and files to save in. The
program reads and writes them with its user's permissions, so only files in one folder may be named.
"""

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from gazerig.config.load import ConfigError, ConfigFault, shipped_names

_KIND_OF_KEY = {
    "gaze.scanpath.transition_matrix": "scanpaths",
    "profile": "profiles",
    "character": "characters",
    "track_files": "",
    "sound.folders": "",
    "detector.model_file": "",
}
"""Keys of a rig that contain a shipped name or a file, and the kind of the names; "" for none."""
_LOCAL_KEYS = re.compile(r"(doors|bus\.port|buses\..+\.port|sound\.voice)(\..+)?")
"""Keys that start programs or open devices of this computer."""
_MESH_FILE = re.compile(r"meshes\..+\.file")
_LOCAL = (
    "starts a program or opens a device of the head's computer, so it cannot be set over the network: "
    "set it in the rig's file or with gazerig ctl set on that computer"
)
_YAML = (".yaml", ".yml")


def file_in_folders(folders: Sequence[Path], given: str, start: Path | None = None) -> str:
    """Return the full path of a file in folders or below, with links resolved.

    Args:
        folders: The folders.
        given: Path.
        start: Base of a relative path; None: the first folder.

    Raises:
        ValueError: It is not there.
    """
    roots = [os.path.realpath(folder) for folder in folders]
    if given and "\0" not in given:
        path = os.path.realpath(os.path.join(start or roots[0], os.path.expanduser(given)))
        if any(path.startswith(root.rstrip("/") + "/") for root in roots):
            return path
    raise ValueError(f"only files in {' or '.join(roots)} and below can be named here")


class AllowedFolder:
    """A folder; files in it and below it may be named."""

    def __init__(self, folder: Path) -> None:
        self._folder = os.path.realpath(folder)

    @property
    def folder(self) -> Path:
        """Return the folder."""
        return Path(self._folder)

    def check_file(
        self, given: str, kind: str = "", key: str = "", start: Path | None = None
    ) -> str:
        """Return a shipped name unchanged, or the full path of a file in the folder.

        Args:
            given: Name or path.
            kind: Kind of the accepted shipped names, e.g. "characters"; "" for none.
            key: Key for the message of a fault.
            start: Base of relative paths; None: the folder.

        Raises:
            gazerig.config.load.ConfigError: the file, after resolving links, is outside the folder.
        """
        if kind and "/" not in given and not given.endswith(_YAML):
            if given in shipped_names(kind):
                return given
            there = ", ".join(shipped_names(kind))
            raise ConfigError(
                [ConfigFault("", None, key, repr(given), f"no such name; available: {there}")]
            )
        try:
            return file_in_folders([self.folder], given, start)
        except ValueError as error:
            raise ConfigError([ConfigFault("", None, key, repr(given), str(error))]) from None

    def check_changes(self, changes: Mapping[str, object]) -> None:
        """Check new values of a rig's keys: the files they name, and keys that stay with its owner.

        Relative paths start at the working folder, as when the files are opened.

        Raises:
            gazerig.config.load.ConfigError: lists every key and file that may not be set or named.
        """
        faults: list[ConfigFault] = []
        for key, value in _assigned_values("", changes):
            if _LOCAL_KEYS.fullmatch(key):
                faults.append(ConfigFault("", None, key, repr(value), _LOCAL))
            files = (value,) if isinstance(value, str) else value
            kind = "" if _MESH_FILE.fullmatch(key) else _KIND_OF_KEY.get(key)
            if kind is None or not isinstance(files, list | tuple):
                continue
            for file in files:
                try:
                    if isinstance(file, str) and file:
                        self.check_file(file, kind, key, Path.cwd())
                except ConfigError as error:
                    faults += error.faults
        if faults:
            raise ConfigError(faults)


def _assigned_values(above: str, value: object) -> Iterator[tuple[str, object]]:
    """Return each value with its full dotted key, given as dotted keys or as nested mappings."""
    if not isinstance(value, Mapping):
        yield above, value
        return
    for step, inner in value.items():
        yield from _assigned_values(f"{above}.{step}" if above else str(step), inner)
