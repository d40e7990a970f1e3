"""Data association: the pairing of tracks and detections that is likeliest as a whole.

Taking the nearest pair first gives each of two people who pass each other the other's
detection whenever one of them happens to be nearer to both places.
"""

from collections.abc import Sequence
from math import inf
from typing import Final

FORBIDDEN: Final = 1e6
"""Cost of a pair that cannot be; larger than that of all pairs that can."""


def assign(costs: Sequence[Sequence[float]]) -> list[tuple[int, int]]:
    """Return the pairs (row, column) that cost least together; as many pairs as can be.

    SciPy has this too, but loading it takes half a second of processor at every start.

    Args:
        costs: n rows of m, FORBIDDEN or not a number where a pair cannot be.
    """
    if not len(costs) or not len(costs[0]):
        return []
    finite = [[c if c < FORBIDDEN else FORBIDDEN for c in row] for row in costs]
    if len(finite) == len(finite[0]) == 1:  # one person, most of the time
        pairs = [(0, 0)]
    elif len(finite) <= len(finite[0]):
        pairs = list(enumerate(_shortest_paths(finite)))
    else:
        columns = _shortest_paths([list(column) for column in zip(*finite, strict=True)])
        pairs = sorted((j, i) for i, j in enumerate(columns))
    return [(i, j) for i, j in pairs if costs[i][j] < FORBIDDEN]


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
