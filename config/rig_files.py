"""Files of a running rig, and which of them a browser may name.

A page that controls a running rig names characters, walks, profiles and files to save in. The
program reads and writes them with its user's permissions, so only files in one folder may be named.
"""

import os
import re
from collections.abc import Mapping
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from gazerig.config.load import find_file, shipped_path
from gazerig.config.parameters import flatten_changes
from gazerig.config.save import save
from gazerig.config.schema import load_rig, refusal
from gazerig.config.shipped_files import file_in_folders, is_path
from gazerig.robot.model.parameter import SavedFile

_KIND_OF_KEY = {
    "gaze.scanpath.transition_matrix": "scanpaths",
    "profile": "profiles",
    "character": "characters",
}
"""Keys of a rig that contain a shipped name or a file, and the kind of the names."""
_FILE_KEYS = re.compile(r"track_files|sound\.folders")
"""Other keys that contain files."""
_LOCAL_KEYS = re.compile(r"(doors|bus\.port|buses\..+\.port|sound\.voice)(\..+)?")
"""Keys that start programs or open devices of this computer."""
_LOCAL = (
    "starts a program or opens a device of the head's computer, so it cannot be set over the network: "
    "set it in the rig's file or with gazerig ctl set on that computer"
)


class RigLayers(NamedTuple):
    """Requested files of a rig, each a shipped name or a path."""

    name: str
    character: str | None
    profile: str | None


def save_layers(
    layers: RigLayers, to: str | None, wanted: Mapping[str, Any], now: datetime
) -> SavedFile:
    """Write values into a rig's file; character and profile must not override any of them.

    Args:
        layers: The rig's file, and the files merged over it.
        to: A new file for a copy with the values; None: the rig's own.
        wanted: Values by dotted key.
        now: Time for the backup's name.

    Raises:
        gazerig.config.load.ConfigError: see gazerig.config.save.save; or ``to`` exists or is not a
            YAML file.
    """
    own, source = find_file("rigs", layers.name), None
    if to is not None:
        if os.path.lexists(to) or not to.endswith((".yaml", ".yml")):
            rule = "already exists, or its name does not end in .yaml; choose another name"
            raise refusal("", rule, to)
        layers, own, source = layers._replace(name=to), Path(to), own
    check = partial(load_rig, character=layers.character, profile=layers.profile)
    return save(own, wanted, now, check, source)


class AllowedFolder:
    """A folder; files in it and below it may be named."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder.resolve()

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
        if kind and not is_path(given):
            shipped_path(kind, given)
            return given
        try:
            return file_in_folders([self.folder], given, start)
        except ValueError as error:
            raise refusal(key, str(error)) from None

    def check_changes(self, changes: Mapping[str, object]) -> None:
        """Check new values of a rig's keys: the files they name, and keys that stay with its owner.

        Relative paths start at the working folder, as when the files are opened.

        Raises:
            gazerig.config.load.ConfigError: a key may not be set, or a file may not be named.
        """
        for key, value in flatten_changes(changes).items():
            if _LOCAL_KEYS.fullmatch(key):
                raise refusal(key, _LOCAL)
            if key in _KIND_OF_KEY or _FILE_KEYS.fullmatch(key):
                for file in value if isinstance(value, list | tuple) else (value,):
                    if isinstance(file, str) and file:
                        self.check_file(file, _KIND_OF_KEY.get(key, ""), key, Path.cwd())
