"""Values and whole configurations as YAML text."""

import json
import operator
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import isfinite
from pathlib import Path
from typing import Any

from gazerig.config.load import load
from gazerig.config.parameters import to_plain
from gazerig.config.schema import load_walk
from gazerig.config.tracks import TrackSet, load_track, track_name, track_path

Value = str | int | float | bool | None | tuple["Value", ...] | list["Value"]

_PLAIN_TEXT = re.compile(r"[A-Za-z/][\w./-]*")
_NO_TEXT = {"null", "true", "false", "yes", "no", "on", "off", "y", "n"}


class EditRefused(ValueError):
    """A value cannot be written; the message contains key, reason and remedy."""


def format_value(value: Value) -> str:
    """Return a value as YAML on one line.

    Raises:
        EditRefused: it is not finite, or neither a scalar nor a list.
    """
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        to_plain = _PLAIN_TEXT.fullmatch(value) and value.lower() not in _NO_TEXT
        return value if to_plain else json.dumps(value, ensure_ascii=False)
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(format_value, value))}]"
    if isinstance(value, float):
        if not isfinite(value):
            raise EditRefused(f"{value} is not a finite number and is never written")
        return repr(float(value))
    try:
        return str(operator.index(value))
    except TypeError:
        raise EditRefused(
            f"{value!r} is not a number, text, truth value or list of those"
        ) from None


def params_text(params: Any) -> str:
    """Return a dataclass of parameters as YAML: a world's script, or those of a rig.

    ``gazerig.config.load.load`` reads exactly the same values.
    """
    return "".join(_lines(to_plain(params)))


def walk_text(name_or_path: str) -> str:
    """Return the face walk of a rig as YAML.

    Raises:
        gazerig.config.load.ConfigError: the walk has a fault.
    """
    return "".join(_lines(to_plain(load_walk(name_or_path))))


def tracks_text(files: Sequence[str]) -> str:
    """Return the rig's own tracks as one YAML text, "" without any.

    Raises:
        gazerig.config.load.ConfigError: one has a fault.
    """
    found = {track_name(file): load_track(track_path(file)) for file in files}
    # A rerun plays no sound, and its track is another file.
    found = {name: replace(one, sound=Path(one.sound).name) for name, one in found.items()}
    return "".join(_lines(to_plain(TrackSet(found)))) if found else ""


def track_files(text: Path, folder: Path) -> tuple[str, ...]:
    """Write each track of a text from ``tracks_text`` to a separate file; return the files.

    Raises:
        gazerig.config.load.ConfigError: the text has a fault.
    """
    files = []
    for name, track in load(text, TrackSet).tracks.items():
        file = folder / f"{name}.yaml"
        file.write_text("".join(_lines(to_plain(track))), encoding="utf-8")
        files.append(str(file))
    return tuple(files)


def changes_text(changes: Mapping[str, Any]) -> str:
    """Return values at dotted keys as the YAML of a layer, for example a character."""
    nested: dict[str, Any] = {}
    for key, value in changes.items():
        *over, last = key.split(".")
        held = nested
        for step in over:
            held = held.setdefault(step, {})
        held[last] = value
    return "".join(_lines(nested))


def _lines(values: dict[str, Any], depth: int = 0) -> Iterator[str]:
    """Return mappings as YAML, one key per line."""
    for key, value in values.items():
        start = f"{'  ' * depth}{format_value(key)}:"
        if isinstance(value, dict) and value:
            yield f"{start}\n"
            yield from _lines(value, depth + 1)
        else:
            yield f"{start} {_flow(value)}\n"


def _flow(value: Any) -> str:
    """Return a value as YAML on one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{format_value(k)}: {_flow(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_flow, value)) + "]"
    return format_value(value)
