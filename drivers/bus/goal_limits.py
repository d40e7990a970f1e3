"""Goals kept inside the limits of their servos."""

from collections.abc import Sequence
from math import isnan
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # the guardian starts without numpy
    from gazerig.drivers.types import ServoConfig


def clip_goals(steps: Sequence[float], lowest: Sequence[int], highest: Sequence[int]) -> list[int]:
    """Return goals as whole steps inside their ranges.

    Raises:
        ValueError: a goal is not a number, or their number is wrong.
    """
    if len(steps) != len(lowest):
        raise ValueError(f"{len(steps)} goals for {len(lowest)} servos")
    if isnan(sum(steps)):
        raise ValueError("a goal is not a number: every goal must be a whole number of steps")
    return list(map(round, map(min, map(max, steps, lowest), highest)))


ENTRY_DEG_S = 30.0
"""Speed of a joint that returns into its limits."""

FAR_DEG = 10.0
"""Distance of a joint outside its range from which its measured angle is not believed."""

FAR_CAUSES = "a slipped horn, a changed homing offset or extended position mode?"
"""Likely causes of such an angle, for messages."""


def far_outside_steps(setup: "ServoConfig", steps: float) -> str:
    """Return where a servo is, if it is too far outside its limits for torque; else ""."""
    if setup.min_steps - setup.far_steps <= steps <= setup.max_steps + setup.far_steps:
        return ""
    limits = f"{setup.min_steps}..{setup.max_steps}"
    return f"is at step {steps:.0f}, far outside its range {limits}: {FAR_CAUSES}"


def entry_speed_steps_s(setup: "ServoConfig", steps_per_turn: float) -> float:
    """Return the speed of a servo that returns into its limits: never above its top speed."""
    wanted = setup.entry_speed_steps_s
    slow = ENTRY_DEG_S / 360.0 * steps_per_turn if wanted is None else wanted
    return min(slow, setup.max_speed_steps_s)
