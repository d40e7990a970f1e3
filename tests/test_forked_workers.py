"""Tests in forks report as from one process; a fork that dies is a failed test."""

import os
import subprocess
import sys
from collections import Counter
from functools import partial
from pathlib import Path

import pytest
from branch import Branch

TESTS = Path(__file__).parent
CONFTEST = """
import sys
sys.path.insert(0, {tests!r})
import forked_workers

def pytest_addoption(parser):
    parser.addoption("--workers", default="1")

def pytest_runtestloop(session):
    forked_workers.run(session, forked_workers.count(session.config))
    return True
"""
FIRST = """
import os, signal, warnings
import pytest

def test_passes():
    print("nobody reads this")

def test_fails():
    print("this is read")
    assert 1 + 1 == 3

def test_ends():
    os._exit(7)

def test_comes_after_it():
    warnings.warn("told on")

def test_is_killed():
    os.kill(os.getpid(), signal.SIGKILL)

def test_last(tmp_path):
    (tmp_path / "file").write_text("")
"""
OTHER = """
import pytest

@pytest.fixture(scope="module")
def broken():
    yield 1
    raise ValueError("broken at the end")

def test_skips():
    pytest.skip("for a reason")

@pytest.mark.xfail
def test_is_wrong():
    assert False

def test_passes(broken, tmp_path):
    assert list(tmp_path.iterdir()) == []
"""


def told(folder: Path, *options: str) -> str:
    """Run the tests of a folder; return pytest's output."""
    conftest = CONFTEST.format(tests=str(TESTS))
    (folder / "conftest.py").write_text(conftest, encoding="utf-8")
    (folder / "pytest.ini").write_text("[pytest]\n", encoding="utf-8")
    words = ["-q", "-rA", "-p", "no:cacheprovider", *options]
    clean = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST")}
    clean["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"  # half of the time of a start
    pipe = subprocess.PIPE
    with Branch(
        partial(pytest_alone, words), cwd=folder, env=clean, stdout=pipe, stderr=pipe, text=True
    ) as process:
        out, err = process.communicate()
    return str(out + err)


def pytest_alone(words: list[str]) -> None:
    """Run pytest as if nothing of this run of it had been imported."""
    for name in ("conftest", "forked_workers"):
        sys.modules.pop(name, None)
    sys.exit(pytest.main(words))


@pytest.mark.parametrize("workers", ["1", "2", "auto"])
def test_all_that_tests_do_is_told(tmp_path: Path, workers: str) -> None:
    (tmp_path / "test_first.py").write_text(FIRST, encoding="utf-8")
    (tmp_path / "test_other.py").write_text(OTHER, encoding="utf-8")
    words = told(tmp_path, "--workers", workers)
    counts = "3 failed, 4 passed, 1 skipped, 1 xfailed, 1 warning, 1 error"
    assert counts in words, words
    assert "the worker ended with status 7 in this test" in words
    assert "the worker ended by signal SIGKILL in this test" in words
    outcomes = Counter(line.split(" ")[0] for line in words.splitlines() if "::test_" in line)
    assert outcomes["PASSED"] == 4 and outcomes["FAILED"] == 3
    assert "this is read" in words and "assert (1 + 1) == 3" in words
    assert "told on" in words and "broken at the end" in words


def test_the_first_failure_ends_all_where_that_is_wanted(tmp_path: Path) -> None:
    (tmp_path / "test_first.py").write_text(FIRST, encoding="utf-8")
    slow = "import time\n\ndef test_takes_for_ever():\n    time.sleep(1000.0)\n"
    (tmp_path / "test_slow.py").write_text(slow, encoding="utf-8")
    words = told(tmp_path, "-x", "--workers", "2")
    assert "stopping after 1 failures" in words and "1 failed, 1 passed" in words, words


def test_a_wrong_number_is_refused(tmp_path: Path) -> None:
    (tmp_path / "test_one.py").write_text("def test_one(): pass\n", encoding="utf-8")
    assert "--workers 0: a whole number from 1 on, or auto" in told(tmp_path, "--workers", "0")
