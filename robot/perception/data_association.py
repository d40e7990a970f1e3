"""Who is who: the pairing of tracks and sightings that is likeliest as a whole.

Taking the nearest pair first gives each of two people who pass each other the other's
sighting whenever one of them happens to be nearer to both places.
"""

from math import inf
from typing import Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

FORBIDDEN: Final = 1e6
"""Cost of a pair that cannot be; larger than that of all pairs that can."""


def assign(costs: Floats) -> list[tuple[int, int]]:
    """Return the pairs (row, column) that cost least together; as many pairs as can be.

    SciPy has this too, but loading it takes half a second of processor at every start.

    costs: (n, m), FORBIDDEN or not a number where a pair cannot be
    """
    if costs.size == 0:
        return []
    possible = costs < FORBIDDEN
    finite = np.where(possible, costs, FORBIDDEN)
    wide = finite.shape[0] <= finite.shape[1]
    columns = _shortest_paths((finite if wide else finite.T).tolist())
    pairs = list(enumerate(columns)) if wide else sorted((j, i) for i, j in enumerate(columns))
    return [(i, j) for i, j in pairs if possible[i, j]]


def _shortest_paths(costs: list[list[float]]) -> list[int]:
    """Return the column of each row in the cheapest pairing; no fewer columns than rows.

    Each row in turn is paired along the path of least reduced cost to a free column, which
    moves the rows on that path to their next columns. Column 0 stands for the row to be paired.

    Source: Jonker and Volgenant, "A shortest augmenting path algorithm for dense and sparse
    linear assignment problems" (1987).
    """
    n, m = len(costs), len(costs[0])
    row_price, column_price = [0.0] * (n + 1), [0.0] * (m + 1)
    row_of = [0] * (m + 1)  # rows count from 1, and 0 is a free column
    for row in range(1, n + 1):
        row_of[0] = row
        column, before = 0, [0] * (m + 1)
        length, waiting = [inf] * (m + 1), set(range(1, m + 1))
        while row_of[column]:
            at = row_of[column]
            for j in waiting:
                reduced = costs[at - 1][j - 1] - row_price[at] - column_price[j]
                if reduced < length[j]:
                    length[j], before[j] = reduced, column
            nearest = min(waiting, key=length.__getitem__)
            step = length[nearest]
            for j in range(m + 1):
                if j in waiting:
                    length[j] -= step
                else:
                    row_price[row_of[j]] += step
                    column_price[j] -= step
            waiting.remove(nearest)
            column = nearest
        while column:
            row_of[column] = row_of[before[column]]
            column = before[column]
    column_of = {row: j - 1 for j, row in enumerate(row_of) if j and row}
    return [column_of[row] for row in range(1, n + 1)]
