"""Values and configurations as YAML, written into a user's file atomically and with a backup.

Comments and the order of keys stay (ruamel's round trip). The new text is checked as a separate
file before it replaces the old one, which stays in the folder; its name then contains the time.
"""

import io
import json
import os
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from gazerig.config.entries import parse
from gazerig.config.load import ConfigError, Document, find_file, read_yaml
from gazerig.config.parameters import flatten_changes, merge, nest, to_plain, value_of
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


class RigLayers(NamedTuple):
    """Requested files of a rig, each a shipped name or a path."""

    name: str
    character: str | None
    profile: str | None


def save_layers(
    layers: RigLayers, to: str | None, wanted: Mapping[str, Any], now: datetime
) -> SavedFile:
    """Write values into a rig's file; character and profile must not override any of them.

    Args:
        layers: The rig's file, and the files merged over it.
        to: A new file for a copy with the values; None: the rig's own.
        wanted: Values by dotted key.
        now: Time for the backup's name.

    Raises:
        gazerig.config.load.ConfigError: see ``save``; or ``to`` exists or is not a
            YAML file.
    """
    own, source = find_file("rigs", layers.name), None
    if to is not None:
        if os.path.lexists(to) or not to.endswith((".yaml", ".yml")):
            rule = "already exists, or its name does not end in .yaml; choose another name"
            raise refusal("", rule, to)
        layers, own, source = layers._replace(name=to), Path(to), own
    check = partial(load_rig, character=layers.character, profile=layers.profile)
    return save(own, wanted, now, check, source)


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
    text = _rewrite(text, tree) if tree else text
    after = parse(str(path), text, [])
    if after is None or after.data != merge(before.data, tree):
        rule = (
            "cannot be written: it is a mapping, or a list with comments between its lines; change "
            "the file by hand"
        )
        raise refusal(", ".join(changes), rule, path)
    return before, text, found


def _rewrite(text: str, wanted: Mapping[str, Any]) -> str:
    """Return a file's text with other values; its comments and the order of its keys stay."""
    from ruamel.yaml import YAML  # few runs save anything

    yaml = YAML()  # the round trip
    yaml.preserve_quotes = True
    yaml.width = 10_000  # lines of the file are not wrapped
    yaml.representer.add_representer(
        type(None), lambda to, _: to.represent_scalar("tag:yaml.org,2002:null", "null")
    )
    step = re.search(r"^( +)[^\s#-]", text, re.MULTILINE)
    yaml.indent(mapping=len(step[1]) if step else 2)
    root, out = yaml.load(text), io.StringIO()
    _put(root, yaml.load(format_value(wanted)), len(root))
    yaml.dump(root, out)
    return out.getvalue()


def _put(holder: Any, wanted: Mapping[str, Any], at: int = 0) -> None:
    """Put values into a mapping of a file, new keys at a place; leave what cannot be replaced."""
    for key, value in wanted.items():
        held = holder.get(key)
        if key not in holder:
            holder.insert(at, key, value)
        elif isinstance(held, dict) and isinstance(value, dict):
            # In a block first: the comments below its last key are those of the next section.
            _put(held, value, len(held) if holder[key].fa.flow_style() else 0)
        elif isinstance(held, list) and isinstance(value, list) and len(held) == len(value):
            for i, item in enumerate(value):
                held[i] = item
        elif not (isinstance(held, dict | list) and holder[key].ca.items):
            holder[key] = value


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


def _lines(values: dict[str, Any], depth: int = 0) -> Iterator[str]:
    """Return mappings as YAML, one key per line."""
    for key, value in values.items():
        start = f"{'  ' * depth}{format_value(key)}:"
        if isinstance(value, dict) and value:
            yield f"{start}\n"
            yield from _lines(value, depth + 1)
        else:
            yield f"{start} {format_value(value)}\n"
