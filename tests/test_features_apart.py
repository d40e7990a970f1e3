"""Without the folders of features/ the rest runs as before, and names what is missing."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import gazerig

RUN = "run desk --mock --fast --no-page --scene visitor --seconds 0.5 --seed 0 --summary -"


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A folder with the package by links, its features left out."""
    top = tmp_path / "gazerig"
    (top / "features").mkdir(parents=True)
    for entry in Path(gazerig.__path__[0]).iterdir():
        if entry.name not in ("features", "__pycache__"):
            (top / entry.name).symlink_to(entry.resolve())
    return tmp_path


def run_command(words: str, package: Path | None = None) -> subprocess.CompletedProcess[str]:
    path = {"PYTHONPATH": str(package)} if package else {}
    main = "from gazerig.robot.cli.entry_point import main; main()"
    return subprocess.run(
        [sys.executable, "-c", main, *words.split()],
        capture_output=True, text=True, cwd=package, env={**os.environ, **path},
    )  # fmt: skip


def test_without_features_a_run_has_the_same_bytes(package: Path) -> None:
    whole, core = (json.loads(run_command(RUN, place).stdout)["bus"] for place in (None, package))
    assert core["tx_sha256"] == whole["tx_sha256"]


def test_without_features_their_commands_name_what_is_missing(package: Path) -> None:
    listed = run_command("--help", package).stdout
    assert " run " in listed and " study " not in listed
    for command in ("study", "report", "scan", "import"):
        done = run_command(f"{command} --help", package)
        assert done.returncode == 2 and "No module named 'gazerig.features." in done.stderr
