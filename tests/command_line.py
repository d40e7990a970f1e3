"""gazerig as it is typed: in a process of its own, or in this one, which saves its start."""

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import pytest

from robot.cli.main import main

_START = "import sys; from robot.cli.main import main; sys.argv[0] = 'gazerig'; main()"
GAZERIG = [sys.executable, "-c", _START]


def gazerig(*words: str, timeout: float = 120.0) -> subprocess.CompletedProcess[str]:
    """Run a command in a process of its own."""
    return subprocess.run(
        [*GAZERIG, *words], capture_output=True, text=True, timeout=timeout, check=False
    )


def typed(*words: str) -> int:
    """Run a command in this process; give its exit code. What it writes goes to capfd."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["gazerig", *words])
        try:
            main()
        except SystemExit as end:
            assert end.code is None or isinstance(end.code, int), end.code
            return end.code or 0
    return 0


def figures(*words: str) -> dict[str, Any]:
    """Run in simulated time in this process; give the figures that --summary writes."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "summary.json"
        assert typed("run", "--mock", "--fast", "--summary", str(file), *words) == 0
        parsed: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return parsed
