"""Break the product on purpose, one line at a time: tests have to notice every time.

    python tests/mutants/run.py            all mutants, one after the other
    python tests/mutants/run.py scanpath   those with that word in file or effect
    python tests/mutants/run.py E17        those of a row of docs/checks.md

By hand, because it takes half an hour. Each of `ALL` replaces one piece of text, which its file
contains exactly once, in a copy of the sources. The tests that it names run on the copy, and one of
them must fail. Before that they must pass on the unchanged copy. The guard has a hundred mutants of
its own, which are cheap enough for the suite: tests/test_safety_mutants.py. The exit code is 1 if a
mutant survives or its tests fail without it.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests"))

from mutants import ALL, Mutant  # noqa: E402

COPIED = (
    "config",
    "docs",
    "doors",
    "drivers",
    "examples",
    "features",
    "gaze",
    "gazerig",
    "robot",
    "sim_mock",
    "tests",
)


def copied(to: Path) -> None:
    """Make an independent copy of sources and tests."""
    for folder in COPIED:
        passed_over = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / folder, to / folder, symlinks=True, ignore=passed_over)
    for file in ("Makefile", "pyproject.toml", "README.md", "CHANGELOG.md"):
        shutil.copy(ROOT / file, to / file)


def node(name: str) -> str:
    """Return what pytest calls a test file, or a function in it."""
    file, *function = name.split("::")
    (path,) = ROOT.glob(f"tests/**/test_{file}.py")
    return "::".join([str(path.relative_to(ROOT)), *function])


def passes(copy: Path, tests: Iterable[str]) -> bool:
    """Return whether the tests pass on the copy."""
    environ = {**os.environ, "PYTHONPATH": str(copy), "PYTHONDONTWRITEBYTECODE": "1"}
    files = [node(name) for name in tests]
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *files]
    done = subprocess.run(command, cwd=copy, env=environ, capture_output=True, text=True)
    if done.returncode not in (0, 1):
        raise SystemExit(f"{' '.join(files)}: pytest ended with {done.returncode}\n{done.stdout}")
    return done.returncode == 0


def survives(mutant: Mutant, copy: Path) -> bool:
    """Return whether no test notices."""
    path = copy / mutant.file
    source = path.read_text(encoding="utf-8")
    found = source.count(mutant.old)
    if found != 1:
        raise SystemExit(
            f"{mutant.file}: {mutant.old!r} stands there {found} times: mend its line in tests/mutants"
        )
    path.write_text(source.replace(mutant.old, mutant.new), encoding="utf-8")
    try:
        return passes(copy, mutant.tests)
    finally:
        path.write_text(source, encoding="utf-8")


def main(words: list[str]) -> int:
    """Try the mutants that have all the words; return how many were not killed."""
    chosen = [
        mutant
        for mutant in ALL
        if all(word in mutant.rows or word in f"{mutant.file} {mutant.effect}" for word in words)
    ]
    with tempfile.TemporaryDirectory(prefix="mutants-") as name:
        copy = Path(name)
        copied(copy)
        unchanged = cache(lambda tests: passes(copy, tests))
        killed = 0
        for mutant in chosen:
            if not unchanged(mutant.tests):
                result = "FAILS WITHOUT IT"
            else:
                result = "SURVIVES" if survives(mutant, copy) else "killed"
            killed += result == "killed"
            rows = "; ".join(["", *mutant.rows])
            print(f"{result:8}  {mutant.file}: {mutant.effect}{rows}", flush=True)
    print(f"{killed} of {len(chosen)} killed")
    return len(chosen) - killed


if __name__ == "__main__":
    raise SystemExit(min(1, main(sys.argv[1:])))
