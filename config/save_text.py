"""Values and whole configurations as YAML text."""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from gazerig.config.load import find_file, load
from gazerig.config.parameters import to_plain
from gazerig.config.tracks import TrackSet, load_track, track_name

_PLAIN_TEXT = re.compile(r"(?!(?i:null|true|false|yes|no|on|off|y|n)$)[A-Za-z/][\w./-]*")


def format_value(value: Any) -> str:
    """Return a value as YAML on one line: JSON, and simple words without quotes."""
    match value:
        case Mapping():
            pairs = [f"{format_value(key)}: {format_value(one)}" for key, one in value.items()]
            return f"{{{', '.join(pairs)}}}"
        case list() | tuple():
            return f"[{', '.join(map(format_value, value))}]"
        case str() if _PLAIN_TEXT.fullmatch(value):
            return value
    return json.dumps(value, ensure_ascii=False, default=int)  # a number of numpy


def params_text(params: Any) -> str:
    """Return a dataclass of parameters, or nested mappings, as YAML.

    ``gazerig.config.load.load`` reads exactly the same values.
    """
    return "".join(_lines(to_plain(params)))


def tracks_text(files: Sequence[str]) -> str:
    """Return the rig's own tracks as one YAML text, "" without any.

    Raises:
        gazerig.config.load.ConfigError: one has a fault.
    """
    found = {}
    for file in files:
        track = load_track(find_file("tracks", file))
        # A rerun plays no sound, and its track is another file.
        found[track_name(file)] = replace(track, sound=Path(track.sound).name)
    return params_text(TrackSet(found)) if found else ""


def track_files(text: Path, folder: Path) -> tuple[str, ...]:
    """Write each track of a text from ``tracks_text`` to a separate file; return the files.

    Raises:
        gazerig.config.load.ConfigError: the text has a fault.
    """
    files = []
    for name, track in load(text, TrackSet).tracks.items():
        file = folder / f"{name}.yaml"
        file.write_text(params_text(track), encoding="utf-8")
        files.append(str(file))
    return tuple(files)


def _lines(values: dict[str, Any], depth: int = 0) -> Iterator[str]:
    """Return mappings as YAML, one key per line."""
    for key, value in values.items():
        start = f"{'  ' * depth}{format_value(key)}:"
        if isinstance(value, dict) and value:
            yield f"{start}\n"
            yield from _lines(value, depth + 1)
        else:
            yield f"{start} {format_value(value)}\n"
