"""Writing values into a user's YAML file, in one step and with a backup.

The new text is checked as a file of its own before it takes the old one's place, in one
step; the old file stays in the folder under a name with the time.
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

from gazerig.config.bounds import shapes_of
from gazerig.config.load import ConfigError, ConfigFault, Document, read_yaml, shipped_path
from gazerig.config.rig import Rig
from gazerig.config.save_text import EditRefused, Value, edit_text, format_value
from gazerig.config.schema import load_rig
from gazerig.config.shipped_files import SHIPPED
from gazerig.drivers.files.file_input import read_limited
from gazerig.robot.model.parameter import ParamChange, SavedFile

Check = Callable[[str], Any]
"""Loads a file by its path and returns its value; raises gazerig.config.load.ConfigError."""


def save_rig(path: Path | str, changes: Mapping[str, Value], now: datetime) -> SavedFile:
    """Write values into a rig file: ``save_rig("my.yaml", {"loop.rate_hz": 100.0}, now)``.

    path: the file; the name of a shipped rig is understood too, to be refused with the remedy

    Raises:
        gazerig.config.load.ConfigError: see ``save``.
    """
    return save(rig_file(path), changes, now, load_rig, Rig)


def rig_file(name_or_path: Path | str) -> Path:
    """Return the file behind a rig's name or path, as ``gazerig.config.schema.load_rig`` takes it.

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
    """Write values at dotted key paths into a YAML file and keep the old file as a backup.

    Keys that are not there are added with a comment. Comments, order, style and anchors stay. The
    file is replaced only after ``check`` has loaded the new one and found every
    value in it; on any error the file is as it was.

    now: goes into the backup's name, ``rig.yaml.bak-20260131-235959``
    check: loads a file by path, as ``gazerig.config.schema.load_rig`` does
    into: the Params dataclass of the file, whose fields explain added keys
    base: text to write the values into, in the place of a file that has faults or is gone

    Raises:
        gazerig.config.load.ConfigError: the file is shipped, unreadable or not writable, a value
            is refused, or another layer overrides it.
    """
    target = Path(os.path.realpath(path))
    # An update of the package would overwrite a file inside it.
    package = Path(os.path.realpath(SHIPPED))
    if package in target.parents:
        raise _fault(
            target,
            "comes with the program and is never changed: copy it "
            f"(cp {target} my{target.name}) and name the copy",
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
                    f"{key} stays {held} whatever this file says: a later layer sets it",
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
    """Return what ``save`` would change; nothing is written.

    Raises:
        gazerig.config.load.ConfigError: the file cannot be read, or a value cannot be written.
    """
    return _proposal(Path(os.path.realpath(path)), changes, into)[2]


def copy_shipped(name: str, to: Path | str, kind: str = "rigs") -> Path:
    """Copy a file that comes with the package, to be changed; never over another file.

    Raises:
        gazerig.config.load.ConfigError: none of that name is shipped, or ``to`` exists or cannot
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
    known = tuple(shapes_of(into))
    if base is None:
        before = read_yaml(target, known)  # refuses what is no YAML, with the line
        base = target.read_bytes()
        raw: bytes | None = base
    else:
        raw, before = _read_content(target), _document(base)
    mark = b"\xef\xbb\xbf" if base.startswith(b"\xef\xbb\xbf") else b""
    try:
        text = edit_text(before.text, changes, into)
        # An anchor lends its value to other places, which must not change unseen.
        kept, fresh = _leaves(before.data), _leaves(_document(text.encode()).data)
        for key in sorted({*kept, *fresh}):
            requested = key in changes or any(c.startswith(f"{key}.") for c in changes)
            if not requested and kept.get(key, _ABSENT) != fresh.get(key, _ABSENT):
                raise EditRefused(
                    f"{key} would change as well, as an anchor (&) ties it to "
                    f"{', '.join(changes)}; write its value out first"
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
    """Return a text read as a file of its own."""
    with tempfile.TemporaryDirectory() as folder:
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
    """Return all that is not a mapping, or an empty one, by dotted path."""
    if not isinstance(value, dict) or not value:
        return {path: value}
    found: dict[str, Any] = {}
    for key, item in value.items():
        found |= _leaves(item, f"{path}.{key}" if path else key)
    return found


@contextlib.contextmanager
def _replacement_file(target: Path, text: bytes) -> Iterator[Path]:
    """Write a new file in the same folder, gone again unless it has taken the target's place."""
    handle, name = tempfile.mkstemp(prefix=f".{target.stem}-", suffix=".yaml", dir=target.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        if target.exists() and not (
            os.access(target, os.W_OK) and target.stat().st_mode & _ANY_WRITE
        ):
            raise PermissionError(None, "it is read-only; chmod u+w gives the right to write")
        yield Path(name)
    finally:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(name)


def _backup(target: Path, before: bytes, now: datetime) -> Path:
    """Keep the old file under a new name and return that."""
    stem = f"{target}.bak-{now:%Y%m%d-%H%M%S}"
    for number in range(1, 100):
        path = Path(stem if number == 1 else f"{stem}-{number}")
        with contextlib.suppress(FileExistsError):
            with path.open("xb") as file:
                file.write(before)
            return path
    raise _fault(target, f"has 99 backups of this second ({stem} ...); clear some away")


@contextlib.contextmanager
def _convert_os_errors(target: Path) -> Iterator[None]:
    """Turn errors of the file system into a ConfigError of one line."""
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
