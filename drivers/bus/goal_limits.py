"""Goals kept inside the limits of their servos."""

from collections.abc import Sequence
from operator import le


def clip_goals(
    steps: Sequence[int], lowest: Sequence[int], highest: Sequence[int]
) -> Sequence[int]:
    """Return goals inside their ranges.

    Raises:
        ValueError: a goal is not a number, or their number is wrong.
    """
    as_many = len(steps) == len(lowest)
    if as_many and all(map(le, lowest, steps)) and all(map(le, steps, highest)):
        return steps
    return [
        goal if low <= goal <= high else _inside(goal, low, high)
        for goal, low, high in zip(steps, lowest, highest, strict=True)
    ]


def _inside(goal: float, low: int, high: int) -> int:
    if goal != goal:
        raise ValueError("a goal is not a number: every goal must be a whole number of steps")
    return low if goal < low else high
