"""Shipped YAML files, and files in folders; a small module, as every command imports it."""

import os
from collections.abc import Sequence
from pathlib import Path

SHIPPED = Path(__file__).parent
"""Folder with one folder per kind: rigs, profiles, characters ..."""


def shipped_names(kind: str, home: Path | None = None) -> tuple[str, ...]:
    """Return the names of the files of a kind in a folder of kinds, sorted; () without the kind.

    Args:
        kind: Kind of the files.
        home: Folder of kinds, e.g. that of a feature; None: ``SHIPPED``.
    """
    return tuple(sorted(file.stem for file in ((home or SHIPPED) / kind).glob("*.yaml")))


def is_path(name_or_path: str) -> bool:
    """Return whether a file is given by its path: a slash or a YAML ending."""
    return "/" in name_or_path or name_or_path.endswith((".yaml", ".yml"))


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
