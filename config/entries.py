"""Reading of one YAML file into entries with line numbers, and all faults of its text."""

import re
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import lru_cache
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode
from ruamel.yaml.reader import ReaderError

from gazerig.config.faults import ConfigFault
from gazerig.config.validation import Step, abbreviate, suggestion_text
from gazerig.drivers.files.file_input import FileTooLarge, NotRegularFile, read_limited

Scalar = str | int | float | bool | None

_DEPTH = 40  # levels; a rig has about 5, a recursive file would never end
_VALUES = 20_000  # nested aliases would grow without limit
_LARGEST = 400_000  # bytes; a rig has about 34 000, and more would be parsed for seconds
_QUOTED = re.compile(r" *('[^']*'|\"[^\"]*\")")  # text quoted in a parser's message


@dataclass(frozen=True, slots=True)
class Entry:
    """A value with its file and line; mappings and lists contain entries."""

    value: "Scalar | dict[str, Entry] | tuple[Entry, ...]"
    file: str
    line: int

    def to_plain(self) -> Any:
        """Return the value as dicts, tuples and scalars."""
        if isinstance(self.value, dict):
            return {key: entry.to_plain() for key, entry in self.value.items()}
        if isinstance(self.value, tuple):
            return tuple(entry.to_plain() for entry in self.value)
        return self.value

    def nearest(self, path: Sequence[Step]) -> "Entry":
        """Return the entry at a path, or the deepest existing entry above it.

        A key of a file may itself be a dotted path, e.g. in a study's parameters.
        """
        entry, at = self, 0
        while at < len(path):
            held, steps = entry._find_below(path[at:])
            if held is None:
                break
            entry, at = held, at + steps
        return entry

    def _find_below(self, path: Sequence[Step]) -> "tuple[Entry | None, int]":
        """Return the entry at the first steps of a path, and the number of these steps."""
        if isinstance(self.value, dict):
            for steps in range(1, len(path) + 1):
                key = ".".join(map(str, path[:steps]))
                if key in self.value:
                    return self.value[key], steps
        if isinstance(self.value, tuple) and str(path[0]).isdecimal():
            return dict(enumerate(self.value)).get(int(path[0])), 1
        return None, 0


def read(
    path: Path, faults: list[ConfigFault], known: Collection[str] = ()
) -> tuple[str, Entry | None]:
    """Return a file's text and its top entry, None if the file is unusable.

    known: keys of the file's top level. The content of a file with none of them is never shown, as
        any client that may choose a character could otherwise read other files.
    """
    file, text = str(path), ""
    try:
        text = read_limited(path, _LARGEST).decode("utf-8-sig")
    except OSError as error:
        faults.append(ConfigFault(file, None, "", "", _read_error(path, error)))
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        rule = f"is not UTF-8 text (byte 0x{error.object[error.start]:02x}); save it as UTF-8"
        faults.append(ConfigFault(file, line, "", "", rule))
    else:
        return text, parse(file, text, faults, known)
    return text, None


def parse(
    file: str, text: str, faults: list[ConfigFault], known: Collection[str] = ()
) -> Entry | None:
    """Return the top entry of a file's text, None if it is unusable; see ``read``."""
    try:
        node = _compose(text)
    except RecursionError:
        faults.append(ConfigFault(file, None, "", "", _TOO_DEEP))
        return None
    except (YAMLError, ValueError, ArithmeticError, LookupError) as error:
        # ruamel also raises these: characters above U+10FFFF, "%YAML 9.9".
        faults.append(_syntax_fault(file, text, error))
        return None
    if not isinstance(node, MappingNode):
        rule = "is empty" if node is None else "the top level is not a mapping"
        line = 1 if node is None else _line(node)
        faults.append(ConfigFault(file, line, "", "", f"{rule}; write 'key: value' lines"))
        return None
    keys = [key.value for key, _ in node.value[:1000] if isinstance(key, ScalarNode)]
    # A key may be misspelt.
    if known and not any(k in known or get_close_matches(k[:60], known, 1) for k in keys):
        rule = f"is not such a configuration: it has none of the keys {', '.join(known)}"
        faults.append(ConfigFault(file, _line(node), "", "", rule))
        return None
    return _Reader(file, faults).read_top(node)


@lru_cache(maxsize=64)
def _compose(text: str) -> Node | None:
    """Return YAML parsed to nodes, which have line numbers and are never modified.

    The parser takes nearly all the time of loading, and tuning, saving and checking a rig load the
    same layers again.
    """
    yaml = YAML(typ="safe", pure=True)
    yaml.max_depth = _DEPTH
    yaml.composer.warn_double_anchors = False  # YAML 1.2 allows an anchor to be redefined
    node: Node | None = yaml.compose(text)
    return node


def _read_error(path: Path, error: OSError) -> str:
    """Return the reason why a file cannot be opened, and the remedy."""
    match error:
        case FileNotFoundError():
            beside = [p.name for p in path.parent.glob("*.yaml")] if path.parent.is_dir() else []
            return f"no such file{suggestion_text(path.name, beside) or ';'} check the name"
        case IsADirectoryError():
            return "is a directory; name a file in it"
        case PermissionError():
            return "cannot be read: permission denied; allow it with chmod u+r"
    if isinstance(error, NotRegularFile | FileTooLarge):
        return f"{error.strerror}; name a YAML file"
    return f"cannot be read ({error.strerror}); check the path"


