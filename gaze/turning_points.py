"""Turning points of a sampled motion."""

from gazerig.gaze.types import Floats


def turning_points(values: Floats, least: float) -> list[int]:
    """Return the indices of alternate maxima and minima that differ by more than ``least``."""
    turns: list[int] = []
    high = low = 0
    heading = 0
    for i, value in enumerate(values):
        high = i if value > values[high] else high
        low = i if value < values[low] else low
        if heading >= 0 and values[high] - value > least:
            turns += [high] if high and heading else []
            heading, low = -1, i
        elif heading <= 0 and value - values[low] > least:
            turns += [low] if low and heading else []
            heading, high = 1, i
    return turns
