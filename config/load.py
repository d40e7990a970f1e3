"""YAML files in layers to frozen values; one message lists every fault of every layer.

A rig is read in layers; later layers override earlier ones. Each file has the lines of its keys, so
that a fault found after merging the layers, or by a rule between two sections, still names the line
to change.
"""

import contextlib
import re
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import MISSING, asdict, replace
from pathlib import Path
from typing import Any, TypeVar, cast

from gazerig.config.entries import LARGEST, read
from gazerig.config.entries import Document as Document
from gazerig.config.faults import ConfigError as ConfigError
from gazerig.config.faults import ConfigFault as ConfigFault
from gazerig.config.plugin_sections import put_plugins, take_plugins
from gazerig.config.rig import Rig
from gazerig.config.shipped_files import SHIPPED, is_path
from gazerig.config.shipped_files import shipped_names as shipped_names
from gazerig.config.validation import fault_at, fill, validate
from gazerig.params import Declaration, declarations, suggestion_text

T = TypeVar("T")
_FILES = re.compile(r"\.track_files\.\d+")
"""Keys of a rig with file paths, relative to the folder of the file that contains them."""
_PATH = re.compile(r"[^~]*[./]")
"""Start of a path to resolve; a name alone selects a shipped track."""
Check = Callable[[T], Iterable[tuple[str, str]]]
"""Returns (dotted key path, broken rule) for rules between several fields."""


def load(
    path: Path,
    into: type[T],
    *,
    defaults: Sequence[Path] = (),
    checks: Sequence[Check[T]] = (),
    largest: int = LARGEST,
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
    layers = [layer for file in files if (layer := read(file, faults, known, largest))]
    if len(layers) < len(files):  # the content of a missing layer is unknown
        raise ConfigError(faults)
    data: Any = None
    for layer, file in zip(layers, files, strict=True):
        above = _resolve(layer.data, file.parent) if into is Rig else layer.data
        data = _merge(data, above, Declaration("params", params=cast(Any, into)))
    if into is Rig:
        _add_tracks(data, files[0].parent / "tracks")
    value, found = validate_rules(into, data, checks)
    faults += [_find_line(layers, one) for one in found]
    if faults or value is None:
        order = [str(file) for file in files]
        raise ConfigError(sorted(faults, key=lambda f: (order.index(f.file), f.line or 0)))
    return value


def validate_rules(
    into: type[T], data: dict[str, Any], checks: Sequence[Check[Any]]
) -> tuple[T | None, list[ConfigFault]]:
    """Return the frozen dataclass of plain values, None if impossible, and every fault.

    If fields are faulty, each check finds what it can before it reads one of them. A valid
    dataclass may have faults of checks.
    """
    data, plugins, found = take_plugins(data) if issubclass(into, Rig) else (data, [], [])
    value, wrong = validate(into, data)
    found += wrong
    if value is not None and not found:
        value = put_plugins(value, plugins)
        rules = [one for check in checks for one in check(value)]
        return value, [fault_at((key,), rule) for key, rule in rules]
    faulty = {one.key for one in found}
    faulty |= {".".join(map(str, (*one.above, key))) for one in plugins for key in one.fields}
    partial = fill(Declaration("params", params=cast(Any, into)), data, faulty)
    for check in checks:
        with contextlib.suppress(ArithmeticError, AttributeError, LookupError, TypeError):
            for key, rule in check(partial):
                found.append(fault_at((key,), rule))
    return None, found


def read_yaml(path: Path, known: Collection[str] = ()) -> Document:
    """Return one YAML 1.2 file whose top level is a mapping.

    known: keys of the top level; a file with none of them is rejected and its content is not shown

    Raises:
        ConfigError: unreadable, not UTF-8, not YAML, empty, duplicate keys, or not a mapping.
    """
    faults: list[ConfigFault] = []
    document = read(path, faults, known)
    if faults or document is None:
        raise ConfigError(faults)
    return document


def shipped_path(kind: str, name: str, home: Path | None = None) -> Path:
    """Return the path of a file by name, e.g. ``shipped_path("rigs", "desk")``.

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
    known = ", ".join(names) or "none"
    hint = suggestion_text(name, names) or ";"
    rule = f"nothing named {name!r} is shipped{hint} available: {known}"
    raise ConfigError([ConfigFault(f"config/{kind}", None, "", rule)])


def find_file(kind: str, name_or_path: str, home: Path | None = None) -> Path:
    """Return a file by its path, which need not exist, or by name as ``shipped_path`` does.

    Raises:
        ConfigError: no file has this name.
    """
    if is_path(name_or_path):
        return Path(name_or_path).expanduser()
    return shipped_path(kind, name_or_path, home)


def _add_tracks(data: dict[str, Any], folder: Path) -> None:
    """Add the tracks in the folder beside a rig to those that it names."""
    named = data.get("track_files", ())
    files = map(str, sorted(folder.glob("*.yaml")))
    if isinstance(named, list | tuple) and (more := [file for file in files if file not in named]):
        data["track_files"] = (*named, *more)


def _resolve(value: Any, folder: Path, key: str = "") -> Any:
    """Return a file's values with its file paths relative to the working folder."""
    if isinstance(value, dict):
        return {step: _resolve(one, folder, f"{key}.{step}") for step, one in value.items()}
    if isinstance(value, tuple):
        return tuple(_resolve(one, folder, f"{key}.{i}") for i, one in enumerate(value))
    if isinstance(value, str) and _FILES.fullmatch(key) and _PATH.match(value):
        return str(folder / value)
    return value


def _merge(low: Any, high: Any, declared: Declaration | None) -> Any:
    """Return plain values merged over others, or over a default mapping of dataclasses.

    So a character can change one of the default rules.
    """
    if not (isinstance(low, dict) and isinstance(high, dict)):
        return high
    merged = dict(low)
    for key, value in high.items():
        below = declared.below(key) if declared is not None else None
        default: dict[str, Any] = {}
        if below is not None and below.form == "mapping" and below.innermost.params is not None:
            made = cast(Any, declared).params.__dataclass_fields__[key].default_factory
            values = {} if made is MISSING else made()
            default = {name: asdict(one) for name, one in values.items()}
        merged[key] = _merge(low.get(key, default), value, below)
    return merged


def _find_line(layers: Sequence[Document], fault: ConfigFault) -> ConfigFault:
    """Return a fault with its file and line.

    Present keys are those of the highest layer; the lowest mapping misses absent ones.
    """
    above = fault.key
    while not (having := [layer for layer in layers if above in layer.lines]):
        above = above.rpartition(".")[0]
    layer = having[-1 if above == fault.key else 0]
    return replace(fault, file=layer.file, line=layer.lines[above])