def _syntax_fault(file: str, text: str, error: Exception) -> ConfigFault:
    """Return the fault of a text that is not YAML, with its position."""
    if isinstance(error, ReaderError):
        before = text[: error.position]
        column = len(before) - before.rfind("\n")
        code = f"U+{ord(text[error.position]):04X}"
        rule = f"not valid YAML: character {code} is not allowed; remove it"
        return ConfigFault(file, before.count("\n") + 1, "", "", rule, column)
    if not isinstance(error, MarkedYAMLError) or error.problem_mark is None:
        words = _remove_quotes(" ".join(str(error).split()))
        return ConfigFault(file, None, "", "", f"not valid YAML: {words}")
    mark = error.problem_mark
    words = _remove_quotes(", ".join(filter(None, (error.context, error.problem))))
    if "max_depth" in words:
        return ConfigFault(file, mark.line + 1, "", "", _TOO_DEEP, mark.column + 1)
    cure = "; indent with spaces" if "'\\t'" in words else "; check this line and the one above"
    return ConfigFault(
        file, mark.line + 1, "", "", f"not valid YAML: {words}{cure}", mark.column + 1
    )


def _remove_quotes(words: str) -> str:
    """Remove quoted file content from a parser's message."""
    kept = ("' '", "'\\t'")  # one character, or the parser's own name of a token
    return _QUOTED.sub(
        lambda m: m[0] if len(m[1]) == 3 or m[1] in kept or m[1][1] == "<" else "", words
    )


_TAG = "tag:yaml.org,2002:"
_TOO_DEEP = f"nested deeper than {_DEPTH} levels, or recursive; reduce the nesting"
_TOO_MANY = f"contains more than {_VALUES} values; shorten it"


def _line(node: Node) -> int:
    """Return a node's line, from 1."""
    return int(node.start_mark.line) + 1


class _Reader:
    """Converter from the nodes of one file to entries, which records unsupported content."""

    def __init__(self, file: str, faults: list[ConfigFault]) -> None:
        """Set the file, and the list that receives its faults."""
        self._file = file
        self._faults = faults
        self._values = 0

    def read_top(self, node: MappingNode) -> Entry | None:
        """Return the top node as an entry, None if it is too deep, too large or not a mapping."""
        try:
            root = self._entry(node, _line(node), ())
        except _TooLarge as fault:
            self._note(fault.line, (), str(fault))
            return None
        return root if isinstance(root.value, dict) else None

    def _entry(self, node: Node, line: int, path: tuple[Step, ...]) -> Entry:
        """Return a node as an entry."""
        self._values += 1
        if len(path) > _DEPTH or self._values > _VALUES:
            raise _TooLarge(line, _TOO_DEEP if len(path) > _DEPTH else _TOO_MANY)
        tag = str(node.tag).removeprefix(_TAG)
        value: Any = None
        if tag == "map" and isinstance(node, MappingNode):
            value = self._mapping(node, path)
        elif tag == "seq" and isinstance(node, SequenceNode):
            value = tuple(self._entry(n, _line(n), (*path, i)) for i, n in enumerate(node.value))
        elif tag in _SCALARS and isinstance(node, ScalarNode):
            value = _SCALARS[tag](node.value)
        else:
            self._note(line, path, f"the tag {node.tag} is not supported; remove it")
        return Entry(value, self._file, line)

    def _mapping(self, node: Node, path: tuple[Step, ...]) -> dict[str, Entry]:
        """Return the entries of a mapping, each with the line of its key."""
        entries: dict[str, Entry] = {}
        for key, value in node.value:
            line, name = _line(key), key.value
            if str(key.tag) == f"{_TAG}merge":
                rule = "merge keys (<<) are not supported; write the keys in full"
                self._note(line, path, rule)
            elif str(key.tag) != f"{_TAG}str":
                shown = abbreviate(name) if isinstance(key, ScalarNode) else "this"
                self._note(line, path, f"key {shown} is not text; put it in quotes")
            elif name in entries:
                first = entries[name].line
                self._note(line, (*path, name), f"duplicate key, first in line {first}")
            else:
                entries[name] = self._entry(value, line, (*path, name))
        return entries

    def _note(self, line: int, path: tuple[Step, ...], rule: str) -> None:
        """Record a fault."""
        self._faults.append(ConfigFault(self._file, line, ".".join(map(str, path)), "", rule))


class _TooLarge(ValueError):
    """The text stands for more than any configuration."""

    def __init__(self, line: int, rule: str) -> None:
        super().__init__(rule)
        self.line = line


def _parse_integer(text: str) -> int | str:
    """Return an integer of YAML 1.2 (decimal, 0o, 0x); one of 40 digits or more stays text."""
    digits = text.replace("_", "")
    for base in (0, 10):  # 10: "007" is 7
        try:
            return int(digits, base) if len(digits) < 40 else text
        except ValueError:
            continue
    return text


def _parse_float(text: str) -> float | str:
    """Return a float of YAML 1.2, including .inf and .nan."""
    try:
        return float(text.replace("_", "").lower().replace(".inf", "inf").replace(".nan", "nan"))
    except ValueError:
        return text


_SCALARS: dict[str, Callable[[str], Scalar]] = {
    "null": lambda text: None,
    "bool": lambda text: text.lower() in ("true", "yes", "on", "y"),
    "int": _parse_integer,
    "float": _parse_float,
    "str": str,
    "timestamp": str,  # 2026-01-31 is text in YAML 1.2
    "value": str,
}
