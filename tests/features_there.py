"""Tests that need the features that the package ships: skipped where a folder was deleted."""

from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import pytest

from gazerig.drivers.plugins import COMMAND, SHIPPED


def is_there(command: str) -> bool:
    """Return whether the feature of a command is there; those of the core always are."""
    return _is_there(SHIPPED[COMMAND].get(command, "gazerig.features"))


def _is_there(part: str) -> bool:
    """Return whether the feature of a part "module:attribute" is there, or it is the core's."""
    if not part.startswith("gazerig.features."):
        return True
    return find_spec(".".join(part.partition(":")[0].split(".")[:3])) is not None


def skip_without_part(part: str) -> None:
    """Skip a test of a part "module:attribute" whose feature is not there."""
    if not _is_there(part):
        pytest.skip(f"the feature of {part} is not there")


def skip_without(command: str) -> None:
    """Skip a test of a command whose feature is not there."""
    if not is_there(command):
        pytest.skip(f"the feature of {command} is not there")


needs_all_features: Callable[[Any], Any] = pytest.mark.skipif(
    not all(map(is_there, SHIPPED[COMMAND])), reason="a feature is not there"
)
