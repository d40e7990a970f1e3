"""Fault commands as lines of text: ``lose 3 count 2``, ``unplug for 0.5``, ``help``.

The grammar of every emulated device is a table of verbs. Each verb parses its arguments and calls
a method of the device's faults.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

ALL_DEVICES = ("all", "*")
BOTH = ("count", "for")
TIME = ("for",)


class Argument(NamedTuple):
    """One word of a command: its name in the help, and its parser."""

    label: str
    read: Callable[[str], Any]
    optional: bool = False


class Verb(NamedTuple):
    """One command. duration_words: it may end with ``count N`` and ``for S``."""

    action: Callable[..., str]
    arguments: tuple[Argument, ...]
    description: str
    duration_words: tuple[str, ...] = ()


class CommandTable(NamedTuple):
    """All fault commands of one kind of device.

    ids: meaning of the word ID, e.g. "a servo's id"
    """

    verbs: Mapping[str, Verb]
    ids: str

    def obey(self, faults: object, text: str) -> str:
        """Run one command; return a description of the effect.

        Raises:
            ValueError: the command is invalid; the message names the wrong word and valid ones.
        """
        arguments = text.split()
        if not arguments or arguments[0] == "help":
            return self.help(arguments[1] if len(arguments) > 1 else None)
        name, rest = arguments[0].replace("_", "-"), arguments[1:]
        verb = self.verbs.get(name)
        if verb is None:
            raise ValueError(
                f"{arguments[0]!r} is not a command; commands: {', '.join(self.verbs)}, help"
            )
        try:
            left, found = list(rest), dict[str, Any]()
            while len(left) >= 2 and left[-2] in BOTH:
                value, word = left.pop(), left.pop()
                if word not in verb.duration_words:
                    raise ValueError(f"{word!r} is not expected here")
                if word == "count":
                    found["count"] = count(value)
                else:
                    found["seconds"] = number_parser(0.0, 1e6, "seconds")(value)
            rest, lasting = left, found
            return verb.action(faults, *_arguments(verb, rest), **lasting)
        except (KeyError, ValueError) as error:
            raise ValueError(f"{name}: {error.args[0]}; usage: {self.usage(name)}") from None

    def usage(self, name: str) -> str:
        """Return the syntax of a command."""
        verb = self.verbs[name]
        shown = [f"[{w.label}]" if w.optional else w.label for w in verb.arguments]
        ends = {"count": "[count N]", "for": "[for SECONDS]"}
        return " ".join([name, *shown, *(ends[word] for word in verb.duration_words)])

    def help(self, name: str | None = None) -> str:
        """Describe one command or all of them, one per line."""
        if name is not None and name in self.verbs:
            return f"{self.usage(name)}: {self.verbs[name].description}"
        lines = [f"{self.usage(verb):46} {self.verbs[verb].description}" for verb in self.verbs]
        lines.append(f"ID is {self.ids} or all; a fault lasts until clear, or as given by [..]")
        return "\n".join(lines)


def _arguments(verb: Verb, arguments: Sequence[str]) -> list[Any]:
    needed = [word for word in verb.arguments if not word.optional]
    if len(arguments) < len(needed):
        raise ValueError(f"{needed[len(arguments)].label} is missing")
    if len(arguments) > len(verb.arguments):
        raise ValueError(f"{arguments[len(verb.arguments)]!r} is one argument too many")
    return [word.read(text) for word, text in zip(verb.arguments, arguments, strict=False)]


# --- words


def number_parser(low: float, high: float, what: str) -> Callable[[str], float]:
    """Return a parser of numbers; ``what`` and the range are part of its error message."""

    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if not low <= value <= high:
            raise ValueError(f"{text!r} is not {what} from {low:g} to {high:g}")
        return value

    return read


def integer_parser(low: int, high: int, what: str) -> Callable[[str], int]:
    """Return a parser of integers, also written as 0x1F."""

    def read(text: str) -> int:
        try:
            value = int(text, 0)
        except ValueError:
            value = low - 1
        if not low <= value <= high:
            raise ValueError(f"{text!r} is not {what} from {low} to {high}")
        return value

    return read


def id_or_all(read: Callable[[str], int]) -> Callable[[str], int | None]:
    """Return a parser of ids that also accepts ``all``, which is None."""
    return lambda text: None if text in ALL_DEVICES else read(text)


def word_choice(*values: str) -> Callable[[str], str]:
    """Return a parser of words from a short list."""

    def read(text: str) -> str:
        if text not in values:
            two = len(values) == 2
            listed = f"neither {' nor '.join(values)}" if two else f"none of {', '.join(values)}"
            raise ValueError(f"{text!r} is {listed}")
        return text

    return read


def on_off(text: str) -> bool:
    """Parse on or off."""
    return word_choice("on", "off")(text) == "on"


def any_word(text: str) -> str:
    """Return a word unchanged."""
    return text


count = integer_parser(1, 1_000_000, "a number of answers")

MS = Argument("MS", number_parser(0.0, 60_000.0, "milliseconds"))
SWITCH = Argument("on|off", on_off, True)
