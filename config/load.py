"""YAML files in layers to frozen values; one message lists every fault of every layer.

A rig is read in layers; later layers override earlier ones. Each value has its file and line, so
that a fault found after merging the layers, or by a rule between two sections, still names the line
to change.
"""

import contextlib
import unicodedata
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import MISSING, asdict, dataclass, replace
from pathlib import Path
from typing import Any, TypeVar, cast

from gazerig.config.entries import Entry as Entry
from gazerig.config.entries import read
from gazerig.config.faults import ConfigError as ConfigError
from gazerig.config.faults import ConfigFault as ConfigFault
from gazerig.config.plugin_sections import put_plugins, take_plugins
from gazerig.config.rig import Rig
from gazerig.config.shipped_files import SHIPPED
from gazerig.config.shipped_files import shipped_names as shipped_names
from gazerig.config.validation import (
    Step,
    Violation,
    abbreviate,
    fill,
    suggestion_text,
    validate,
)
from gazerig.drivers.errors import PluginError
from gazerig.drivers.plugins import RIGS, TRACKS, yaml_files
from gazerig.params import Declaration, declarations

T = TypeVar("T")
_GROUPS = {"rigs": RIGS, "tracks": TRACKS}
"""Kinds of files that packages can provide too."""


RIGS_FOLDER, TRACKS_FOLDER = SHIPPED / "rigs", SHIPPED / "tracks"
"""Folders that this package registers in the groups of rigs and tracks."""


_FILES_BESIDE, _MESHES = "track_files", "meshes"
"""Keys of a rig with file paths, relative to the folder of the file that contains them."""
_LONGEST_TEXT = 400  # characters; names and paths
_UNPRINTABLE = ("Cc", "Cs", "Zl", "Zp")
"""Categories of Unicode: control characters, surrogates and line ends."""
_TURNS = (
    "\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069"  # directional formatting characters
)
Check = Callable[[T], Iterable[tuple[str, str]]]
"""Returns (dotted key path, broken rule) for rules between several fields."""


@dataclass(frozen=True, slots=True)
class Document:
    """One parsed YAML file: plain values, the text with its comments, and every line."""

    file: Path
    text: str
    root: Entry

    @property
    def data(self) -> dict[str, Any]:
        """Return the values as dicts, tuples and scalars."""
        return dict(self.root.to_plain())

    def line(self, key: str) -> int:
        """Return the line of a dotted key path, or of the nearest mapping above it."""
        return self.root.nearest(_steps(key)).line


def load(
    path: Path,
    into: type[T],
    *,
    defaults: Sequence[Path] = (),
    checks: Sequence[Check[T]] = (),
) -> T:
    """Return the frozen dataclass of ``path`` merged over ``defaults`` (the first is the lowest).

    Checks receive the whole value. If fields are faulty, a finding is listed only if it is true for
    any correct values of these fields.

    Raises:
        ConfigError: lists every fault of every file.
    """
    files = (*defaults, path)
    faults: list[ConfigFault] = []
    known = tuple(declarations(cast(Any, into)))
    layers = [read(file, faults, known)[1] for file in files]
    whole = [_resolve_paths(layer) for layer in layers if layer is not None]
    if len(whole) < len(files):  # the content of a missing layer is unknown
        raise ConfigError(faults)
    root = whole[0]
    for layer in whole[1:]:
        root = _merge(root, layer, cast(Any, into))
    outcome = validate_entries(into, root, checks)
    value, found = outcome
    faults += found
    if faults or value is None:
        order = [str(file) for file in files]
        raise ConfigError(sorted(faults, key=lambda f: (order.index(f.file), f.line or 0)))
    return value


def validate_entries(
    into: type[T], root: Entry, checks: Sequence[Check[T]] = ()
) -> tuple[T | None, list[ConfigFault]]:
    """Return the frozen dataclass of merged entries, None if impossible, and every fault.

    Findings of checks are faults too, so a valid dataclass may have faults.
    """
    outcome = validate_rules(into, root.to_plain(), checks)
    value, found = outcome
    return value, [_to_fault(root, one) for one in found]


