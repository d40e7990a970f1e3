"""Faults of configuration files; a small module, because every command imports it."""

from collections.abc import Iterable
from dataclasses import dataclass

from gazerig.errors import Error


@dataclass(frozen=True, slots=True)
class ConfigFault:
    """One fault of a file.

    line, column: counted from 1, None if the file could not be read
    key: dotted key path, list items counted from 0; value: the text at that position, shortened
    rule: the broken rule and the remedy
    """

    file: str
    line: int | None
    key: str
    value: str
    rule: str
    column: int | None = None

    def __str__(self) -> str:
        """Return ``file:line: key: rule`` on one line, for any content of the key."""
        place = [self.file, *(str(n) for n in (self.line, self.column) if n is not None)]
        words = ": ".join(part for part in (":".join(place), self.key, self.rule) if part)
        return " ".join(words.splitlines())


class ConfigError(Error):
    """An unusable configuration; the message lists every fault, one per line."""

    def __init__(self, faults: Iterable[ConfigFault]) -> None:
        """Store the faults, of which there is at least one."""
        self.faults = tuple(faults)
        super().__init__("\n".join(map(str, self.faults)))
