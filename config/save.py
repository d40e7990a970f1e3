"""Writing values into a user's YAML file, atomically and with a backup.

Comments and the order of keys stay (ruamel's round trip). The new text is checked as a separate
file before it atomically replaces the old one. The old file stays in the folder; its name then
contains the time.
"""

import contextlib
import io
import os
import re
import shutil
import stat
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.error import CommentMark
from ruamel.yaml.tokens import CommentToken

from gazerig.config.entries import parse
from gazerig.config.load import ConfigError, ConfigFault, read_yaml, shipped_path
from gazerig.config.rig import Rig
from gazerig.config.save_text import EditRefused, Value, format_value
from gazerig.config.schema import load_rig
from gazerig.config.shipped_files import SHIPPED
from gazerig.drivers.files.file_input import read_limited
from gazerig.params import declarations
from gazerig.robot.model.parameter import ParamChange, SavedFile

Check = Callable[[str], Any]
"""Loads a file by its path and returns its value; raises gazerig.config.load.ConfigError."""

_LARGEST = 1_000_000  # bytes
_ANY_WRITE = stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH
_BYTE_ORDER_MARK = "\ufeff"
_ABSENT: Any = object()


def save_rig(path: Path | str, changes: Mapping[str, Value], now: datetime) -> SavedFile:
    """Write values into a rig file: ``save_rig("my.yaml", {"loop.rate_hz": 100.0}, now)``.

    path: the file; the name of a shipped rig is refused with the remedy

    Raises:
        gazerig.config.load.ConfigError: see ``save``.
    """
    return save(rig_file(path), changes, now, load_rig, Rig)


def rig_file(name_or_path: Path | str) -> Path:
    """Return the file for a rig's name or path, as in ``gazerig.config.schema.load_rig``.

    Raises:
        gazerig.config.load.ConfigError: no rig of that name is shipped.
    """
    text = str(name_or_path)
    if isinstance(name_or_path, Path) or "/" in text or text.endswith((".yaml", ".yml")):
        return Path(name_or_path)
    return shipped_path("rigs", text)


def save(
    path: Path | str,
    changes: Mapping[str, Value],
    now: datetime,
    check: Check,
    into: type,
    base: bytes | None = None,
) -> SavedFile:
    """Write values at dotted key paths into a YAML file, and keep the old file as a backup.

    The file is replaced only after ``check`` has loaded the
    new one with every value. After any error the file is unchanged.

    now: time for the backup's name, ``rig.yaml.bak-20260131-235959``
    check: loads a file by its path, like ``gazerig.config.schema.load_rig``
    into: the Params dataclass of the file
    base: text for the values instead of that of a file that has faults or does not exist

    Raises:
        gazerig.config.load.ConfigError: the file is shipped, unreadable or not writable, a value is
            rejected, or another layer overrides it.
    """
    target = Path(os.path.realpath(path))
    if Path(os.path.realpath(SHIPPED)) in target.parents:
        # An update of the package would overwrite it.
        rule = "is part of the program and is never changed: copy it"
        raise _fault(target, f"{rule} (cp {target} my{target.name}) and use the copy")
    before, text, found = _proposal(target, changes, into, base)
    if text == before:
        return SavedFile(target, None, ())
    with _convert_os_errors(target), _replacement_file(target, text) as fresh:
        try:
            loaded = check(str(fresh))
        except ConfigError as error:
            raise ConfigError(
                replace(f, file=str(target) if f.file == str(fresh) else f.file)
                for f in error.faults
            ) from None
        for key, value in changes.items():
            held = _value_at(loaded, key)
            wanted = tuple(value) if isinstance(value, list) else value
            if held is not _ABSENT and held != wanted:
                rule = f"{key} stays {held} with any value in this file: a later layer sets it"
                raise _fault(target, rule, key)
        if _read(target) != before:
            raise _fault(target, "was changed by another program meanwhile; try again")
        backup = None
        if before is not None:
            backup = _backup(target, before, now)
            shutil.copymode(target, fresh)
        os.replace(fresh, target)
    return SavedFile(target, backup, found)


