"""docs/tutorial.md as its reader follows it: files that grow, commands typed in their order."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import yaml
from papers import ROOT

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
