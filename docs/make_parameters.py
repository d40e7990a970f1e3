"""Write docs/parameters.md from the declarations: python docs/make_parameters.py."""

from collections.abc import Iterator
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from typing import Any

from gazerig.config.bounds import Shape, shapes_of
from gazerig.config.rig import Rig
from gazerig.config.save_text import written

PAPER = Path(__file__).parent / "parameters.md"
_HEAD = """# Every parameter of a rig

Written by `python docs/make_parameters.py` from the declarations in the code, the same that the loader,
the page and `gazerig ctl set` read. A star stands for a name that you choose: a joint's, a rule's, a bus's.
A default is the program's own; the shipped rigs and profiles set their values over it, and a dash
means that a rig file must give one. [tuning.md](tuning.md) describes how to change them while the head moves
and how to add one.
"""


def text() -> str:
    """Return the whole page."""
    parts = [_HEAD]
    listed: dict[type, str] = {}
    for title, params, rows in _sections(Rig, ""):
        parts.append(f"\n## {title or 'rig'}\n\n")
        same = listed.setdefault(params, title)
        if same != title:
            parts.append(f"The keys of {same}.\n")
        else:
            parts += ["| key | default | unit, range | meaning |\n|---|---|---|---|\n", *rows]
    return "".join(parts)


def _sections(params: type, above: str) -> Iterator[tuple[str, type, list[str]]]:
    """Return each section with its type and its rows, from the top."""
    nested: list[tuple[str, type]] = []
    rows: list[str] = []
    defaults = {f.name: _default(f) for f in fields(params)}
    for name, shape in shapes_of(params).items():
        key = f"{above}.{name}" if above else name
        inner = shape.inner if shape.form == "mapping" else None
        if shape.params is not None:
            nested.append((key, shape.params))
        elif inner is not None and inner.params is not None:
            nested.append((f"{key}.*", inner.params))
        else:
            rows.append(
                f"| `{name}` | {defaults[name]} | {_limits(shape)} | {_cell(shape.description)} |\n"
            )
    if rows:
        yield above, params, rows
    for key, inside in nested:
        yield from _sections(inside, key)


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
    return _cell(written(value))


def _limits(shape: Shape) -> str:
    inner = shape
    while inner.inner is not None:
        inner = inner.inner
    limits = ", ".join(map(str, inner.choices))
    if inner.low is not None and inner.high is not None:
        limits = f"{inner.low:.12g} to {inner.high:.12g}"
    return _cell(", ".join(filter(None, (shape.unit, limits, "or null" if shape.optional else ""))))


def _cell(words: str) -> str:
    return words.replace("|", "\\|").replace("*", "\\*")


if __name__ == "__main__":
    PAPER.write_text(text(), encoding="utf-8")
    print(f"written: {PAPER}")
