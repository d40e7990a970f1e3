"""The names of the YAML files that come with the package; light, as every command imports it."""

from pathlib import Path

SHIPPED = Path(__file__).parent
"""The folder with a folder for each kind: rigs, profiles, characters ..."""


def shipped_names(kind: str, home: Path | None = None) -> tuple[str, ...]:
    """Return the names of the files of a kind in a folder of kinds, sorted; () without the kind.

    Args:
        kind: of the files.
        home: the folder of kinds, such as that of a feature; None: ``SHIPPED``.
    """
    return tuple(sorted(file.stem for file in ((home or SHIPPED) / kind).glob("*.yaml")))
