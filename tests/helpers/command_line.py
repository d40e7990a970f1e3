"""gazerig as it is typed: in a process of its own, or in this one, which saves its start."""

import functools
import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import typer
import typer.testing
from typer.core import TyperGroup
from typer.testing import CliRunner

from gazerig.robot.cli.main import app, main

# Each call in one process would build all commands again; a shell builds them once.
_once = functools.cache(typer.main.get_command)
for _module, _name in ((typer.main, "get_command"), (typer.testing, "_get_command")):
    setattr(_module, _name, _once)

_START = "import sys; from gazerig.robot.cli.main import main; sys.argv[0] = 'gazerig'; main()"
GAZERIG = [sys.executable, "-c", _START]


def gazerig(*words: str, timeout: float = 120.0) -> subprocess.CompletedProcess[str]:
    """Run a command in a process of its own."""
    return subprocess.run(
        [*GAZERIG, *words], capture_output=True, text=True, timeout=timeout, check=False
    )


def typed(*words: str) -> int:
    """Run a command in this process; return its exit code. Its output goes to capfd."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["gazerig", *words])
        try:
            main()
        except SystemExit as end:
            assert end.code is None or isinstance(end.code, int), end.code
            return end.code or 0
    return 0


class Invoked(NamedTuple):
    """Result of a command: its exit code, standard output and standard error."""

    code: int
    out: str
    err: str


def invoked(*words: str, answers: str = "") -> Invoked:
    """Run a command in this process; answers: lines on its standard input."""
    result = CliRunner().invoke(app, list(words), input=answers)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return Invoked(result.exit_code, result.stdout, result.stderr)


def answers_in(folder: Path, *lines: str) -> str:
    """Write a file for --answers; give its path."""
    file = folder / "answers"
    file.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
    return str(file)


def parse(words: Sequence[str]) -> None:
    """Read a command as the program would, and do nothing."""
    command, rest = typer.main.get_command(app), [word for word in words if word != "--help"]
    while isinstance(command, TyperGroup):
        if not rest or rest[0] not in command.commands:
            default = getattr(command, "default", None)  # of calibrate: joints
            if default is None:
                raise ValueError(f"no command {rest[:1]}; there is {', '.join(command.commands)}")
            rest.insert(0, default)
        command = command.commands[rest.pop(0)]
    # Not with resilient_parsing, which swallows options that there are not.
    try:
        command.make_context(command.name, rest)
    except Exception as error:  # whatever class this version of typer has for it
        raise ValueError(f"{' '.join(words)}: {error}") from error


def options(of: str = "") -> set[str]:
    """Return the options of a command, or of all."""
    found: set[str] = set()
    group = typer.main.get_command(app)
    assert isinstance(group, TyperGroup)
    waiting = [command for name, command in group.commands.items() if of in ("", name)]
    for command in waiting:
        opts = {o for param in command.params for o in param.opts}
        found |= {"--help", *(o for o in opts if o.startswith("-"))}
        found |= {o for param in command.params for o in param.secondary_opts}
        if isinstance(command, TyperGroup):
            waiting.extend(command.commands.values())
    return found


def figures(*words: str) -> dict[str, Any]:
    """Run in simulated time in this process; give the figures that --summary writes."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "summary.json"
        assert typed("run", "--mock", "--fast", "--summary", str(file), *words) == 0
        parsed: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return parsed
