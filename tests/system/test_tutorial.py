"""Every command and every piece of YAML of the tutorial is tried, step by step."""

import re
import runpy
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import yaml
from command_line import invoked
from features_there import skip_without
from papers import ROOT
from slow_rigs import at_rate

import gazerig

TUTORIAL = ROOT / "docs/tutorial.md"
_BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


class Block(NamedTuple):
    """Code of one step: language, text, and the file that the words before it name last."""

    step: int
    language: str
    text: str
    file: str


def steps() -> list[str]:
    """Return the text of each step, without the text before the first."""
    text = TUTORIAL.read_text(encoding="utf-8")
    found = re.split(r"^## (\d+)\. ", text, flags=re.MULTILINE)
    assert [int(number) for number in found[1::2]] == list(range(1, len(found) // 2 + 1))
    return found[2::2]


def blocks() -> Iterator[Block]:
    """Return every block in order."""
    for number, text in enumerate(steps(), 1):
        end = 0
        for match in _BLOCK.finditer(text):
            named = re.findall(r"`([\w/]+\.(?:yaml|py|csv))`", text[end : match.start()])
            end = match.end()
            # The rest of a step's YAML belongs to the head, whose file only step 2 must name.
            file = named[-1] if named else "myhead.yaml"
            yield Block(number, match[1], match[2], file)


def commands(step: int) -> list[str]:
    """Return what a step types, without gazerig and remarks."""
    lines = [
        line
        for b in blocks()
        if b.step == step and b.language == "sh"
        for line in b.text.splitlines()
    ]
    assert all(line.startswith(("gazerig ", "python ")) for line in lines), lines
    return [line.split("  #")[0].strip() for line in lines]


def write_files(folder: Path, step: int) -> None:
    """Write the files as they are after a step."""
    for block in blocks():
        path = folder / block.file
        if block.step > step:
            return
        path.parent.mkdir(exist_ok=True)
        if block.language == "python":
            path.write_text(block.text, encoding="utf-8")
        elif block.language == "yaml":
            here = yaml.safe_load(path.read_text(encoding="utf-8")) if path.exists() else {}
            _merge(here, yaml.safe_load(block.text), path.name)
            with path.open("w", encoding="utf-8") as file:
                yaml.safe_dump(here, file, sort_keys=False)


def _merge(into: Any, more: Any, place: str) -> None:
    """Add what a block shows; what is already there is not changed by a step."""
    for key, value in more.items():
        if key not in into:
            into[key] = value
        else:
            assert isinstance(value, dict), f"{place}: {key} is in the file already"
            _merge(into[key], value, f"{place}.{key}")


pytestmark = pytest.mark.usefixtures("simulated_wires")


def at_step(folder: Path, step: int, monkeypatch) -> Path:
    """Go to an empty folder for a step."""
    here = folder / str(step)
    here.mkdir()
    monkeypatch.chdir(here)
    return here


def test_every_command_of_every_step_works(tmp_path, monkeypatch):
    for step in range(1, len(steps()) + 1):
        write_files(at_step(tmp_path, step, monkeypatch), step)
        for line in commands(step):
            words = shlex.split(line)
            if words[0] == "gazerig" and words[1] != "ctl":
                skip_without(words[1])
                tried(line, *words[1:])


def tried(line: str, *words: str) -> str:
    """Type a command, a run of it in simulated time; give what it wrote."""
    if words[0] == "run":
        words = (*_without(words, "--seconds", "--summary"), "--fast", "--seconds", "0.2")
    done = invoked(*words)
    assert done.code == 0, f"{line}: {done.err}"
    return done.out + done.err


def _without(words: tuple[str, ...], *options: str) -> list[str]:
    return [
        word
        for before, word in zip(("", *words), words, strict=False)
        if word not in options and before not in options
    ]


def test_commands_to_a_running_head_and_the_program_that_greets_work(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    for step in (6, 7):
        write_files(at_step(tmp_path, step, monkeypatch), step)
        with gazerig.open("myhead.yaml", mock=True, say=lambda line: None) as running:
            for line in commands(step):
                words = shlex.split(line)[1:]
                if words[0] == "ctl":
                    tried(line, *words)
            told = [event.text for event in running.events(timeout_s=0.0)]
            face = running.menus()["expression"][0]
        assert face == "surprised" if step == 6 else any("agree" in text for text in told)
    opened = gazerig.open
    folder = at_step(tmp_path, 8, monkeypatch)
    write_files(folder, 8)
    at_rate(folder, "myhead.yaml", 50.0)
    monkeypatch.setattr(gazerig, "open", lambda rig, mock: opened(rig, fast=mock))
    capsys.readouterr()
    assert commands(8) == ["python greet.py"]
    runpy.run_path("greet.py", run_name="__main__")
    assert capsys.readouterr().out == "hello, 1\n"
