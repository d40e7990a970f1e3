"""Writing values into a user's YAML file, atomically and with a backup.

The new text is checked as a separate file before it atomically replaces the old one. The old file
stays in the folder; its name then contains the time.
"""

import contextlib
import os
import shutil
import stat
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

from gazerig.config.load import ConfigError, ConfigFault, Document, read_yaml, shipped_path
from gazerig.config.rig import Rig
from gazerig.config.save_text import EditRefused, Value, edit_text, format_value
from gazerig.config.schema import load_rig
from gazerig.config.shipped_files import SHIPPED
from gazerig.drivers.files.file_input import read_limited
from gazerig.drivers.process.own_folder import OwnFolder
from gazerig.params import declarations
from gazerig.robot.model.parameter import ParamChange, SavedFile

Check = Callable[[str], Any]
"""Loads a file by its path and returns its value; raises gazerig.config.load.ConfigError."""


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

    Missing keys are added with a comment. Comments, order, style and anchors are unchanged. The
    file is replaced only after ``check`` has loaded the new one with every value. After any error
    the file is unchanged.

    now: time for the backup's name, ``rig.yaml.bak-20260131-235959``
    check: loads a file by its path, like ``gazerig.config.schema.load_rig``
    into: the Params dataclass of the file, whose fields describe added keys
    base: text for the values instead of that of a file that has faults or does not exist

    Raises:
        gazerig.config.load.ConfigError: the file is shipped, unreadable or not writable, a value is
            rejected, or another layer overrides it.
    """
    target = Path(os.path.realpath(path))
    # An update of the package would overwrite a file inside it.
    package = Path(os.path.realpath(SHIPPED))
    if package in target.parents:
        raise _fault(
            target,
            "is part of the program and is never changed: copy it "
            f"(cp {target} my{target.name}) and use the copy",
        )
    before, text, found = _proposal(target, changes, into, base)
    if text == before:
        return SavedFile(target, None, ())
    with _convert_os_errors(target), _replacement_file(target, text) as fresh:
        try:
            loaded = check(str(fresh))
        except ConfigError as error:
            named = [
                replace(f, file=str(target) if f.file == str(fresh) else f.file)
                for f in error.faults
            ]
            raise ConfigError(named) from None
        for key, value in changes.items():
            held = _value_at(loaded, key)
            if held is not _ABSENT and isinstance(value, list | tuple):
                held, value = list(held), list(value)
            if held is not _ABSENT and held != value:
                raise _fault(
                    target,
                    f"{key} stays {held} with any value in this file: a later layer sets it",
                    key,
                )
        if _read_content(target) != before:
            raise _fault(target, "was changed by another program meanwhile; try again")
        backup = _backup(target, before, now) if before is not None else None
        if before is not None:
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
    known = tuple(declarations(into))
    if base is None:
        before = read_yaml(target, known)  # rejects a file that is not YAML, with the line
        base = target.read_bytes()
        raw: bytes | None = base
    else:
        raw, before = _read_content(target), _document(base)
    mark = b"\xef\xbb\xbf" if base.startswith(b"\xef\xbb\xbf") else b""
    try:
        text = edit_text(before.text, changes, into)
        # Aliases of an anchor would change unnoticed.
        kept, fresh = _leaves(before.data), _leaves(_document(text.encode()).data)
        for key in sorted({*kept, *fresh}):
            requested = key in changes or any(c.startswith(f"{key}.") for c in changes)
            if not requested and kept.get(key, _ABSENT) != fresh.get(key, _ABSENT):
                raise EditRefused(
                    f"{key} would also change, because an anchor (&) connects it to "
                    f"{', '.join(changes)}; write its value in full first"
                )
    except EditRefused as error:
        raise _fault(target, str(error)) from None
    old = {key: _value_at(before.data, key) for key in changes}
    found = tuple(
        ParamChange(
            key, None if old[key] is _ABSENT else format_value(old[key]), format_value(value)
        )
        for key, value in changes.items()
        if old[key] is _ABSENT or format_value(old[key]) != format_value(value)
    )
    return raw, mark + text.encode() if found else base, found


def _read_content(target: Path) -> bytes | None:
    """Return a file's content, None without a file."""
    with _convert_os_errors(target):
        try:
            return read_limited(target, _LARGEST)
        except FileNotFoundError:
            return None


def _document(text: bytes) -> Document:
    """Return a text parsed as a separate file."""
    with OwnFolder("config") as folder:
        file = Path(folder) / "new.yaml"
        file.write_bytes(text)
        return read_yaml(file)


_LARGEST = 100_000_000  # bytes of a file that is kept as a backup
_ABSENT: Any = object()
_ANY_WRITE = stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH


def _value_at(value: Any, key: str) -> Any:
    """Return the value at a dotted path through mappings or attributes of frozen values."""
    for step in key.split("."):
        if isinstance(value, Mapping):
            value = value.get(step, _ABSENT)
        else:
            value = getattr(value, step, _ABSENT)
    return value


def _leaves(value: Any, path: str = "") -> dict[str, Any]:
    """Return all values except non-empty mappings by dotted path."""
    if not isinstance(value, dict) or not value:
        return {path: value}
    found: dict[str, Any] = {}
    for key, item in value.items():
        found |= _leaves(item, f"{path}.{key}" if path else key)
    return found


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
        raise _fault(
            target, f"cannot be written: {error.strerror}; check it and its folder"
        ) from error


def _fault(target: Path, rule: str, key: str = "") -> ConfigError:
    return ConfigError([ConfigFault(str(target), None, key, "", rule)])
