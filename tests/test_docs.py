"""The papers of the house say what is there: names, files and figures exist."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAPERS = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").glob("*.md"))]


@cache
def defined() -> set[str]:
    """Give every name that the sources and tests define, with and without its class."""
    names: set[str] = set()
    for folder in ("config", "drivers", "gaze", "robot", "sim_mock", "tests"):
        for path in (ROOT / folder).rglob("*.py"):
            names.add(path.stem)
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.ClassDef):
                    names.add(node.name)
                    names |= {
                        f"{node.name}.{part.name}"
                        for part in node.body
                        if isinstance(part, ast.FunctionDef)
                    }
                    names |= {
                        f"{node.name}.{part.target.id}"
                        for part in node.body
                        if isinstance(part, ast.AnnAssign) and isinstance(part.target, ast.Name)
                    }
                elif isinstance(node, ast.FunctionDef):
                    names.add(node.name)
    return names


@pytest.mark.parametrize("paper", PAPERS, ids=lambda path: path.name)
def test_links_lead_somewhere(paper: Path) -> None:
    text = paper.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#]+)\)", text):
        if not target.startswith("http"):
            assert (paper.parent / target).exists(), f"{paper.name}: {target}"


@pytest.mark.parametrize("paper", PAPERS, ids=lambda path: path.name)
def test_tests_and_functions_named_exist(paper: Path) -> None:
    known = defined()
    text = paper.read_text(encoding="utf-8")
    for name in set(re.findall(r"\b(test_[a-z0-9_]+)\b", text)):
        if name != "test_e17_":
            assert name in known, f"{paper.name}: {name}"
    for name in set(re.findall(r"`([A-Z]\w+\.\w+)`", text)):
        assert name in known, f"{paper.name}: {name}"


def test_every_numbered_check_listed_is_a_test() -> None:
    listed = set(re.findall(r"^\| E(\d+) \|", (ROOT / "docs/checks.md").read_text("utf-8"), re.M))
    tested = {
        number
        for path in (ROOT / "tests").glob("test_*.py")
        for number in re.findall(r"^def test_e(\d+)_", path.read_text(encoding="utf-8"), re.M)
    }
    assert listed == tested and len(listed) >= 19


def test_the_project_speaks_of_itself_alone() -> None:
    for paper in PAPERS:
        assert "/shared" not in paper.read_text(encoding="utf-8"), paper.name
