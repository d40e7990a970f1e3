"""Fault commands as lines of text: ``lose 3 count 2``, ``unplug for 0.5``, ``help``.

The grammar of every emulated device is a table of verbs. The name of an argument decides what it
may be.
"""

from collections.abc import Callable, Collection, Mapping
from typing import Any, NamedTuple

BOTH, TIME = "count for", "for"
_ENDS = {"count": ("count", "N"), "for": ("seconds", "SECONDS")}
_WHOLE = ("ID", "BYTES", "BIT", "N")
_RANGES: dict[str, tuple[float, float]] = {
    "BYTES": (0, 1024), "BIT": (0, 8191), "N": (1, 1_000_000), "SECONDS": (0.0, 1e6),
    "MS": (0.0, 60_000.0), "PERCENT": (0.0, 100.0), "V": (0.0, 25.0), "C": (0.0, 200.0),
    "STEPS": (-1e6, 1e6), "NEWTONS": (0.0, 100.0),
}  # fmt: skip


class Verb(NamedTuple):
    """One command.

    words: names of its arguments, optional ones in brackets
    lasting: further ends of it, ``count for``: it may end with ``count N`` and ``for SECONDS``
    """

    action: Callable[..., str]
    words: str = ""
    lasting: str = ""


class CommandTable(NamedTuple):
    """All fault commands of one kind of device."""

    verbs: Mapping[str, Verb]
    highest_id: int = 0

    def obey(self, faults: object, text: str) -> str:
        """Run one command; return a description of the effect.

        Raises:
            ValueError: the command is invalid; the message names the wrong word and valid ones.
        """
        name, *words = text.split() or ["help"]
        if name == "help":
            return "\n".join(map(self.usage, self.verbs))
        verb, ends = self.verbs.get(name), dict[str, Any]()
        if verb is None:
            raise ValueError(f"{name!r} is not a command; commands: {', '.join(self.verbs)}, help")
        try:
            while len(words) > 1 and words[-2] in verb.lasting.split():
                end, label = _ENDS[words[-2]]
                ends[end] = self._read(label, words[-1])
                del words[-2:]
            labels = verb.words.split()
            if len(words) > len(labels):
                raise ValueError(f"{words[len(labels)]!r} is not expected here")
            missing = [label for label in labels[len(words) :] if label[0] != "["]
            if missing:
                raise ValueError(f"{missing[0]} is missing")
            values = map(self._read, labels, words)
            return verb.action(faults, *values, **ends)
        except (KeyError, ValueError) as error:
            raise ValueError(f"{name}: {error.args[0]}; usage: {self.usage(name)}") from None

    def _read(self, label: str, text: str) -> Any:
        """Return the value of one word; None for all ids."""
        label = label.strip("[]")
        if label == "ID" and text == "all":
            return None
        low, high = (0, self.highest_id) if label == "ID" else _RANGES.get(label, (None, None))
        if low is None or high is None:
            return text
        try:
            value = int(text, 0) if label in _WHOLE else float(text)
        except ValueError:
            value = float("nan")
        if not low <= value <= high:
            raise ValueError(f"{text!r} is not {label} from {low:g} to {high:g}")
        return value

    def usage(self, name: str) -> str:
        """Return the syntax of a command."""
        verb = self.verbs[name]
        ends = [f"[{word} {_ENDS[word][1]}]" for word in verb.lasting.split()]
        return " ".join([name, *verb.words.split(), *ends])


def bus_and_command(text: str, buses: Collection[str]) -> tuple[str, str]:
    """Return the name of the bus and the command of ``BUS: COMMAND``; without a name the bus "".

    Raises:
        ValueError: no bus has that name; the message lists the names.
    """
    name, _, command = text.partition(":")
    if command and name in buses:
        return name, command.strip()
    if "" not in buses:
        names = ", ".join(buses)
        raise ValueError(f"name the bus first ({names}): {next(iter(buses))}: {text}")
    return "", text
