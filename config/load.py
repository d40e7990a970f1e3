"""YAML files in layers to frozen values, with every fault of every layer in one message.

A rig is read in layers, the later over the earlier. Each value remembers the file and
line it came from, so that a fault found after the layers were merged, or by a rule
between two sections, still names the line to change.
"""

import contextlib
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import MISSING, asdict, dataclass, replace
from pathlib import Path
from typing import Any, TypeVar, cast

from gazerig.config.bounds import Shape, Step, fill_stand_ins, shapes_of, validate
from gazerig.config.entries import Entry as Entry
from gazerig.config.entries import read
from gazerig.config.export import Violation, abbreviate, suggestion_text, violation
from gazerig.config.faults import ConfigError as ConfigError
from gazerig.config.faults import ConfigFault as ConfigFault
from gazerig.config.plugin_sections import extend_type
from gazerig.config.shipped_files import SHIPPED
from gazerig.config.shipped_files import shipped_names as shipped_names
from gazerig.drivers.errors import PluginError
from gazerig.drivers.plugins import GESTURES, RIGS, yaml_files

T = TypeVar("T")
_GROUPS = {"rigs": RIGS, "gestures": GESTURES}
"""Kinds of files that packages bring too."""


RIGS_FOLDER, GESTURES_FOLDER = SHIPPED / "rigs", SHIPPED / "gestures"
"""What this package registers in the groups of rigs and gestures."""


_FILES_BESIDE, _MESHES = "gesture_files", "meshes"
"""Keys of a rig with paths of files, relative to the folder of the file that names them."""
Check = Callable[[T], Iterable[tuple[str, str]]]
"""Returns (dotted key path, broken rule) for rules between several fields."""


@dataclass(frozen=True, slots=True)
class Document:
    """One YAML file as read: plain values, the text with its comments, and every line."""

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
    """Return the frozen dataclass that ``path`` over its ``defaults`` (the earliest lowest) makes.

    Checks get the whole value; if fields are at fault, what they find
    is listed if it holds whatever right values take their place.

    Raises:
        ConfigError: with every fault of every file.
    """
    files = (*defaults, path)
    faults: list[ConfigFault] = []
    known = tuple(shapes_of(cast(Any, into)))
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
    into: type[T], root: Entry, checks: Sequence[Callable[[T], Iterable[tuple[str, str]]]] = ()
) -> tuple[T | None, list[ConfigFault]]:
    """Return the frozen dataclass that merged entries make, None where impossible, and every fault.

    Findings of checks are faults too, so a value may come with some.
    """
    into, problems = extend_type(into, root.to_plain())
    if problems:
        return None, [_to_fault(root, _contradiction(root, *one)) for one in problems]
    value, errors = validate(into, root.to_plain())
    complaints = [violation(into, error) for error in errors]
    if value is not None:
        complaints += [_contradiction(root, *found) for c in checks for found in c(value)]
    else:
        wrong = {error["loc"] for error in errors if error["type"] != "value_error"}
        complaints += [
            _contradiction(root, *found) for found in _certain_findings(root, into, wrong, checks)
        ]
    return value, [_to_fault(root, one) for one in complaints]


def read_yaml(path: Path, known: Collection[str] = ()) -> Document:
    """Return one YAML 1.2 file whose top level is a mapping.

    known: keys of the top level; a file with none of them is refused and nothing of it shown

    Raises:
        ConfigError: unreadable, not UTF-8, not YAML, empty, keys twice, no mapping.
    """
    faults: list[ConfigFault] = []
    text, root = read(path, faults, known)
    if faults or root is None:
        raise ConfigError(faults)
    return Document(path, text, root)


def shipped_path(kind: str, name: str, home: Path | None = None) -> Path:
    """Return the path of a file that comes with the package, e.g. ``shipped("rigs", "desk")``.

    Args:
        kind: of the files.
        name: of the file, without its ending.
        home: the folder of kinds, such as that of a feature; None: ``SHIPPED``.

    Raises:
        ConfigError: there is none of that name; lists those that exist.
    """
    names = shipped_names(kind, home)
    if name in names:
        return (home or SHIPPED) / kind / f"{name}.yaml"
    if kind in _GROUPS:
        return package_file_path(kind, name)
    raise _unknown(kind, name, names)


