"""The list of all parameters of a rig, a page of the documentation site."""

from collections.abc import Iterator
from dataclasses import MISSING, fields, is_dataclass
from typing import Any

from gazerig.config.rig import Rig
from gazerig.config.save import format_value
from gazerig.params import Declaration, declarations

_HEAD = """# Every parameter of a rig

From the declarations in the code, which the loader, the page and `gazerig ctl set` read. A star
stands for a name that you choose: a joint's, a rule's, a bus's. A default is the program's own; the
shipped rigs and profiles set their values over it, and a dash means that a rig file must give one.
[tuning.md](tuning.md) describes how to change them while the head moves and how to add one.
"""


_TABLE = "|key|default|unit, range|meaning|\n|---|---|---|---|\n"


def parameters_page() -> str:
    """Return the whole page: one table for each top-level section of a rig file."""
    parts = [_HEAD]
    last = None
    for section, row in _rows(Rig, "", {}):
        if section != last:
            parts.append(f"\n## {section}\n\n{_TABLE}")
        parts.append(row)
        last = section
    return "".join(parts)


def _rows(params: type, above: str, listed: dict[type, str]) -> Iterator[tuple[str, str]]:
    """Yield the section and the row of each key, those of a section before its inner sections'."""
    section = above.split(".")[0] or "rig"
    if (same := listed.setdefault(params, above)) != above:
        yield section, f"|`{above}`|||the keys of {same}|\n"
        return
    nested: list[tuple[str, type]] = []
    defaults = {f.name: _default(f) for f in fields(params)}
    for name, shape in declarations(params).items():
        key = f"{above}.{name}" if above else name
        inner = shape.inner if shape.form == "mapping" else None
        if shape.params is not None:
            nested.append((key, shape.params))
        elif inner is not None and inner.params is not None:
            nested.append((f"{key}.*", inner.params))
        else:
            cells = (f"`{key}`", defaults[name], _limits(shape), _cell(shape.description))
            yield section, f"|{'|'.join(cells)}|\n"
    for key, inside in nested:
        yield from _rows(inside, key, listed)


def _default(field: Any) -> str:
    value = field.default
    if field.default_factory is not MISSING:
        value = field.default_factory()
    if value is MISSING:
        return "-"
    if is_dataclass(value) or isinstance(value, dict):
        return "none"
    if isinstance(value, tuple) and any(is_dataclass(item) for item in value):
        return "none"
    return _cell(format_value(value))


def _limits(shape: Declaration) -> str:
    inner = shape.innermost
    limits = ", ".join(map(str, inner.choices))
    if inner.low is not None and inner.high is not None:
        limits = f"{inner.low:.12g}..{inner.high:.12g}"
    return _cell(", ".join(filter(None, (shape.unit, limits, "or null" if shape.optional else ""))))


def _cell(words: str) -> str:
    return words.replace("|", "\\|").replace("*", "\\*").replace("[", "\\[")
