"""Goals kept inside the limits of their servos."""

from collections.abc import Sequence


def clipped(steps: Sequence[int], limits: Sequence[tuple[int, int]]) -> list[int]:
    """Return goals inside their (lowest, highest) steps.

    Raises:
        ValueError: a goal is not a number, or there are not as many as servos.
    """
    return [
        goal if low <= goal <= high else _inside(goal, low, high)
        for goal, (low, high) in zip(steps, limits, strict=True)
    ]


def _inside(goal: float, low: int, high: int) -> int:
    if goal != goal:
        raise ValueError("a goal is not a number: every goal must be a whole number of steps")
    return low if goal < low else high
