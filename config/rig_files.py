"""Files of a running rig: read together, and written only if they can be loaded again.

A file is written from its last text without a fault. A rig's file that a user has made invalid
meanwhile is kept as a backup, and is never the base of a new file.
"""

import os
from collections.abc import Mapping
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from gazerig.config.load import ConfigError, ConfigFault
from gazerig.config.rig import Rig
from gazerig.config.save import rig_file, save
from gazerig.config.schema import layers_of, load_rig
from gazerig.drivers.files.file_input import kind_of, read_limited
from gazerig.robot.model.parameter import SavedFile

_LARGEST = 1_000_000  # bytes, as gazerig.config.entries reads


class RigLayers(NamedTuple):
    """Requested files of a rig, each a shipped name or a path."""

    name: str
    character: str | None
    profile: str | None


class RigFiles(NamedTuple):
    """Files of a rig, its own first, and their contents when they were read."""

    paths: tuple[Path, ...]
    texts: tuple[bytes, ...]

    @property
    def own_text(self) -> bytes:
        """Text of the rig's own file."""
        return self.texts[0] if self.texts else b""

    def has_changed(self) -> bool:
        """Whether the content of any of them has changed, or cannot be read."""
        try:
            return tuple(read_limited(path, _LARGEST) for path in self.paths) != self.texts
        except OSError:
            return True


def read_all(layers: RigLayers) -> tuple[Rig, RigFiles]:
    """Return a rig and its files.

    Raises:
        gazerig.config.load.ConfigError: see gazerig.config.schema.load_rig.
    """
    paths = tuple(layers_of(*layers))
    texts = _texts(paths)
    return load_rig(*layers), RigFiles(paths, texts)


def refuse_copy(to: str) -> None:
    """Check that a rig can be copied to a path, without opening anything.

    Raises:
        gazerig.config.load.ConfigError: the path exists, or is not that of a YAML file.
    """
    rule = ""
    if os.path.isdir(to):
        rule = "is a directory; name a new .yaml file in it"
    elif os.path.exists(to) and not os.path.isfile(to):
        rule = f"is {kind_of(os.stat(to))}; name a new .yaml file"
    elif not to.endswith((".yaml", ".yml")):
        rule = "a rig's file ends in .yaml; rename it"
    elif os.path.lexists(to):
        rule = "already exists and is not overwritten; choose another name"
    if rule:
        raise ConfigError([ConfigFault(to, None, "", "", rule)])


def save_layers(
    layers: RigLayers, good: bytes, to: str | None, wanted: Mapping[str, Any], now: datetime
) -> tuple[SavedFile, RigFiles]:
    """Write values into a rig's file; character and profile must not override any of them.

    Args:
        layers: The rig's file, and the files merged over it.
        good: Last text of the file without a fault; it replaces a text that has faults now.
        to: A new file for this text and the values; None: the rig's own.
        wanted: Values by dotted key.
        now: Time for the backup's name.

    Returns:
        The written file, and the present files of the rig.

    Raises:
        gazerig.config.load.ConfigError: see gazerig.config.save.save; or ``to`` exists or is not a
            YAML file.
    """
    base = None
    if to is not None:
        refuse_copy(to)
        base, layers = good, layers._replace(name=to)
    else:
        try:
            load_rig(*layers)
        except ConfigError:
            base = good
    check = partial(load_rig, character=layers.character, profile=layers.profile)
    saved = save(rig_file(layers.name), wanted, now, check, Rig, base)
    paths = tuple(layers_of(*layers))
    return saved, RigFiles(paths, _texts(paths))


def _texts(paths: tuple[Path, ...]) -> tuple[bytes, ...]:
    try:
        return tuple(read_limited(path, _LARGEST) for path in paths)
    except OSError:
        return ()  # its faults are reported when it is loaded
