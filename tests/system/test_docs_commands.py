"""The examples of README and docs work: commands and Python that need no head that runs."""

import re
import shlex
import tomllib
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from command_line import typed
from features_there import needs_all_features
from outside_package import install, on_path
from papers import COMMANDS, ROOT, blocks

from gazerig.drivers.plugins import find

pytestmark = needs_all_features  # the documents describe every command


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
def folder(tmp_path, monkeypatch) -> Path:
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


def test_quick_commands_work(folder, capfd):
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


DOCTOR = "doctor --mock --fix"
"""A command of which a paper shows what it prints."""


@pytest.mark.usefixtures("simulated_wires")
def test_commands_work_as_they_are_written(folder, capfd):
    (folder / "my.yaml").write_bytes((folder / "myrig.yaml").read_bytes())
    typed("study", "design", "--example", "study.yaml")
    printed = {}
    for words in commands_as_written():
        if "--example" not in words:
            code, (out, err) = typed(*shlex.split(words)), capfd.readouterr()
            assert code == 0, (words, err)
            printed[words] = [" ".join(line.split()) for line in (out + err).splitlines()]
    [block] = [block for block in blocks("") if f"$ gazerig {DOCTOR}\n" in block.text]
    for line in block.text.split("$ gazerig")[1].splitlines()[1:]:
        if line.strip() != "...":
            assert " ".join(line.split()) in printed[DOCTOR], line


HEADS = [
    block
    for block in blocks("python")
    if "gazerig.open(" in block.text and block.paper.name != "tutorial.md"
]
"""The program of the tutorial needs its rig: test_tutorial runs it."""


@pytest.mark.usefixtures("ideal_servos")
def test_python_of_papers_runs():
    """In simulated time, whatever time the paper has."""
    for block in HEADS:
        code = block.text.replace("mock=True", 'fast=True, scene="face-to-face"')
        exec(compile(code.replace("10.0)", "1.0)"), str(block.paper), "exec"), {})
    names: dict[str, Any] = {}
    [code] = [b.text for b in blocks("python") if "with PtyBuses" in b.text]
    exec(compile(code, "emulator.md", "exec"), names)
    assert names["paths"]["neck"]


def test_parts_of_a_package_are_found_by_their_registration(tmp_path):
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
