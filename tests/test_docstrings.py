"""Docstrings document arguments that there are, in a form that tools read."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
ROOMS = ("config", "doors", "drivers", "features", "gaze", "gazerig", "robot", "sim_mock")
Documented = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef


def documented(path: Path) -> Iterator[Documented]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, Documented) and ast.get_docstring(node):
            yield node


def arguments(node: Documented) -> set[str] | None:
    """Return the arguments of a function or of a class's constructor; None without any."""
    if isinstance(node, ast.ClassDef):
        made = [n for n in node.body if isinstance(n, ast.FunctionDef) and n.name == "__init__"]
        if not made:
            return None  # a dataclass or named tuple, or the constructor of its base
        return arguments(made[0])
    one = node.args
    every = [*one.posonlyargs, *one.args, *one.kwonlyargs, one.vararg, one.kwarg]
    return {arg.arg for arg in every if arg is not None}


def entries(text: str, section: str) -> list[str]:
    """Return the first lines of the entries of a section of a docstring in Google style."""
    found = re.search(rf"^{section}:\n((?:(?:    .*)?\n)*)", f"{text}\n", re.MULTILINE)
    return re.findall(r"^    (?! )(.*)$", found[1], re.MULTILINE) if found else []


def faults(node: Documented, text: str) -> Iterator[str]:
    known = arguments(node)
    for entry in entries(text, "Args"):
        name, colon, _ = entry.partition(":")
        name = name.partition(" (")[0].lstrip("*")
        if not colon or (known is not None and name not in known):
            yield f"{node.name}: Args: {entry!r} is no 'name: text' of an argument"
    for entry in entries(text, "Raises"):
        if not re.match(r"[\w.]+(?:, [\w.]+)*: ", entry):
            yield f"{node.name}: Raises: {entry!r} is no 'error: text'; indent what goes on"


def test_what_docstrings_document_is_there() -> None:
    found, seen = [], 0
    for room in ROOMS:
        for path in (ROOT / room).rglob("*.py"):
            for node in documented(path):
                text = ast.get_docstring(node) or ""
                seen += "Args:" in text
                found += [f"{path.relative_to(ROOT)}: {fault}" for fault in faults(node, text)]
    assert not found, "\n".join(found)
    assert seen > 100


def test_it_would_see_a_fault() -> None:
    source = '''
def move(a, b):
    """Move.

    Args:
        a, b: both.
        c: not there.

    Raises:
        ValueError: one
        that goes on.
    """
'''
    (node,) = [n for n in ast.walk(ast.parse(source)) if isinstance(n, ast.FunctionDef)]
    assert len(list(faults(node, ast.get_docstring(node) or ""))) == 3