def propose(
    path: Path | str, changes: Mapping[str, Value], into: type = Rig
) -> tuple[ParamChange, ...]:
    """Return the changes that ``save`` would make, without writing.

    Raises:
        gazerig.config.load.ConfigError: the file cannot be read, or a value cannot be written.
    """
    return _proposal(Path(os.path.realpath(path)), changes, into)[2]


def copy_shipped(name: str, to: Path | str, kind: str = "rigs") -> Path:
    """Copy a shipped file for editing; never overwrite a file.

    Raises:
        gazerig.config.load.ConfigError: no shipped file has this name, or ``to`` exists or cannot
            be written.
    """
    source, target = shipped_path(kind, name), Path(to)
    with _convert_os_errors(target), target.open("xb") as file:
        file.write(source.read_bytes())
    return target


def _proposal(
    target: Path, changes: Mapping[str, Value], into: type, base: bytes | None = None
) -> tuple[bytes | None, bytes, tuple[ParamChange, ...]]:
    """Return the file's text (None without a file), its new text, and the difference."""
    if base is None:
        read_yaml(target, tuple(declarations(into)))  # rejects a file that is not YAML
    raw = _read(target)
    good = base if base is not None else raw or b""
    text = good.decode("utf-8")
    try:
        written = _edit_text(text, changes)
        before, after = _plain(target, text), _plain(target, written)
        old = {key: _value_at(before, key) for key in changes}
        found = tuple(
            ParamChange(
                key, None if old[key] is _ABSENT else format_value(old[key]), format_value(value)
            )
            for key, value in changes.items()
            if old[key] is _ABSENT or format_value(old[key]) != format_value(value)
        )
        for key in _different(before, after):
            # Aliases of an anchor would change unnoticed.
            if not any(f"{key}.".startswith(f"{c}.") or c.startswith(f"{key}.") for c in changes):
                named = ", ".join(changes)
                rule = f"would also change, because an anchor (&) connects it to {named}"
                raise EditRefused(f"{key} {rule}; write its value in full first")
    except EditRefused as error:
        raise _fault(target, str(error)) from None
    return raw, written.encode() if found else good, found


def _plain(target: Path, text: str) -> Any:
    root = parse(str(target), text.removeprefix(_BYTE_ORDER_MARK), [])
    return {} if root is None else root.to_plain()


def _different(before: Any, after: Any, key: str = "") -> Iterator[str]:
    """Yield the dotted paths of all values that differ."""
    if isinstance(before, dict) and isinstance(after, dict):
        for step in {**before, **after}:
            below = f"{key}.{step}" if key else step
            yield from _different(before.get(step, _ABSENT), after.get(step, _ABSENT), below)
    elif before != after:
        yield key


# --- text


def _yaml() -> YAML:
    yaml = YAML()
    yaml.preserve_quotes = True
    yaml.width = 10_000  # lines of the file are not wrapped
    yaml.representer.add_representer(
        type(None), lambda to, _: to.represent_scalar("tag:yaml.org,2002:null", "null")
    )
    return yaml


def _edit_text(text: str, changes: Mapping[str, Value]) -> str:
    """Return the text with other values at dotted key paths and with added missing keys.

    Raises:
        EditRefused: a value cannot be written at its place.
    """
    newline = "\r\n" if "\r\n" in text else "\n"
    lines = text.removeprefix(_BYTE_ORDER_MARK).replace("\r\n", "\n")
    indent = re.search(r"^( +)[^\s#-]", lines, re.MULTILINE)
    dash = re.search(r"^( *)[^\s#-].*:(?: *#.*)?\n\1( *)- ", lines, re.MULTILINE)
    offset = len(dash[2]) if dash else 0
    yaml = _yaml()
    yaml.indent(mapping=len(indent[1]) if indent else 2, sequence=offset + 2, offset=offset)
    yaml.explicit_start = lines.startswith("---")
    root = yaml.load(lines)
    for key, value in changes.items():
        _set(root, key, value)
    out = io.StringIO()
    yaml.dump(root, out)
    mark = _BYTE_ORDER_MARK if text.startswith(_BYTE_ORDER_MARK) else ""
    return mark + out.getvalue().replace("\n", newline)


