"""A configuration as one YAML text that replaces all its layers.

It is read back with ``gazerig.config.load.load``; values come back exactly.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from gazerig.config.gestures import GestureSet, gesture_name, gesture_path, load_gesture
from gazerig.config.load import load
from gazerig.config.parameters import plain
from gazerig.config.save_text import written
from gazerig.config.schema import load_walk


def params_text(params: Any) -> str:
    """Return a dataclass of parameters as YAML: a world's script, or all in force of a rig."""
    return "".join(_lines(plain(params)))


def walk_text(name_or_path: str) -> str:
    """Return the face walk that a rig names as YAML.

    Raises:
        gazerig.config.load.ConfigError: the walk is at fault.
    """
    return "".join(_lines(plain(load_walk(name_or_path))))


def gestures_text(files: Sequence[str]) -> str:
    """Return the gestures that a rig names itself as one YAML text, "" if it names none.

    Raises:
        gazerig.config.load.ConfigError: one is at fault.
    """
    found = {gesture_name(file): load_gesture(gesture_path(file)) for file in files}
    return "".join(_lines(plain(GestureSet(found)))) if found else ""


def gesture_files(text: Path, folder: Path) -> tuple[str, ...]:
    """Write each gesture of a text of ``gestures_text`` to a file of its own; return the files.

    Raises:
        gazerig.config.load.ConfigError: the text is at fault.
    """
    files = []
    for name, gesture in load(text, GestureSet).gestures.items():
        file = folder / f"{name}.yaml"
        file.write_text("".join(_lines(plain(gesture))), encoding="utf-8")
        files.append(str(file))
    return tuple(files)


def changes_text(changes: Mapping[str, Any]) -> str:
    """Return values at dotted keys as the YAML of a layer: a character's, for example."""
    nested: dict[str, Any] = {}
    for key, value in changes.items():
        *over, last = key.split(".")
        held = nested
        for step in over:
            held = held.setdefault(step, {})
        held[last] = value
    return "".join(_lines(nested))


def _lines(values: dict[str, Any], depth: int = 0) -> Iterator[str]:
    """Return mappings as YAML, one key a line."""
    for key, value in values.items():
        start = f"{'  ' * depth}{written(key)}:"
        if isinstance(value, dict) and value:
            yield f"{start}\n"
            yield from _lines(value, depth + 1)
        else:
            yield f"{start} {_flow(value)}\n"


def _flow(value: Any) -> str:
    """Return a value as YAML on one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{written(k)}: {_flow(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_flow, value)) + "]"
    return written(value)
