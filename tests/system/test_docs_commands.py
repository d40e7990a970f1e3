"""The examples of README and docs work: commands, options, the emulator's words, Python."""

import ast
import importlib
import inspect
import re
import shlex
import tomllib
from pathlib import Path
from types import ModuleType
from typing import Any

import cv2
import numpy as np
import pytest
from command_line import options, parse, typed
from features_there import needs_all_features
from outside_package import install, on_path
from papers import COMMANDS, EMULATOR, PAPERS, ROOT, Block, blocks, spans

import gazerig
from gazerig.drivers.plugins import find
from gazerig.robot.net.client import RobotClient

pytestmark = needs_all_features  # the documents describe every command

STANDS_FOR = {"NAME": "neck_yaw", "FILE": "a.mcap", "KEY": "seed"}
"""What to try where a paper has a word in capitals; 1 for all others."""


# ---- commands


def test_a_command_of_a_paper_is_one():
    for words in COMMANDS:
        parse(shlex.split(words))


def test_a_command_named_in_prose_is_one():
    for paper in PAPERS:
        for span in spans(paper):
            if span.startswith("gazerig "):
                words = [_tried(word) for word in span.split()[1:]]
                try:
                    parse(words)
                except ValueError as error:
                    assert "Missing " in str(error), f"{paper.name}: {span}: {error}"


def test_an_option_named_in_prose_is_one():
    of_emulator, of_all = options("emulate"), options()
    for paper in PAPERS:
        known = of_emulator if paper == EMULATOR else of_all
        for span in spans(paper):
            if not span.startswith("--"):
                continue
            for option in re.findall(r"^(--[a-z0-9-]+)|\s(--[a-z0-9-]+)", span):
                assert "".join(option) in known, f"{paper.name}: {span}"


def _tried(word: str) -> str:
    if word in STANDS_FOR:
        return STANDS_FOR[word]
    return "1" if re.fullmatch(r"[A-Z]+", word) else word


def quick_commands() -> list[str]:
    """Return the commands that need no terminal, camera or recording, of two worlds."""
    return [
        words
        for words, paper in COMMANDS.items()
        if re.match(r"run .*--mock|check ", words)
        and paper != "tutorial.md"
        and not re.search(r"--camera|--world (?!.*(living|my))", words)
    ]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Go to a folder with the files that the papers speak of."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "myrig.yaml").write_bytes((ROOT / "config/rigs/desk.yaml").read_bytes())
    for language in ("yaml", "xml"):
        for block in blocks(language):
            if block.text.startswith(("room:", "<mujoco>")):
                (tmp_path / f"myworld.{language}").write_text(block.text)
    film = cv2.VideoWriter("film.avi", cv2.VideoWriter.fourcc(*"MJPG"), 25.0, (64, 48))
    for _ in range(5):
        film.write(np.zeros((48, 64, 3), np.uint8))
    film.release()
    return tmp_path


def test_quick_commands_work(folder: Path, capfd: pytest.CaptureFixture[str]):
    for words in quick_commands():
        if words.startswith("run "):
            words = re.sub(r"--seconds \S+", "", words) + " --fast --seconds 0.05"
            if "--world" in words and "--no-pictures" not in words:
                words += " --no-pictures"
        assert typed(*shlex.split(words)) == 0, (words, capfd.readouterr().err)


AS_WRITTEN = re.compile(
    r"describe |calibrate board|models list|study design|run --help|scan --mock|doctor --mock|"
    r"jog maker .*--mock"
)
"""Commands that run as they are written, besides the quick ones."""


def commands_as_written() -> list[str]:
    """Return the further commands that are run as they are written."""
    return [
        words
        for words in COMMANDS
        if AS_WRITTEN.match(words) and words not in quick_commands() and "myhead" not in words
    ]


def test_commands_work_as_they_are_written(folder: Path, capfd: pytest.CaptureFixture[str]):
    (folder / "my.yaml").write_bytes((folder / "myrig.yaml").read_bytes())
    typed("study", "design", "--example", "study.yaml")
    for words in commands_as_written():
        if "--example" not in words:
            assert typed(*shlex.split(words)) == 0, (words, capfd.readouterr().err)


