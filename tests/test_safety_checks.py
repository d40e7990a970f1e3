"""Checks of limits, late ticks, health, torque and collisions of the guard."""

from collections.abc import Callable
from types import FunctionType, ModuleType

import guard_checks
import guard_collision_checks
import pytest

from gazerig.robot.safety import guard

CHECKS = [
    check
    for module in (guard_checks, guard_collision_checks)
    for check in vars(module).values()
    if isinstance(check, FunctionType) and check.__module__ == module.__name__
    if not check.__name__.startswith("_")
]


@pytest.mark.parametrize("check", CHECKS, ids=[check.__name__ for check in CHECKS])
def test_the_guard_passes(check: Callable[[ModuleType], None]) -> None:
    check(guard)
