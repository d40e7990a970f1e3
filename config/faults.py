"""Faults of configuration files; light, as every command imports it."""

from collections.abc import Iterable
from dataclasses import dataclass

from gazerig.errors import Error


@dataclass(frozen=True, slots=True)
class ConfigFault:
    """One thing to change in a file.

    line, column: from 1, None if the file could not be read
    key: dotted key path, list items counted from 0; value: the text there, shortened
    rule: what is wrong, and the remedy
    """

    file: str
    line: int | None
    key: str
    value: str
    rule: str
    column: int | None = None

    def __str__(self) -> str:
        """Return ``file:line: key: rule`` on one line, whatever the key holds."""
        place = [self.file, *(str(n) for n in (self.line, self.column) if n is not None)]
        words = ": ".join(part for part in (":".join(place), self.key, self.rule) if part)
        return " ".join(words.splitlines())


class ConfigError(Error):
    """An unusable configuration; the message lists every fault, one a line."""

    def __init__(self, faults: Iterable[ConfigFault]) -> None:
        """Keep the faults; there is at least one."""
        self.faults = tuple(faults)
        super().__init__("\n".join(map(str, self.faults)))