def test_a_paper_shows_what_is_printed(capfd: pytest.CaptureFixture[str]):
    words = "doctor --mock --fix"
    [block] = [block for block in blocks("") if f"$ gazerig {words}\n" in block.text]
    typed(*shlex.split(words))
    reported = "".join(capfd.readouterr())
    printed = [" ".join(line.split()) for line in reported.splitlines()]
    for line in block.text.split("$ gazerig")[1].splitlines()[1:]:
        if line.strip() != "...":
            assert " ".join(line.split()) in printed, line


def test_make_and_pip_have_what_the_papers_ask_for():
    makefile = (ROOT / "Makefile").read_text()
    made = re.findall(r"^(\w+):", makefile, re.MULTILINE)
    extras = (ROOT / "pyproject.toml").read_text()
    for paper in PAPERS:
        text = paper.read_text()
        for target in re.findall(r"(?:^|`)make (\w+)", text, re.MULTILINE):
            assert target in made, f"{paper.name}: make {target}"
        for package in re.findall(r"pip install --no-deps ([^\s'`]+)", text):
            assert f":= {package}\n" in makefile, f"{paper.name}: {package}"
        for package in re.findall(r"pip install (?!--no-deps)(?:-\w+ )?'?([^\s'`]+)", text):
            found = re.fullmatch(r"(?:\.|gazerig)(?:\[([\w,]+)\])?", package)
            assert found, f"{paper.name}: {package}"
            for extra in found[1].split(",") if found[1] else ():
                assert f"\n{extra} = [" in extras, f"{paper.name}: {package}"


# ---- Python


def test_python_of_papers_imports_what_there_is():
    for block in blocks("python"):
        _check_imports(block)


def _check_imports(block: Block) -> None:
    tree = ast.parse(block.text)
    here: dict[str, Any] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            module = importlib.import_module(node.module)
            for part in node.names:
                here[part.name] = _part(module, node.module, part.name)
    for node in ast.walk(tree):
        match node:
            case ast.Attribute(ast.Name(name), attribute) if name in here:
                assert hasattr(here[name], attribute), ast.unparse(node)
            case ast.Call(ast.Attribute(ast.Name("rig"), method), args, keywords):
                call = inspect.signature(getattr(RobotClient, method))
                call.bind(None, *args, **{str(k.arg): k.value for k in keywords})
            case ast.Call(ast.Attribute(ast.Name("head"), method), args, keywords):
                call = inspect.signature(getattr(gazerig.SimulatedHead, method))
                call.bind(None, *args, **{str(k.arg): k.value for k in keywords})
            case ast.Attribute(ast.Name("gazerig"), name):
                assert name in gazerig.__all__


def _part(module: ModuleType, path: str, name: str) -> Any:
    if hasattr(module, name):
        return getattr(module, name)
    return importlib.import_module(f"{path}.{name}")


HEADS = [
    block
    for block in blocks("python")
    if "gazerig.open(" in block.text and block.paper.name != "tutorial.md"
]
"""The program of the tutorial needs its rig: test_tutorial runs it."""


@pytest.mark.usefixtures("ideal_servos")
def test_python_that_opens_a_head_runs():
    """In simulated time, whatever time the paper has."""
    for block in HEADS:
        code = block.text.replace("mock=True", 'fast=True, scene="face-to-face"')
        exec(compile(code.replace("10.0)", "1.0)"), str(block.paper), "exec"), {})


def test_python_that_needs_no_rig_runs(capfd: pytest.CaptureFixture[str]):
    names: dict[str, Any] = {}
    [code] = [b.text for b in blocks("python") if "with PtyBuses" in b.text]
    exec(compile(code, "emulator.md", "exec"), names)
    assert names["paths"]["neck"]


def test_parts_of_a_package_are_found_by_their_registration(tmp_path: Path):
    code, registered = (
        "\n".join(
            block.text
            for block in blocks(language)
            if block.paper.name == "extend.md" and not re.search("lx16a|BusSuite", block.text)
        )
        for language in ("python", "toml")
    )
    parts = tomllib.loads(registered)["project"]["entry-points"]
    install(tmp_path, "my-package", parts, {"my_package": code})
    with on_path(tmp_path):
        for group, named in parts.items():
            assert all(find(group, name).load() for name in named)