def validate_rules(
    into: type[T], data: dict[str, Any], checks: Sequence[Check[T]]
) -> tuple[T | None, list[Violation]]:
    """Return the frozen dataclass of plain values, None if impossible, and every violation.

    If fields are faulty, each check finds what it can before it reads one of them.
    """
    if strange := list(_strange_texts(data, ())):
        return None, strange
    given = data
    data, plugins, found = take_plugins(data) if issubclass(into, Rig) else (data, [], [])
    valid, errors = validate(into, data)
    found += errors
    if valid is not None and not found:
        value = put_plugins(valid, plugins)
        return value, [_contradiction(given, *one) for check in checks for one in check(value)]
    faulty = {path for one in found for path in (one.path, one.meant) if path}
    partial = fill(Declaration("params", params=into), data, {*faulty, *(p.key for p in plugins)})
    for check in checks:
        with contextlib.suppress(ArithmeticError, AttributeError, LookupError, TypeError):
            for key, rule in check(partial):
                steps = _steps(key)
                if not any(steps[: len(path)] == tuple(map(str, path)) for path in faulty):
                    found.append(_contradiction(given, key, rule))
    return None, found


def _strange_texts(value: Any, path: tuple[Step, ...]) -> Iterator[Violation]:
    """Find texts that cannot be displayed, written to a file or distinguished from others."""
    for text in (value, *path[-1:]):
        if isinstance(text, str) and (rule := _strange_text(text)):
            yield Violation(path, "", rule)
    if isinstance(value, dict | tuple):
        for step, inner in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _strange_texts(inner, (*path, step))


def _strange_text(text: str) -> str:
    """Return why a text is not accepted, "" if it is."""
    if len(text) > _LONGEST_TEXT:
        return f"is longer than {_LONGEST_TEXT} characters; shorten it"
    if not text.isascii() or not text.isprintable():
        for char in text:
            if unicodedata.category(char) in _UNPRINTABLE or char in _TURNS:
                return f"contains U+{ord(char):04X}, which cannot be shown; remove it"
    return ""


def read_yaml(path: Path, known: Collection[str] = ()) -> Document:
    """Return one YAML 1.2 file whose top level is a mapping.

    known: keys of the top level; a file with none of them is rejected and its content is not shown

    Raises:
        ConfigError: unreadable, not UTF-8, not YAML, empty, duplicate keys, or not a mapping.
    """
    faults: list[ConfigFault] = []
    text, root = read(path, faults, known)
    if faults or root is None:
        raise ConfigError(faults)
    return Document(path, text, root)


def shipped_path(kind: str, name: str, home: Path | None = None) -> Path:
    """Return the path of a shipped file, e.g. ``shipped("rigs", "desk")``.

    Args:
        kind: Kind of the file.
        name: Name of the file, without its extension.
        home: Folder of kinds, e.g. that of a feature; None: ``SHIPPED``.

    Raises:
        ConfigError: no file has this name; lists the existing names.
    """
    names = shipped_names(kind, home)
    if name in names:
        return (home or SHIPPED) / kind / f"{name}.yaml"
    if kind in _GROUPS:
        return package_file_path(kind, name)
    raise _unknown(kind, name, names)


def package_file_path(kind: str, name: str) -> Path:
    """Return the path of a rig or track file of another package.

    Raises:
        ConfigError: no package has a file of this name, or a package cannot be imported.
    """
    try:
        files = yaml_files(_GROUPS[kind])
    except PluginError as error:
        raise ConfigError(
            [ConfigFault(f"config/{kind}", None, "", repr(name), str(error))]
        ) from error
    if name in files:
        return files[name][0]
    raise _unknown(kind, name, (*shipped_names(kind), *files))


def _unknown(kind: str, name: str, names: Sequence[str]) -> ConfigError:
    known = f"available: {', '.join(names)}" if names else "there are none of this kind"
    rule = f"nothing named {name!r} is shipped{suggestion_text(name, names) or ';'} {known}"
    return ConfigError([ConfigFault(f"config/{kind}", None, "", repr(name), rule)])


