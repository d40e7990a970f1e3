"""Corrections of p values for multiple tests."""

from collections.abc import Mapping
from typing import Literal

Correction = Literal["holm", "bonferroni", "none"]


def correct_p_values(chances: Mapping[str, float], by: Correction = "holm") -> dict[str, float]:
    """Return p values corrected for their number, under the same keys.

    Args:
        chances: key -> p.
        by: Holm's step-down (1979), Bonferroni's factor, or none.
    """
    if by == "none":
        return dict(chances)
    if by == "bonferroni":
        return {key: min(1.0, len(chances) * p) for key, p in chances.items()}
    ordered = sorted(chances.items(), key=lambda item: item[1])
    out, least = {}, 0.0
    for rank, (key, p) in enumerate(ordered):
        least = max(least, min(1.0, (len(ordered) - rank) * p))
        out[key] = least
    return {key: out[key] for key in chances}