def _set(root: CommentedMap, key: str, value: Value) -> None:
    """Set the value at a dotted path; add missing mappings above it."""
    written = _yaml().load(format_value(value))
    *over, last = key.split(".")
    holder: Any = root
    for depth, step in enumerate(over):
        if holder.get(step) is None:
            for inner in reversed([*over[depth + 1 :], last]):
                written = CommentedMap({inner: written})
            _add(holder, step, written)
            return
        holder = holder[step]
        if not isinstance(holder, CommentedMap):
            raise EditRefused(f"{key}: {'.'.join(over[: depth + 1])} is not a mapping; change it")
    held = holder.get(last)
    if isinstance(held, CommentedMap):
        raise EditRefused(f"{key} is a mapping; name one of its keys")
    if last not in holder:
        _add(holder, last, written)
    elif isinstance(held, CommentedSeq) and isinstance(written, CommentedSeq):
        if len(held) == len(written):
            for i, item in enumerate(written):  # the comments of the items stay
                held[i] = item
        elif held.fa.flow_style():
            holder[last] = written
        else:
            raise EditRefused(f"{key} is spread over several lines; write it on one line first")
    else:
        holder[last] = written


def _add(holder: CommentedMap, key: str, value: Any) -> None:
    """Add a key at the end of a mapping, before the comments of what follows it."""
    below = "" if holder.fa.flow_style() or key in holder else _take_comments_below(holder)
    holder[key] = value
    while isinstance(holder[key], CommentedMap):
        holder, key = holder[key], next(iter(holder[key]))
    if below:
        holder.ca.items[key] = [None, None, CommentToken(f"\n{below}", CommentMark(0), None), None]


def _take_comments_below(node: Any) -> str:
    """Return the comments and empty lines below the last value of a mapping, and remove them."""
    while node:
        last = next(reversed(node)) if isinstance(node, CommentedMap) else len(node) - 1
        inner = node[last]
        if not isinstance(inner, CommentedMap | CommentedSeq) or inner.fa.flow_style():
            tokens = node.ca.items.get(last)
            place = 2 if isinstance(node, CommentedMap) else 0
            if not tokens or tokens[place] is None:
                return ""
            line, _, below = tokens[place].value.partition("\n")
            tokens[place].value = f"{line}\n"
            return str(below)
        node = inner
    return ""


# --- files


def _read(target: Path) -> bytes | None:
    """Return a file's content, None without a file."""
    with _convert_os_errors(target):
        try:
            return read_limited(target, _LARGEST)
        except FileNotFoundError:
            return None


def _value_at(value: Any, key: str) -> Any:
    """Return the value at a dotted path through mappings or attributes of frozen values."""
    for step in key.split("."):
        if isinstance(value, Mapping):
            value = value.get(step, _ABSENT)
        else:
            value = getattr(value, step, _ABSENT)
    return value


@contextlib.contextmanager
def _replacement_file(target: Path, text: bytes) -> Iterator[Path]:
    """Write a new file in the same folder, which is deleted unless it has replaced the target."""
    handle, name = tempfile.mkstemp(prefix=f".{target.stem}-", suffix=".yaml", dir=target.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        if target.exists() and not (
            os.access(target, os.W_OK) and target.stat().st_mode & _ANY_WRITE
        ):
            raise PermissionError(None, "it is read-only; allow writing with chmod u+w")
        yield Path(name)
    finally:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(name)


def _backup(target: Path, before: bytes, now: datetime) -> Path:
    """Keep the old file under a new name and return that name."""
    stem = f"{target}.bak-{now:%Y%m%d-%H%M%S}"
    for number in range(1, 100):
        path = Path(stem if number == 1 else f"{stem}-{number}")
        with contextlib.suppress(FileExistsError):
            with path.open("xb") as file:
                file.write(before)
            return path
    raise _fault(target, f"has 99 backups of this second ({stem} ...); delete some")


@contextlib.contextmanager
def _convert_os_errors(target: Path) -> Iterator[None]:
    """Convert errors of the file system to a ConfigError of one line."""
    try:
        yield
    except FileExistsError:
        raise _fault(target, "already exists and is not overwritten; choose another name") from None
    except OSError as error:
        rule = f"cannot be written: {error.strerror}; check it and its folder"
        raise _fault(target, rule) from error


def _fault(target: Path, rule: str, key: str = "") -> ConfigError:
    return ConfigError([ConfigFault(str(target), None, key, "", rule)])
