"""Reading of one YAML file into plain values and their lines, and all faults of its text.

libyaml's parser reads: ten minutes of a track's frames take a second.
"""

import re
from collections.abc import Collection, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from yaml.reader import ReaderError

from gazerig.config.faults import ConfigFault
from gazerig.drivers.files.file_input import read_limited
from gazerig.params import suggestion_text

LARGEST = 400_000  # bytes; a rig has about 12 000
_DEPTH = 40  # levels; a rig has about 5
_VALUES = 2_000_000  # the longest track has about 1 200 000
_SCALARS: tuple[tuple[re.Pattern[str], Any], ...] = (
    (re.compile(r"~|null|Null|NULL|"), lambda text: None),
    (re.compile(r"true|True|TRUE|false|False|FALSE"), lambda text: text.lower() == "true"),
    (re.compile(r"[-+]?[0-9]{1,40}"), int),
    (re.compile(r"0x[0-9a-fA-F]{1,40}|0o[0-7]{1,40}"), lambda text: int(text, 0)),
    (re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?"), float),
)
"""Values without quotes that are not text, as in YAML 1.2: no, on and 12:30 are text."""
_SPACES = "\u00a0\u2007\u202f"
_LOOKALIKES = (
    (r"[-+]?[0-9]+(,)[0-9]+", "a decimal comma", "."),
    (r"([\u2012-\u2015\u2212])[0-9.].*", "a typographic minus", "-"),
    (r"([\u2018-\u201f]).*|.*([\u2018-\u201f])", "a typographic quote", '"'),
    (rf"([{_SPACES}]).*|.*([{_SPACES}])|[0-9]+([{_SPACES}])[0-9].*", "a no-break space", " "),
)
"""Values without quotes as word processors and web pages write them, and what a keyboard has."""


@dataclass(frozen=True, slots=True)
class Document:
    """One YAML file: values as dicts, tuples and scalars, and the line of each dotted key path."""

    file: str
    text: str
    data: dict[str, Any]
    lines: dict[str, int]

    def line(self, key: str) -> int:
        """Return the line of a dotted key path, or of the nearest mapping above it."""
        while key not in self.lines:
            key = key.rpartition(".")[0]
        return self.lines[key]


def read(
    path: Path, faults: list[ConfigFault], known: Collection[str] = (), largest: int = LARGEST
) -> Document | None:
    """Return a file, None if it is unusable; see ``parse``."""
    line = None
    try:
        return parse(str(path), read_limited(path, largest).decode("utf-8-sig"), faults, known)
    except UnicodeDecodeError as error:
        line = error.object.count(b"\n", 0, error.start) + 1
        rule = "is not UTF-8 text; save it as UTF-8"
    except OSError as error:
        absent = isinstance(error, FileNotFoundError) and path.parent.is_dir()
        beside = [one.name for one in path.parent.glob("*.yaml")] if absent else ()
        near = suggestion_text(path.name, beside) or ";"
        rule = f"{error.strerror}{near} name a YAML file that you may read"
    faults.append(ConfigFault(str(path), line, "", rule))
    return None


def parse(
    file: str, text: str, faults: list[ConfigFault], known: Collection[str] = ()
) -> Document | None:
    """Return a file's text as a document, None if it is unusable.

    known: keys of the file's top level. The content of a file with none of them is never shown, as
        any client that may choose a character could otherwise read other files.
    """
    reader = _Reader(file, text)
    try:
        root = reader.read()
    except yaml.YAMLError as error:
        faults.append(_syntax_fault(file, text, error))
        return None
    rule = ""
    if not isinstance(root, dict):
        rule = "is not a mapping; write 'key: value' lines"
    elif known and root.keys().isdisjoint(known):
        rule = f"is not such a configuration: it has none of the keys {', '.join(known)}"
    if rule:
        faults.append(ConfigFault(file, reader.lines.get("", 1), "", rule))
        return None
    faults += reader.faults
    return Document(file, text, root, reader.lines)


def _syntax_fault(file: str, text: str, error: yaml.YAMLError) -> ConfigFault:
    """Return the fault of a text that is not YAML, with its line."""
    if isinstance(error, ReaderError):
        line = text.encode(errors="surrogatepass").count(b"\n", 0, error.position) + 1
        return ConfigFault(file, line, "", f"not valid YAML: {error.reason}; remove it")
    line, words = error.problem_mark.line + 1, error.problem
    cure = "check this line and the one above"
    if error.context:
        words = f"{error.context} from line {error.context_mark.line + 1}, {words}"
    if "start any token" in words:
        cure = "indent with spaces, and put text with %, @ or ` in quotes"
    for number, row in list(enumerate(text.splitlines(), 1))[:line][-2:]:
        if found := re.search(f"[{_SPACES}]", row):
            cure = f"column {found.start() + 1} of line {number} is a no-break space"
    return ConfigFault(file, line, "", f"not valid YAML: {words}; {cure}")


def _line(event: Any) -> int:
    return int(event.start_mark.line) + 1


class _Reader:
    """Builder of a file's values from the events of its text."""

    def __init__(self, file: str, text: str) -> None:
        self._file = file
        self._events = yaml.parse(text.encode(errors="surrogatepass"), Loader=yaml.CSafeLoader)
        self.lines: dict[str, int] = {}
        self.faults: list[ConfigFault] = []

    def read(self) -> Any:
        """Return the value of the only document; None without one."""
        next(self._events)
        if isinstance(next(self._events), yaml.StreamEndEvent):
            return None
        event = next(self._events)
        value = self._value(event, _line(event), "", 0)
        next(self._events)
        if not isinstance(end := next(self._events), yaml.StreamEndEvent):
            raise _refused("a second document; write one", end)
        return value

    def _value(self, event: Any, line: int, key: str, depth: int) -> Any:
        self.lines[key] = line
        start = f"{key}." if key else ""
        if depth > _DEPTH or len(self.lines) > _VALUES:
            raise _refused(f"more than {_DEPTH} levels or {_VALUES} values; shorten it", event)
        if isinstance(event, yaml.AliasEvent) or event.tag:
            raise _refused(
                "an alias (*) or tag (!), which is not supported; write the value", event
            )
        if isinstance(event, yaml.SequenceStartEvent):
            items = enumerate(self._below())
            return tuple(
                [self._value(one, _line(one), f"{start}{i}", depth + 1) for i, one in items]
            )
        if isinstance(event, yaml.MappingStartEvent):
            return self._mapping(start, depth + 1)
        if not event.implicit[0]:
            return event.value
        for pattern, convert in _SCALARS:
            if pattern.fullmatch(event.value):
                return convert(event.value)
        return self._text(event, line, key)

    def _text(self, event: Any, line: int, key: str) -> str | float:
        """Return a text without quotes; of a lookalike, which is a fault, what was meant."""
        text: str = event.value
        for pattern, name, right in _LOOKALIKES:
            if found := re.fullmatch(pattern, text):
                at = found.start(found.lastindex or 0)
                column = event.start_mark.column + at + 1
                rule = f"column {column} is {name} ({text[at]}); write {right!r}"
                self.faults.append(ConfigFault(self._file, line, key, rule))
                text = text.replace(text[at], right).strip(' "')
                with suppress(ValueError):
                    return float(text)
        return text

    def _mapping(self, start: str, depth: int) -> dict[str, Any]:
        """Return the rest of a mapping; each value has the line of its key."""
        values: dict[str, Any] = {}
        for event in self._below():
            if not isinstance(event, yaml.ScalarEvent):
                raise _refused("a key is text", event)
            name, key = event.value, f"{start}{event.value}"
            if name in values:
                rule = f"duplicate key, first in line {self.lines[key]}"
                self.faults.append(ConfigFault(self._file, _line(event), key, rule))
            values[name] = self._value(next(self._events), _line(event), key, depth)
        return values

    def _below(self) -> Iterator[Any]:
        """Yield the first event of each item of a mapping or list."""
        while not isinstance(event := next(self._events), yaml.CollectionEndEvent):
            yield event


def _refused(problem: str, event: Any) -> yaml.YAMLError:
    return yaml.MarkedYAMLError(problem=problem, problem_mark=event.start_mark)
