"""Tests that need the features that the package ships: skipped where a folder was deleted."""

from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import pytest

from gazerig.drivers.plugins import COMMAND, SHIPPED


def is_there(command: str) -> bool:
    """Return whether the feature of a command is there; those of the core always are."""
    module = SHIPPED[COMMAND].get(command, "gazerig.features").partition(":")[0]
    return find_spec(".".join(module.split(".")[:3])) is not None


def skip_without(command: str) -> None:
    """Skip a test of a command whose feature is not there."""
    if not is_there(command):
        pytest.skip(f"the feature of {command} is not there")


needs_all_features: Callable[[Any], Any] = pytest.mark.skipif(
    not all(map(is_there, SHIPPED[COMMAND])), reason="a feature is not there"
)
