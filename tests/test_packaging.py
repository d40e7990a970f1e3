"""The installed package is complete, and checks are the same everywhere."""

import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
from command_line import parse
from features_there import needs_all_features
from ruamel.yaml import YAML

import gazerig

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PACKAGE = ROOT / "gazerig"
PATTERNS: list[str] = PROJECT["tool"]["setuptools"]["package-data"]["*"]
TOPS = sorted(path.parent for path in ROOT.glob("*/__init__.py") if path.parent != PACKAGE)


def packages() -> list[Path]:
    """Return every folder that is installed."""
    return sorted({path.parent for top in (PACKAGE, *TOPS) for path in top.rglob("*.py")})


def test_the_package_links_to_every_source() -> None:
    links = {path.name: path.readlink() for path in PACKAGE.iterdir() if path.is_symlink()}
    assert links == {top.name: Path("..") / top.name for top in TOPS}
    assert len(TOPS) >= 5


def test_python_in_the_root_of_a_clone_imports_the_package() -> None:
    code = "import gazerig, gazerig.robot.model.joint as part; print(gazerig.open, part.__file__)"
    command = [sys.executable, "-I", "-c", f"import sys; sys.path.insert(0, '.'); {code}"]
    printed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert printed.strip().endswith(str(PACKAGE / "robot/model/joint.py"))


def test_every_folder_of_sources_is_a_package() -> None:
    for folder in packages():
        assert (folder / "__init__.py").is_file(), folder


def test_every_file_that_is_not_python_is_named_as_data() -> None:
    named = {path for folder in packages() for pattern in PATTERNS for path in folder.glob(pattern)}
    for folder in packages():
        for path in folder.iterdir():
            if path.is_file() and path.suffix not in (".py", ".pyc"):
                assert path in named, f"{path.relative_to(ROOT)} would not be installed"
    data = [path for top in TOPS for path in top.rglob("*.yaml")]
    assert len(data) > 10 and named.issuperset(data)


@needs_all_features
@pytest.mark.parametrize("pattern", PATTERNS)
def test_every_pattern_of_data_names_a_file(pattern: str) -> None:
    assert any(list(folder.glob(pattern)) for folder in packages())


def test_the_version_is_the_projects() -> None:
    assert gazerig.__version__ == PROJECT["project"]["version"]


def test_the_changelog_keeps_its_form() -> None:
    """https://keepachangelog.com/en/1.1.0/: releases, newest first, each with known headings."""
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    releases = re.findall(r"^## (.+)$", text, re.MULTILINE)
    assert releases and releases[-1].startswith("[0.1.0] - ")
    for release in releases:
        assert re.fullmatch(r"\[\d+\.\d+\.\d+\] - (\d{4}-\d\d-\d\d|Unreleased)", release), release
    kinds = re.findall(r"^### (.+)$", text, re.MULTILINE)
    order = ["Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"]
    assert {"Added"} <= set(kinds) <= set(order)
    for release in re.split(r"^## ", text, flags=re.MULTILINE)[1:]:
        ranks = [order.index(kind) for kind in re.findall(r"^### (.+)$", release, re.MULTILINE)]
        assert ranks == sorted(set(ranks)), release.splitlines()[0]


def yaml(name: str) -> Any:
    return YAML(typ="safe").load((ROOT / name).read_text(encoding="utf-8"))


def test_a_commit_is_checked_as_the_host_checks_it() -> None:
    """What `make check` runs is what runs before a commit, and the host runs `make check`."""
    made = (ROOT / "Makefile").read_text(encoding="utf-8").split("\ncheck:")[1].split("\n\n")[0]
    tools = re.findall(r"\$\(BIN\)/(.+)", made)
    hooks = [
        hook["entry"] for repo in yaml(".pre-commit-config.yaml")["repos"] for hook in repo["hooks"]
    ]
    assert len(tools) == len(hooks) >= 4
    for tool, hook in zip(tools, hooks, strict=True):
        words = [word for word in tool.split() if word != "."]
        assert f".venv/bin/{words[0]}" in hook, tool
        assert all(word in hook for word in words), tool
    steps = [
        step.get("run")
        for job in yaml(".github/workflows/ci.yml")["jobs"].values()
        for step in job["steps"]
    ]
    assert {"make test", "make check", "make docs", "make package"} <= set(steps)
    targets = re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    for step in steps:
        is_program = step and (ROOT / step).is_file() and os.access(ROOT / step, os.X_OK)
        assert is_program or step is None or step.removeprefix("make ").split()[0] in targets, step


def test_the_container_holds_all_sources_and_starts_a_command_that_is_one() -> None:
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


def test_every_python_that_is_promised_is_tried() -> None:
    matrix = yaml(".github/workflows/ci.yml")["jobs"]["test"]["strategy"]["matrix"]
    promised = [
        words.rpartition(" ")[2]
        for words in PROJECT["project"]["classifiers"]
        if words.startswith("Programming Language :: Python :: 3.")
    ]
    assert matrix["python"] == promised == ["3.11", "3.12", "3.13", "3.14"]
    assert PROJECT["project"]["requires-python"] == f">={promised[0]}"
    assert any(machine.endswith("-arm") for machine in matrix["machine"])
