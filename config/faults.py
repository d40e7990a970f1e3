"""Faults of configuration files; a small module, because every command imports it."""

from collections.abc import Iterable
from dataclasses import dataclass

from gazerig.errors import Error


@dataclass(frozen=True, slots=True)
class ConfigFault:
    """One fault of a file.

    line: counted from 1, None if the file could not be read
    key: dotted key path, list items counted from 0
    rule: the broken rule and the remedy
    """

    file: str
    line: int | None
    key: str
    rule: str

    def __str__(self) -> str:
        """Return ``file:line: key: rule`` on one line, for any content of the key."""
        place = self.file if self.line is None else f"{self.file}:{self.line}"
        return " ".join(": ".join(filter(None, (place, self.key, self.rule))).splitlines())


class ConfigError(Error):
    """An unusable configuration; the message lists every fault, one per line."""

    def __init__(self, faults: Iterable[ConfigFault]) -> None:
        """Store the faults, of which there is at least one."""
        self.faults = tuple(faults)
        super().__init__("\n".join(map(str, self.faults)))
