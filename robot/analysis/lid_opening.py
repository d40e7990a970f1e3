"""Opening of the lids of a rig."""

from collections.abc import Sequence

UPPER = ("left_upper_lid", "right_upper_lid")


LOWER = ("left_lower_lid", "right_lower_lid")


def openings(
    left: float, right: float, names: Sequence[str], pair: tuple[str, str]
) -> tuple[float, float] | None:
    """Return the openings of two lids, None without any; a single lid counts for both.

    pair: joints of the left and the right one; names: of the rig, all where empty
    """
    if not names:
        return left, right
    there = [o for name, o in zip(pair, (left, right), strict=True) if name in names]
    return (there[0], there[-1]) if there else None
