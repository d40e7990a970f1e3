"""The program without a feature: all other modules import, help lists the rest, same bus bytes.

Run by hand: ``python tests/features_apart.py`` does so for each folder of features/;
``--suite NAME`` deletes the folder with its tests and pages in a clone, and runs all other tests
there.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FEATURES = tuple(sorted(path.parent.name for path in ROOT.glob("features/*/__init__.py")))
NEEDS = {"study": ("lab",)}
"""Feature -> the features that it imports."""

_MAIN = "from gazerig.robot.cli.entry_point import main; main()"
_IMPORT_ALL = """
import importlib, pkgutil, gazerig
def fail(name): raise ImportError(name)
for found in pkgutil.walk_packages(gazerig.__path__, "gazerig.", fail):
    importlib.import_module(found.name)
    print(found.name)
"""


def removed_with(feature: str) -> tuple[str, ...]:
    """Return a feature and those that need it."""
    return (feature, *(name for name, needed in NEEDS.items() if feature in needed))


def lay_out(folder: Path, removed: tuple[str, ...] = ()) -> Path:
    """Write the package into a folder, by links and without some features; return the folder."""
    top = folder / "gazerig"
    (top / "features").mkdir(parents=True)
    for link in (ROOT / "gazerig").iterdir():
        if link.name != "features":
            (top / link.name).symlink_to(link.resolve())
    for path in (ROOT / "features").iterdir():
        if path.name not in removed:
            (top / "features" / path.name).symlink_to(path)
    return folder


def python(package: Path, code: str, *words: str) -> subprocess.CompletedProcess[str]:
    """Run Python with the package of a folder."""
    return subprocess.run(
        [sys.executable, "-c", code, *words], capture_output=True, text=True, check=False,
        cwd=package, env={**os.environ, "PYTHONPATH": str(package), "COLUMNS": "120"},
    )  # fmt: skip


def gazerig(package: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Run a command with the package of a folder."""
    return python(package, _MAIN, *words)


def imported(package: Path) -> list[str]:
    """Import every module; return their names."""
    done = python(package, _IMPORT_ALL)
    if done.returncode:
        raise RuntimeError(done.stderr)
    return done.stdout.split()


def bus_digest(
    package: Path, seconds: float, place: tuple[str, ...] = ("--scene", "visitor")
) -> str:
    """Return the SHA-256 of all bytes that a simulated run sends to its servos."""
    options = ("--mock", "--fast", "--no-page", *place, "--summary", "-")
    done = gazerig(package, "run", "desk", *options, "--seconds", str(seconds), "--seed", "0")
    if done.returncode not in (0, 1) or "{" not in done.stdout:
        raise RuntimeError(done.stderr)
    return str(json.loads(done.stdout[done.stdout.index("{") :])["bus"]["tx_sha256"])


def suite(feature: str) -> int:
    """Delete a feature, its tests and pages in a clone; return the exit code of the other tests."""
    with tempfile.TemporaryDirectory() as temporary:
        clone = Path(temporary) / "clone"
        subprocess.run(["git", "clone", "-q", str(ROOT), str(clone)], check=True)
        for name in removed_with(feature):
            for folder in ("features", "tests", "docs"):
                shutil.rmtree(clone / folder / name)
        return subprocess.run(
            [sys.executable, "-m", "pytest", "-n", "auto", "--dist", "loadfile"],
            cwd=clone,
            env={**os.environ, "PYTHONPATH": str(clone)},
        ).returncode


def main() -> int:
    """Check each feature; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--suite", choices=FEATURES, help="delete it, and run all other tests")
    wanted = parser.parse_args().suite
    if wanted:
        return suite(wanted)
    faults = 0
    with tempfile.TemporaryDirectory() as temporary:
        whole = lay_out(Path(temporary) / "whole")
        pinned = bus_digest(whole, 5.0)
        every = len(imported(whole))
        for feature in FEATURES:
            package = lay_out(Path(temporary) / feature, removed_with(feature))
            without = " and ".join(removed_with(feature))
            try:
                modules = len(imported(package))
                same = bus_digest(package, 5.0) == pinned
                helped = gazerig(package, "--help").returncode == 0
            except RuntimeError as error:
                print(f"without {without}: {error}")
                faults += 1
                continue
            faults += not (same and helped)
            print(
                f"without {without}: {modules} of {every} modules import; bus bytes "
                f"{'the same' if same else 'DIFFER'}; --help {'works' if helped else 'FAILS'}"
            )
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
