"""Allowed packages, and the completeness of pyproject.toml's contracts, which make check proves."""

import ast
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]


def packages(path: Path) -> Iterator[str]:
    """Yield the packages that a module imports."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            names = [node.module or ""]
        else:
            continue
        yield from (name.removeprefix("gazerig.").split(".")[0] for name in names)


@pytest.mark.parametrize(
    ("files", "allowed"),
    [
        ("gaze/**/*.py", {"numpy", "msgspec", "gaze", "params"}),
        ("gazerig/params.py", set()),
        ("doors/**/*.py", {"aiohttp", "livekit", "wyoming", "gazerig", "doors"}),
    ],
)
def test_what_stands_on_few_packages_imports_no_other(files, allowed):
    paths = list(ROOT.glob(files))
    assert paths
    for path in paths:
        assert set(packages(path)) <= allowed | set(sys.stdlib_module_names), path


def test_every_room_of_the_robot_has_its_storey():
    text = (ROOT / "pyproject.toml").read_text()
    contracts = tomllib.loads(text)["tool"]["importlinter"]["contracts"]
    (storeys,) = (c["layers"] for c in contracts if c["id"] == "storeys")
    named = {room.strip() for layer in storeys for room in layer.split("|")}
    rooms = {path.parent.name for path in ROOT.glob("robot/*/__init__.py")} - {"dashboard"}
    page = {path.parent.name for path in ROOT.glob("robot/dashboard/*/__init__.py")}
    modules = {path.stem for path in ROOT.glob("robot/dashboard/[a-z]*.py")}
    parts = {f"dashboard.{part}" for part in page | modules}
    assert {f"gazerig.robot.{room}" for room in rooms | parts} <= named
