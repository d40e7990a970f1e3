"""MuJoCo, which reads and moves worlds: tests that need it are skipped without it."""

from typing import Any

import pytest


@pytest.fixture(scope="session")
def mujoco() -> Any:
    return pytest.importorskip("mujoco", reason="worlds need MuJoCo: pip install 'gazerig[world]'")
