"""Processes that run side by side compile the modules together.

In a fresh checkout all of the product is compiled and the assertions of the tests are rewritten,
eleven seconds of processor time. Here each process goes through the files in an order of its own
and leaves out what another has written meanwhile, so that nearly all of it is done once.
"""

import importlib.util
import py_compile
import random
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

import pytest
from _pytest.assertion import rewrite

ROOT = Path(__file__).resolve().parents[1]
ROOMS = ("config", "doors", "drivers", "features", "gaze", "gazerig", "robot", "sim_mock")


def compile_missing(worker: str, config: pytest.Config) -> None:
    """Write the compiled files of pytest and Python for each module without them."""
    tests = ROOT.glob("tests/**/test_*.py")
    for file in order_of(worker, tests):
        cached = rewrite.get_cache_dir(file) / (file.stem + rewrite.PYC_TAIL)
        if not cached.exists() and rewrite.try_makedirs(cached.parent):
            source_hash, code = rewrite._rewrite_test(file, config)
            rewrite._write_pyc(config.stash[rewrite.assertstate_key], code, source_hash, cached)
    modules = (file for room in ROOMS for file in ROOT.glob(f"{room}/**/*.py"))
    for file in order_of(worker, modules):
        if not Path(importlib.util.cache_from_source(str(file))).exists():
            # Another worker may write the same one right now, under the same temporary name.
            with suppress(FileExistsError):
                py_compile.compile(str(file))


def order_of(worker: str, files: Iterable[Path]) -> list[Path]:
    """Return the files in the order of one worker; no two follow each other for long."""
    ordered = sorted(files)
    random.Random(worker).shuffle(ordered)
    return ordered