def package_file_path(kind: str, name: str) -> Path:
    """Return the path of a file that another package brings, of rigs or gestures.

    Raises:
        ConfigError: no package brings one of this name, or one cannot be imported.
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
    known = f"there are {', '.join(names)}" if names else "there are none of this kind"
    rule = f"nothing named {name!r} is shipped{suggestion_text(name, names) or ';'} {known}"
    return ConfigError([ConfigFault(f"config/{kind}", None, "", repr(name), rule)])


def _steps(key: str) -> tuple[str, ...]:
    """Return the steps of a dotted key path."""
    return tuple(key.split(".")) if key else ()


def _resolve_paths(layer: Entry) -> Entry:
    """Return a file's entries with paths of neighbouring files relative to the working folder."""
    if not isinstance(layer.value, dict):
        return layer
    folder, found = Path(layer.file).parent, dict(layer.value)
    gestures = found.get(_FILES_BESIDE)
    if gestures is not None and isinstance(gestures.value, tuple):
        paths = tuple(
            replace(one, value=str(folder / str(one.value))) if _is_relative(one.value) else one
            for one in gestures.value
        )
        found[_FILES_BESIDE] = replace(gestures, value=paths)
    meshes = found.get(_MESHES)
    if meshes is not None and isinstance(meshes.value, dict):
        beside = {name: _relative_mesh(one, folder) for name, one in meshes.value.items()}
        found[_MESHES] = replace(meshes, value=beside)
    return replace(layer, value=found)


def _relative_mesh(mesh: Entry, folder: Path) -> Entry:
    """Return the entry of a mesh with its file as seen from the working folder."""
    file = mesh.value.get("file") if isinstance(mesh.value, dict) else None
    if file is None or not isinstance(file.value, str) or file.value.startswith("~"):
        return mesh
    assert isinstance(mesh.value, dict)
    return replace(
        mesh, value={**mesh.value, "file": replace(file, value=str(folder / file.value))}
    )


def _is_relative(value: object) -> bool:
    """Return whether it is a path below a folder; a bare name is that of a package's file."""
    path = isinstance(value, str) and ("/" in value or value.endswith((".yaml", ".yml")))
    return path and not str(value).startswith("~")


def _merge(low: Entry, high: Entry, into: type | None = None) -> Entry:
    """Return one entry laid over another; a mapping keeps the line of the lowest file.

    into: the dataclass that they make; its default mapping is below ``high`` where
        ``low`` has none, so that a character can change one rule of those every rig has
    """
    if not (isinstance(low.value, dict) and isinstance(high.value, dict)):
        return high
    over = dict(low.value)
    shapes = shapes_of(into) if into is not None else {}
    for key, entry in high.value.items():
        shape = shapes.get(key)
        below = low.value.get(key) or _default_mapping(into, key, shape, entry)
        over[key] = entry
        if below is not None:
            over[key] = _merge(below, entry, shape.params if shape is not None else None)
    return Entry(over, low.file, low.line)


def _default_mapping(
    into: type | None, key: str, shape: Shape | None, above: Entry
) -> Entry | None:
    """Return what a dataclass has at a key by default if that is a mapping, else None."""
    if into is None or shape is None:
        return None
    if shape.params is not None:
        return Entry({}, above.file, above.line)
    if shape.inner is None or shape.inner.params is None:
        return None
    made = cast(Any, into).__dataclass_fields__[key].default_factory
    values = made() if made is not MISSING else {}
    entries = {name: entries_at(asdict(value), above) for name, value in values.items()}
    return Entry(entries, above.file, above.line)


def entries_at(value: Any, at: Entry) -> Entry:
    """Return plain values as entries of the place of another."""
    if isinstance(value, dict):
        value = {key: entries_at(one, at) for key, one in value.items()}
    elif isinstance(value, tuple):
        value = tuple(entries_at(one, at) for one in value)
    return Entry(value, at.file, at.line)


def _to_fault(root: Entry, violation: Violation) -> ConfigFault:
    """Return a complaint its file and line."""
    entry = root.nearest(violation.path)
    key = ".".join(map(str, violation.path))
    return ConfigFault(entry.file, entry.line, key, violation.value, violation.rule)


def _contradiction(root: Entry, key: str, rule: str) -> Violation:
    """Return what a check found as a violation."""
    stands = root.nearest(_steps(key)).value
    return Violation(
        _steps(key), "" if isinstance(stands, dict | tuple) else abbreviate(stands), rule
    )


def _certain_findings(
    root: Entry, into: type[T], wrong: set[tuple[Step, ...]], checks: Sequence[Check[T]]
) -> list[tuple[str, str]]:
    """Return what the checks find whichever right values take the place of the wrong ones."""
    low, high = (fill_stand_ins(into, root.to_plain(), wrong, end) for end in (False, True))
    found: list[tuple[str, str]] = []
    for check in checks:
        also = set(_findings_until_failure(check, high))
        found += [one for one in _findings_until_failure(check, low) if one in also]
    named = [tuple(map(str, path)) for path in wrong]
    return [one for one in found if not any(_steps(one[0])[: len(p)] == p for p in named)]


def _findings_until_failure(check: Check[T], value: T) -> Iterator[tuple[str, str]]:
    """Return the findings of a check until a stand-in makes it fail."""
    with contextlib.suppress(ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
        yield from check(value)
