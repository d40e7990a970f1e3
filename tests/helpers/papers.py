"""README and docs: their code, and the text between back-ticks."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
PAPERS = [
    ROOT / "README.md",
    *sorted((ROOT / "docs").rglob("*.md")),
    ROOT / "tests/judges/attack/README.md",
    ROOT / "examples/README.md",
]
EMULATOR = ROOT / "docs/emulator.md"


class Block(NamedTuple):
    """Code between two fences of a paper."""

    paper: Path
    language: str
    text: str


_FENCED = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks(*languages: str) -> Iterator[Block]:
    for paper in PAPERS:
        for language, text in _FENCED.findall(paper.read_text(encoding="utf-8")):
            if language in languages:
                yield Block(paper, language, text)


def prose(paper: Path) -> str:
    return _FENCED.sub("", paper.read_text(encoding="utf-8"))


def spans(paper: Path) -> list[str]:
    """Return the texts between single back-ticks, each on one line."""
    return [" ".join(span.split()) for span in re.findall(r"`([^`]+)`", prose(paper))]


def written_commands() -> dict[str, str]:
    """Return each command in a block, without what follows a #, and its paper."""
    found: dict[str, str] = {}
    for block in blocks("sh", "bash", "console", ""):
        for line in block.text.splitlines():
            match = re.match(r"(?:\$ )?(?:\.venv/bin/|uv run )?gazerig (.*)", line)
            if match:
                found.setdefault(match[1].split(" #")[0].strip(), block.paper.name)
    return found


COMMANDS = written_commands()
