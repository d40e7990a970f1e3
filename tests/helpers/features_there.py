"""Tests that need the features that the package ships: skipped if a folder was deleted."""

import shutil
from collections.abc import Callable
from functools import cache
from importlib.util import find_spec
from typing import Any

import pytest

from gazerig.drivers.plugins import COMMAND, SHIPPED

_PARTS = [part for parts in SHIPPED.values() for part in parts.values()]


@cache
def is_there(part: str) -> bool:
    """Return whether the feature of a part "module:attribute" is there, or it is the core's."""
    if not part.startswith("gazerig.features."):
        return True
    return find_spec(".".join(part.partition(":")[0].split(".")[:3])) is not None


def skip_without_part(part: str) -> None:
    """Skip a test of a part "module:attribute" whose feature is not there."""
    if not is_there(part):
        pytest.skip(f"the feature of {part} is not there")


def skip_without(command: str) -> None:
    """Skip a test of a command whose feature is not there; those of the core always are."""
    skip_without_part(SHIPPED[COMMAND].get(command, ""))


EVERY_FEATURE = all(map(is_there, _PARTS))
"""Whether no feature was deleted."""

needs_all_features: Callable[[Any], Any] = pytest.mark.skipif(
    not EVERY_FEATURE, reason="a feature is not there"
)


needs_espeak = pytest.mark.skipif(
    shutil.which("espeak-ng") is None, reason="espeak-ng is not installed: apt install espeak-ng"
)
