"""Every command and every piece of YAML of the tutorial is tried, step by step."""

import runpy
import shlex
from pathlib import Path

import pytest
from command_line import invoked
from features_there import skip_without
from tutorial import commands, steps, write_files

import gazerig

pytestmark = pytest.mark.usefixtures("simulated_wires")
STEPS = range(1, len(steps()) + 1)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("step", STEPS)
def test_every_command_of_a_step_works(step: int, folder: Path):
    write_files(folder, step)
    for line in commands(step):
        words = shlex.split(line)
        if words[0] == "gazerig" and words[1] != "ctl":
            skip_without(words[1])
            tried(line, *words[1:])


def tried(line: str, *words: str) -> str:
    """Type a command, a run of it in simulated time; give what it wrote."""
    if words[0] == "run":
        words = (*_without(words, "--seconds", "--summary"), "--fast", "--seconds", "2")
    done = invoked(*words)
    assert done.code == 0, f"{line}: {done.err}"
    return done.out + done.err


def _without(words: tuple[str, ...], *options: str) -> list[str]:
    return [
        word
        for before, word in zip(("", *words), words, strict=False)
        if word not in options and before not in options
    ]


@pytest.mark.parametrize("step", [6, 7])
def test_every_command_to_a_running_head_works(
    step: int, folder: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(folder))
    write_files(folder, step)
    with gazerig.open("myhead.yaml", mock=True, say=lambda line: None) as running:
        for line in commands(step):
            words = shlex.split(line)[1:]
            if words[0] == "ctl":
                tried(line, *words)
        told = [event.text for event in running.events(timeout_s=0.0)]
        face = running.menus()["expression"][0]
    assert face == "surprised" if step == 6 else any("agree" in text for text in told)


def test_the_program_greets_the_visitor(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    opened = gazerig.open
    monkeypatch.setattr(gazerig, "open", lambda rig, mock: opened(rig, fast=mock))
    write_files(folder, 8)
    assert commands(8) == ["python greet.py"]
    runpy.run_path("greet.py", run_name="__main__")
    assert capsys.readouterr().out == "hello, 1\n"


def head(folder: Path, step: int) -> str:
    """Return the path of the head as it is after a step."""
    write_files(folder, step)
    return str(folder / "myhead.yaml")
