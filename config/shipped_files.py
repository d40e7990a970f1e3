"""Names of the shipped YAML files; a small module, because every command imports it."""

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
