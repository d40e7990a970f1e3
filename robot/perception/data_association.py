"""Who is who: the pairing of tracks and sightings that is likeliest as a whole.

Taking the nearest pair first gives each of two people who pass each other the other's
sighting whenever one of them happens to be nearer to both places.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

FORBIDDEN: Final = 1e6
"""Cost of a pair that cannot be; larger than that of all pairs that can."""


def assign(costs: Floats) -> list[tuple[int, int]]:
    """Return the pairs (row, column) that cost least together; as many pairs as can be.

    costs: (n, m) at least 0, FORBIDDEN where a pair cannot be
    Source: Crouse, "On implementing 2D rectangular assignment algorithms", as in SciPy.
    """
    if costs.size == 0:
        return []
    # Loading it takes half a second, which nobody who only asks for --help should wait.
    from scipy.optimize import linear_sum_assignment

    rows, columns = linear_sum_assignment(costs)
    pairs = zip(rows.tolist(), columns.tolist(), strict=True)
    return [(i, j) for i, j in pairs if costs[i, j] < FORBIDDEN]


def get_ready() -> None:
    """Load the solver now: in the control loop it would miss a hundred ticks."""
    assign(np.zeros((1, 1)))
