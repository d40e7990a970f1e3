"""What is installed is all there is, and what is checked is the same wherever it is checked."""

import json
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
from command_line import parse
from ruamel.yaml import YAML

import gazerig

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PACKAGES: list[str] = PROJECT["tool"]["setuptools"]["packages"]
FOLDERS: dict[str, str] = PROJECT["tool"]["setuptools"]["package-dir"]
DATA: dict[str, list[str]] = PROJECT["tool"]["setuptools"]["package-data"]


def source_folders() -> dict[str, Path]:
    """Return every folder with Python sources under its import name."""
    return {
        ".".join((package, *folder.relative_to(ROOT / root).parts)): folder
        for package, root in FOLDERS.items()
        for folder in sorted({path.parent for path in (ROOT / root).rglob("*.py")})
    }


def test_every_folder_of_sources_is_a_package_and_every_package_is_there() -> None:
    assert sorted(PACKAGES) == sorted(source_folders())
    assert len(PACKAGES) > 30


def test_every_top_folder_of_sources_is_mapped() -> None:
    beside = {path.parent.name for path in ROOT.glob("*/__init__.py")}
    assert beside == set(FOLDERS.values())


def test_every_file_that_is_not_python_is_named_as_data() -> None:
    for package, folder in source_folders().items():
        for path in folder.iterdir():
            if path.is_file() and path.suffix not in (".py", ".pyc"):
                assert covered(package, path), f"{path.relative_to(ROOT)} would not be installed"
    data = [path for root in FOLDERS.values() for path in (ROOT / root).rglob("*.yaml")]
    assert len(data) > 10
    for path in data:
        feature = path.is_relative_to(ROOT / "features")
        assert covered("gazerig.features.study" if feature else "gazerig.config", path), path


def covered(package: str, path: Path) -> bool:
    """Return whether a pattern of the package or of one above it names the file."""
    while True:
        folder = source_folders()[package]
        if any(path in folder.glob(pattern) for pattern in DATA.get(package, [])):
            return True
        if package in FOLDERS:
            return False
        package = package.rpartition(".")[0]


@pytest.mark.parametrize("package", DATA)
def test_every_pattern_of_data_names_a_file(package: str) -> None:
    for pattern in DATA[package]:
        assert list(source_folders()[package].glob(pattern)), f"{package}: {pattern}"


def test_the_version_is_the_projects() -> None:
    assert gazerig.__version__ == PROJECT["project"]["version"]


def test_the_changelog_keeps_its_form() -> None:
    """https://keepachangelog.com/en/1.1.0/: releases, newest first, each with known headings."""
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    releases = re.findall(r"^## (.+)$", text, re.MULTILINE)
    assert releases and releases[0] == "[Unreleased]"
    for release in releases[1:]:
        assert re.fullmatch(r"\[\d+\.\d+\.\d+\] - \d{4}-\d\d-\d\d", release), release
    kinds = re.findall(r"^### (.+)$", text, re.MULTILINE)
    order = ["Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"]
    assert {"Added", "Changed", "Fixed"} <= set(kinds) <= set(order)
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
    assert {"make test", "make check", "make docs", "make coverage", "make package"} <= set(steps)
    targets = re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    for step in steps:
        assert step is None or step.removeprefix("make ") in targets, step


def test_the_container_holds_all_sources_and_starts_a_command_that_is_one() -> None:
    file = (ROOT / "docs/Containerfile").read_text(encoding="utf-8")
    copied = re.findall(r"^COPY (\w+) /src/(\w+)$", file, re.MULTILINE)
    assert {source for source, _ in copied} == set(FOLDERS.values())
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