def _steps(key: str) -> tuple[str, ...]:
    """Return the steps of a dotted key path."""
    return tuple(key.split(".")) if key else ()


def _resolve_paths(layer: Entry) -> Entry:
    """Return a file's entries with its relative file paths made relative to the working folder."""
    if not isinstance(layer.value, dict):
        return layer
    folder, found = Path(layer.file).parent, dict(layer.value)
    tracks = found.get(_FILES_BESIDE)
    if tracks is not None and isinstance(tracks.value, tuple):
        paths = tuple(
            replace(one, value=str(folder / str(one.value))) if _is_relative(one.value) else one
            for one in tracks.value
        )
        found[_FILES_BESIDE] = replace(tracks, value=paths)
    meshes = found.get(_MESHES)
    if meshes is not None and isinstance(meshes.value, dict):
        beside = {name: _relative_mesh(one, folder) for name, one in meshes.value.items()}
        found[_MESHES] = replace(meshes, value=beside)
    return replace(layer, value=found)


def _relative_mesh(mesh: Entry, folder: Path) -> Entry:
    """Return the entry of a mesh with its file relative to the working folder."""
    file = mesh.value.get("file") if isinstance(mesh.value, dict) else None
    if file is None or not isinstance(file.value, str) or file.value.startswith("~"):
        return mesh
    assert isinstance(mesh.value, dict)
    return replace(
        mesh, value={**mesh.value, "file": replace(file, value=str(folder / file.value))}
    )


def _is_relative(value: object) -> bool:
    """Return whether it is a relative path; a name alone selects a file of a package."""
    path = isinstance(value, str) and ("/" in value or value.endswith((".yaml", ".yml")))
    return path and not str(value).startswith("~")


def _merge(low: Entry, high: Entry, into: type | None = None) -> Entry:
    """Return one entry merged over another; a mapping keeps the line of the lowest file.

    into: the dataclass of both entries; if ``low`` has no mapping, ``high`` is merged over the
        default one, so that a character can change one of the default rules
    """
    if not (isinstance(low.value, dict) and isinstance(high.value, dict)):
        return high
    over = dict(low.value)
    declared = declarations(into) if into is not None else {}
    for key, entry in high.value.items():
        params = declared[key].params if key in declared else None
        below = low.value.get(key)
        if below is None and into is not None and key in declared:
            below = _default_mapping(into, key, declared[key], entry)
        over[key] = entry if below is None else _merge(below, entry, params)
    return Entry(over, low.file, low.line)


def _default_mapping(into: type, key: str, declared: Declaration, above: Entry) -> Entry | None:
    """Return the default at a key of a dataclass if it is a mapping, otherwise None."""
    if declared.params is not None:
        return Entry({}, above.file, above.line)
    if declared.inner is None or declared.inner.params is None:
        return None
    made = cast(Any, into).__dataclass_fields__[key].default_factory
    values = made() if made is not MISSING else {}
    entries = {name: entries_at(asdict(value), above) for name, value in values.items()}
    return Entry(entries, above.file, above.line)


def entries_at(value: Any, at: Entry) -> Entry:
    """Return plain values as entries with the file and line of another entry."""
    if isinstance(value, dict):
        value = {key: entries_at(one, at) for key, one in value.items()}
    elif isinstance(value, tuple):
        value = tuple(entries_at(one, at) for one in value)
    return Entry(value, at.file, at.line)


def _to_fault(root: Entry, violation: Violation) -> ConfigFault:
    """Return a violation as a fault with its file and line."""
    entry = root.nearest(violation.path)
    key = ".".join(map(str, violation.path))
    return ConfigFault(entry.file, entry.line, key, violation.value, violation.rule)


def _contradiction(data: Any, key: str, rule: str) -> Violation:
    """Return a finding of a check as a violation."""
    for step in _steps(key):
        if isinstance(data, dict):
            data = data.get(step, data)
    return Violation(_steps(key), "" if isinstance(data, dict | tuple) else abbreviate(data), rule)
