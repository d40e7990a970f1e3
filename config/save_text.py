"""Changes of values inside YAML text; every other byte stays unchanged.

The text is parsed only to find the position of each value. Comments, order, indentation, quotes,
anchors and line ends survive because they are not rewritten.
"""

import json
import operator
import re
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple

from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from gazerig.config.entries import _compose
from gazerig.config.load import load
from gazerig.config.parameters import to_plain
from gazerig.config.schema import load_walk
from gazerig.config.tracks import TrackSet, load_track, track_name, track_path
from gazerig.params import Declaration

Value = str | int | float | bool | None | tuple["Value", ...] | list["Value"]
WIDTH = 100

_ANCHOR = re.compile(r"(?:&\S+\s+)?(?:!\S*\s+)?")
_ALIAS = re.compile(r"\s*:?\s*(\*[^\s,\]}]+)")
_PLAIN_TEXT = re.compile(r"[A-Za-z/][\w./-]*")
_NO_TEXT = {"null", "true", "false", "yes", "no", "on", "off", "y", "n"}


class EditRefused(ValueError):
    """A value cannot be changed in place; the message contains key, reason and remedy."""


class _Edit(NamedTuple):
    """Text that replaces ``text[start:end]``."""

    start: int
    end: int
    new: str


def edit_text(text: str, changes: Mapping[str, Value], into: type) -> str:
    """Return the text with replaced values at dotted key paths and with added missing keys.

    into: the Params dataclass of the file; descriptions of its fields become comments of added keys

    Raises:
        EditRefused: a value cannot be written at its place.
    """
    root = _top_node(text)
    edits, absent = [], {}
    for key, value in changes.items():
        place = _find(root, key.split("."))
        if place is None:
            absent[key] = value
        else:
            edits += _replace_value(text, key, place, value)
    for edit in sorted(edits, reverse=True):
        text = text[: edit.start] + edit.new + text[edit.end :]
    for key, value in absent.items():
        # One after the other: the first may create the mapping that the next one needs.
        edit = _add_key(text, _top_node(text), key, value, into)
        text = text[: edit.start] + edit.new + text[edit.end :]
    return text


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


def _top_node(text: str) -> MappingNode:
    """Return the top node of the text; nodes have positions and are not changed."""
    node = _compose(text)
    if not isinstance(node, MappingNode):
        raise EditRefused("the top level is not a mapping; write 'key: value' lines")
    return node


# --- finding


class _KeyAndValue(NamedTuple):
    """A value with the node before it (its key, or the list)."""

    before: Node
    node: Node


def _find(root: MappingNode, steps: list[str]) -> _KeyAndValue | None:
    """Return the value at a path, None if it or a mapping above it is missing."""
    place = _KeyAndValue(root, root)
    for step in steps:
        if not isinstance(place.node, MappingNode):
            return None
        for key, value in place.node.value:
            if key.value == step:
                place = _KeyAndValue(key, value)
                break
        else:
            return None
    return place


def _span(text: str, place: _KeyAndValue) -> tuple[int, int]:
    """Return the span of a value: after its anchor and tag; an alias is the whole value."""
    before, node = place
    at = before.start_mark.index if isinstance(before, SequenceNode) else before.end_mark.index
    if node.start_mark.index < at:  # the value is defined at its anchor, further up
        alias = _ALIAS.match(text, at)
        if alias is None:
            raise EditRefused("is part of an alias that cannot be resolved; write it in full")
        return alias.span(1)
    if node.start_mark.index == node.end_mark.index:  # only "key:"
        colon = text.index(":", at) + 1
        return colon, colon
    anchor = _ANCHOR.match(text, node.start_mark.index)
    start = anchor.end() if anchor else node.start_mark.index
    return start, node.end_mark.index


def _end(text: str, place: _KeyAndValue) -> int:
    """Return the position of a value's last character, without comments after it."""
    node = place.node
    inside = isinstance(node, MappingNode | SequenceNode) and not node.flow_style
    if not inside or node.start_mark.index < place.before.start_mark.index:
        return _span(text, place)[1]
    if isinstance(node, MappingNode):
        return _end(text, _KeyAndValue(*node.value[-1]))
    return _end(text, _KeyAndValue(node, node.value[-1]))


