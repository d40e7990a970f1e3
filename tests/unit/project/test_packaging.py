"""The installed package is complete, and checks are the same everywhere."""

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

from command_line import parse
from features_there import needs_all_features

ROOT = Path(__file__).parents[3]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PACKAGE = ROOT / "gazerig"
PATTERNS: list[str] = PROJECT["tool"]["setuptools"]["package-data"]["*"]
TOPS = sorted(path.parent for path in ROOT.glob("*/__init__.py") if path.parent != PACKAGE)


def packages() -> list[Path]:
    """Return every folder that is installed."""
    return sorted({path.parent for top in (PACKAGE, *TOPS) for path in top.rglob("*.py")})


def test_python_in_the_root_of_a_clone_imports_the_package():
    code = "import gazerig, gazerig.robot.model.joint as part; print(gazerig.open, part.__file__)"
    command = [sys.executable, "-I", "-c", f"import sys; sys.path.insert(0, '.'); {code}"]
    printed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert printed.strip().endswith(str(PACKAGE / "robot/model/joint.py"))


def test_every_file_that_is_not_python_is_named_as_data():
    named = {path for folder in packages() for pattern in PATTERNS for path in folder.glob(pattern)}
    for folder in packages():
        for path in folder.iterdir():
            if path.is_file() and path.suffix not in (".py", ".pyc"):
                assert path in named, f"{path.relative_to(ROOT)} would not be installed"
    data = [path for top in TOPS for path in top.rglob("*.yaml")]
    assert len(data) > 10 and named.issuperset(data)


def test_the_container_holds_all_sources_and_starts_a_command_that_is_one():
    file = (ROOT / "docs/Containerfile").read_text(encoding="utf-8")
    copied = re.findall(r"^COPY ([\w.]+) /src/([\w.]+)$", file, re.MULTILINE)
    assert {source for source, _ in copied} == {PACKAGE.name, *(top.name for top in TOPS)}
    assert all(source == target for source, target in copied)
    [beside] = re.findall(r"^COPY (.+) /src/$", file, re.MULTILINE)
    assert {
        "pyproject.toml",
        PROJECT["project"]["readme"],
        *PROJECT["project"]["license-files"],
    } == {*beside.split()}
    [start], [words] = (re.findall(rf"^{what} (.+)$", file, re.M) for what in ("ENTRYPOINT", "CMD"))
    assert json.loads(start) == list(PROJECT["project"]["scripts"])
    parse(json.loads(words))
    [python] = re.findall(r"python:([\d.]+)-slim", file)
    assert f"Programming Language :: Python :: {python}" in PROJECT["project"]["classifiers"]


@needs_all_features
def test_every_extra_that_is_named_brings_its_package_and_the_tests_have_them_all():
    named = {
        (package, extra)
        for path in ROOT.glob("[dfgr]*/**/*.py")
        for package, extra in re.findall(
            r'(?:extra_hint|require_package)\("([\w-]+)", "(\w+)"', path.read_text("utf-8")
        )
        if "docs" not in path.relative_to(ROOT).parts
    }
    assert {("depthai", "oak"), ("matplotlib", "report")} <= named
    extras = PROJECT["project"]["optional-dependencies"]
    base = " ".join(PROJECT["project"]["dependencies"])
    tested = re.search(r"gazerig\[(.+)\]", " ".join(extras["dev"]))
    assert tested is not None
    for package, extra in named:
        assert any(wanted.startswith(package) for wanted in extras[extra]), extra
        assert package not in base
        assert extra in tested[1].split(",")
