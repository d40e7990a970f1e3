"""CI's browser: installed where apt can, and never a reason to fail."""

import shutil
import subprocess
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[1] / ".ci/browser"


def run_with(folder: Path, **programs: str) -> tuple[str, list[str]]:
    """Run it with these programs in the path alone; return its last line and apt's calls."""
    for name in ("bash", "env", "id", "sh", "timeout"):
        (folder / name).symlink_to(str(shutil.which(name)))
    for name, text in {"sudo": 'shift; exec "$@"', **programs}.items():
        (folder / name).write_text(f'#!/bin/sh\necho "$@" >> {folder}/calls\n{text}\n')
        (folder / name).chmod(0o755)
    done = subprocess.run(
        [str(SCRIPT)], env={"PATH": str(folder)}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0
    calls = folder / "calls"
    lines = calls.read_text().splitlines() if calls.exists() else []
    return done.stderr.strip(), [line for line in lines if line.startswith(("update", "install"))]


def test_a_browser_is_installed_where_there_is_none_and_apt_can(tmp_path: Path) -> None:
    said, calls = run_with(tmp_path, **{"apt-get": "exit 0"})
    assert said == "installed chromium for the tests of the page"
    assert calls == ["update -qq", "install -qq -y --no-install-recommends chromium"]


@pytest.mark.parametrize("apt", [{}, {"apt-get": "exit 100"}], ids=["no apt", "no network"])
def test_without_apt_or_network_ci_goes_on_without(tmp_path: Path, apt: dict[str, str]) -> None:
    said, _ = run_with(tmp_path, **apt)
    assert said == "without a browser: the tests of the page in Chromium are skipped"


def test_nothing_is_installed_where_there_is_a_browser(tmp_path: Path) -> None:
    assert run_with(tmp_path, chromium="exit 0", **{"apt-get": "exit 0"}) == ("", [])
