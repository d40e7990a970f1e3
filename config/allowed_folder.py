"""Files that a browser may name: shipped ones, and those in the rig's folder.

A page that controls a running rig names characters, walks, profiles and files to save in. The
program reads and writes them with the rights of its own user, so that only those in one folder
may be named.
"""

import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

from gazerig.config.load import ConfigError, ConfigFault, shipped_names

_KIND_OF_KEY = {
    "gaze.scanpath.transition_matrix": "scanpaths",
    "profile": "profiles",
    "gesture_files": "",
    "detector.model_file": "",
    "oak.face_model": "",
}
"""Keys of a rig that hold a shipped name or a file, and the kind of the names; "": no names."""
_MESH_FILE = re.compile(r"meshes\..+\.file")
_YAML = (".yaml", ".yml")


class AllowedFolder:
    """A folder and all below it, in which files may be named."""

    def __init__(self, folder: Path) -> None:
        self._folder = os.path.realpath(folder)

    def check_file(
        self, given: str, kind: str = "", key: str = "", start: Path | None = None
    ) -> str:
        """Return a shipped name as it is, or the whole path of a check_file in the folder.

        Args:
            given: a name or a path
            kind: of the shipped names that are taken, as "characters"; "": none
            key: what a fault is about
            start: where relative paths begin; None: in the folder

        Raises:
            gazerig.config.load.ConfigError: the file is elsewhere, links followed.
        """
        if kind and "/" not in given and not given.endswith(_YAML):
            if given in shipped_names(kind):
                return given
            there = ", ".join(shipped_names(kind))
            raise ConfigError(
                [ConfigFault("", None, key, repr(given), f"no such name; there is {there}")]
            )
        if given and "\0" not in given:
            begin = self._folder if start is None else str(start)
            path = os.path.realpath(os.path.join(begin, os.path.expanduser(given)))
            if path.startswith(self._folder.rstrip("/") + "/"):
                return path
        rule = f"from the page only files in {self._folder} and below can be named"
        raise ConfigError([ConfigFault("", None, key, repr(given), rule)])

    def check_changes(self, check_changes: Mapping[str, object]) -> None:
        """Check the files that new values of a rig's keys name.

        Relative paths begin in the working folder, as they do where they are opened.

        Raises:
            gazerig.config.load.ConfigError: with every file that may not.
        """
        faults: list[ConfigFault] = []
        for key, value in _assigned_values("", changes):
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
    """Return each value with its whole dotted key, whether it came dotted or as mappings."""
    if not isinstance(value, Mapping):
        yield above, value
        return
    for step, inner in value.items():
        yield from _assigned_values(f"{above}.{step}" if above else str(step), inner)