# --- replacing


def _replace_value(text: str, key: str, place: _KeyAndValue, value: Value) -> list[_Edit]:
    """Return the edits that replace a value."""
    node = place.node
    if isinstance(node, MappingNode):
        raise EditRefused(f"{key} is a mapping; name one of its keys")
    start, end = _span(text, place)
    block = isinstance(node, SequenceNode) and not node.flow_style and text[start] != "*"
    if block and isinstance(value, list | tuple) and len(value) == len(node.value):
        items = zip(node.value, value, strict=True)
        return [
            e for item, v in items for e in _replace_value(text, key, _KeyAndValue(node, item), v)
        ]
    if block or getattr(node, "style", None) in ("|", ">"):
        raise EditRefused(f"{key} is spread over several lines; write it on one line first")
    new = format_value(value)
    if start == end:
        new = f" {new}"
    return [] if text[start:end] == new else [_Edit(start, end, new)]


# --- adding


def _add_key(text: str, root: MappingNode, key: str, value: Value, into: type) -> _Edit:
    """Return the edit that adds a key and missing mappings above it, each with a comment."""
    steps = key.split(".")
    depth = next(n for n in range(len(steps) - 1, -1, -1) if _find(root, steps[:n]) is not None)
    holder = _find(root, steps[:depth])
    if holder is None or holder.node.start_mark.index < holder.before.start_mark.index:
        raise EditRefused(f"{key}: its mapping is an alias (*); write it in full first")
    node, newline = holder.node, "\r\n" if "\r\n" in text else "\n"
    if isinstance(node, MappingNode) and node.flow_style:
        new = (
            ": {".join(steps[depth:]) + f": {format_value(value)}" + "}" * (len(steps) - depth - 1)
        )
        if not node.value:
            at = text.index("{", node.start_mark.index) + 1
            return _Edit(at, at, new)
        at = _end(text, _KeyAndValue(*node.value[-1]))
        return _Edit(at, at, f", {new}")
    if isinstance(node, MappingNode):
        at, indent = _end(text, _KeyAndValue(*node.value[-1])), node.value[0][0].start_mark.column
    elif isinstance(node, ScalarNode) and node.start_mark.index == node.end_mark.index:
        at, indent = _span(text, holder)[1], holder.before.start_mark.column + 2
    else:
        raise EditRefused(f"{key}: {'.'.join(steps[:depth])} is not a mapping; change it to one")
    end = text.find("\n", at)
    end = len(text) if end < 0 else end
    at = end - 1 if end > at and text[end - 1] == "\r" else end
    lines = []
    for n in range(depth, len(steps)):
        body = f"{steps[n]}:" if n < len(steps) - 1 else f"{steps[n]}: {format_value(value)}"
        lines += _add_comment(body, comment(into, steps[: n + 1]), " " * (indent + 2 * (n - depth)))
    return _Edit(at, at, "".join(f"{newline}{line}" for line in lines))


def _add_comment(body: str, description: str, indent: str) -> list[str]:
    """Return a line with a trailing comment, or with one above it if it is too long."""
    line = f"{indent}{body}"
    if not description:
        return [line]
    if len(line) + len(description) + 4 <= WIDTH:
        return [f"{line}  # {description}"]
    above = textwrap.wrap(description, WIDTH - len(indent) - 2)
    return [*(f"{indent}# {part}" for part in above), line]


def comment(into: type, steps: list[str]) -> str:
    """Return unit, range and meaning of the key at a path; "" if no such key exists."""
    shape: Declaration | None = Declaration("params", params=into)
    for step in steps:
        if shape is not None:
            shape = shape.below(step)
    if shape is None:
        return ""
    inner = shape.inner or shape
    limits = " | ".join(map(str, inner.choices))
    if inner.low is not None and inner.high is not None:
        limits = f"{inner.low:.12g}..{inner.high:.12g}"
    return "; ".join(
        filter(None, (", ".join(filter(None, (shape.unit, limits))), shape.description))
    )


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
