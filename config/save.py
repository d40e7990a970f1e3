"""Writing values into a user's YAML file, atomically and with a backup.

Only the text of these values changes: comments, order and form of the file stay. The new text is
checked as a separate file before it replaces the old one, which stays in the folder; its name then
contains the time.
"""

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from datetime import datetime
from operator import itemgetter
from pathlib import Path
from typing import Any

import yaml
from yaml.nodes import MappingNode, ScalarNode

from gazerig.config.entries import parse
from gazerig.config.load import ConfigError, Document, read_yaml
from gazerig.config.parameters import flatten_changes, merge, nest, to_plain, value_of
from gazerig.config.save_text import format_value
from gazerig.config.schema import load_rig, refusal
from gazerig.config.shipped_files import SHIPPED
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import output_file
from gazerig.robot.model.parameter import ParamChange, SavedFile


def save(
    path: Path | str,
    changes: Mapping[str, Any],
    now: datetime,
    check: Callable[[str], Any] = load_rig,
    source: Path | None = None,
) -> SavedFile:
    """Write values at dotted keys into a YAML file, and keep the old file as a backup.

    The file is replaced only after ``check`` has loaded the new one with every value. After any
    error the file is unchanged.

    now: time for the backup's name, ``rig.yaml.bak-20260131-235959``
    check: loads a file by its path, like ``gazerig.config.schema.load_rig``
    source: the file to copy with these values to a new ``path``; None: ``path`` itself

    Raises:
        gazerig.config.load.ConfigError: the file is shipped, unreadable or not writable, a value is
            rejected, another layer overrides it, or ``path`` exists and ``source`` is given.
    """
    target = Path(os.path.realpath(path))
    if target.is_relative_to(SHIPPED.resolve()):
        # An update of the package would overwrite it.
        copy = f"copy it (cp {target} my{target.name}) and use the copy"
        raise refusal("", f"is part of the program and is never changed: {copy}", target)
    before, text, found = propose(source or target, changes)
    backup = None
    if source is None:
        if not found:
            return SavedFile(target, None, ())
        if not os.access(target, os.W_OK):
            raise refusal("", "is read-only; allow writing with chmod u+w", target)
        backup = Path(f"{target}.bak-{now:%Y%m%d-%H%M%S}")
    try:
        with output_file(target, force=source is None) as fresh:
            fresh.write(text.encode())
            fresh.flush()
            try:
                loaded = check(str(fresh.name))
            except ConfigError as error:
                raise ConfigError(
                    replace(fault, file=fault.file.replace(str(fresh.name), str(target)))
                    for fault in error.faults
                ) from None
            for key, value in changes.items():
                if (held := value_of(loaded, key)) != to_plain(value):
                    rule = f"stays {held} with any value in this file: a later layer sets it"
                    raise refusal(key, rule, target)
            if backup is not None:
                if read_yaml(target).text != before.text:
                    raise refusal("", "was changed by another program meanwhile; try again", target)
                if not backup.exists():  # a former one of this second is older
                    backup.write_bytes(target.read_bytes())
    except SetupError as error:
        raise refusal("", str(error)) from None
    return SavedFile(target, backup, found)


def propose(
    path: Path, changes: Mapping[str, Any]
) -> tuple[Document, str, tuple[ParamChange, ...]]:
    """Return a file, its text with other values at dotted keys, and the differences.

    Raises:
        gazerig.config.load.ConfigError: the file cannot be read, or a value cannot be written.
    """
    before = read_yaml(path)
    olds = {key: format_value(value) for key, value in flatten_changes(before.data).items()}
    found = tuple(
        ParamChange(key, olds.get(key), new)
        for key, value in changes.items()
        if (new := format_value(value)) != olds.get(key)
    )
    tree, text = to_plain(nest({change.key: changes[change.key] for change in found})), before.text
    edits = _edits(yaml.compose(text, Loader=yaml.CSafeLoader), tree, text)
    for start, end, new in reversed(sorted(edits, key=itemgetter(0))):
        text = f"{text[:start]}{new}{text[end:]}"
    after = parse(str(path), text, [])
    if after is None or after.data != merge(before.data, tree):
        rule = (
            "cannot be written: it is a mapping, or a list with comments between its lines; change "
            "the file by hand"
        )
        raise refusal(", ".join(changes), rule, path)
    return before, text, found


def _edits(holder: Any, wanted: Mapping[str, Any], text: str) -> Iterator[tuple[int, int, str]]:
    """Yield start, end and new text for the values in a mapping of a file; new keys come last.

    Nothing is yielded for a value that cannot be replaced.
    """
    missing = dict(wanted)
    for key, node in holder.value:
        if key.value not in wanted:
            continue
        value = missing.pop(key.value)
        start, end = node.start_mark.index, _end(node)
        if isinstance(node, MappingNode) and isinstance(value, dict):
            yield from _edits(node, value, text)
        elif isinstance(node, ScalarNode):
            yield start, end, format_value(value)
        elif "#" not in text[key.end_mark.index : end]:
            yield key.end_mark.index, end, f": {format_value(value)}"
    if missing:
        at, gap = holder.end_mark.index - 1, ", "
        if not holder.flow_style:
            at = f"{text}\n".index("\n", _end(holder))
            gap = f"\n{' ' * holder.value[0][0].start_mark.column}"
        lines = [f"{format_value(key)}: {format_value(value)}" for key, value in missing.items()]
        yield at, at, f"{gap if holder.value else ''}{gap.join(lines)}"


def _end(node: Any) -> int:
    """Return the end of a value's text, without the comments behind it."""
    while isinstance(node.value, list) and node.value and not node.flow_style:
        last = node.value[-1]
        node = last[1] if isinstance(last, tuple) else last
    return int(node.end_mark.index)
