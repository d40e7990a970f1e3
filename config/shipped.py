"""The names of the YAML files that come with the package; light, as every command imports it."""

from pathlib import Path

SHIPPED = Path(__file__).parent
"""The folder with a folder for each kind: rigs, profiles, characters ..."""


def shipped_names(kind: str) -> tuple[str, ...]:
    """Return the names of the files of a kind, sorted; none where there is no such kind."""
    return tuple(sorted(file.stem for file in (SHIPPED / kind).glob("*.yaml")))
