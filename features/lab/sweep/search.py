"""A search for a point with a low score, in batches of parallel runs."""

from collections.abc import Callable, Sequence

import numpy as np

from gazerig.features.lab.sweep.axes import Axis, Point, latin_shares, point_at
from gazerig.gaze.types import Floats

Scores = Callable[[Sequence[Point]], Sequence[float]]
"""Returns the score of each point; the search minimises it."""

_LEAST = 8


def search(scores: Scores, axes: Sequence[Axis], start: Point, count: int, seed: int) -> None:
    """Search for the lowest score by differential evolution (Storn & Price 1997).

    Begins with a Latin hypercube, and ``start`` if it is on the axes.

    Args:
        scores: called for whole generations.
        axes: parameters to vary.
        start: an initial point.
        count: approximate number of points, at least two generations.
        seed: of the search.
    """
    from scipy.optimize import differential_evolution  # half a second of processor

    members = max(_LEAST, 2 * len(axes))
    rng = np.random.default_rng(seed)
    first = latin_shares(len(axes), members, rng)
    if all(axis.has(start[axis.key]) for axis in axes):
        first[0] = [axis.share(start[axis.key]) for axis in axes]

    def many(columns: Floats) -> Floats:
        points = [point_at(axes, shares) for shares in np.atleast_2d(columns.T)]
        return np.array(scores(points))

    differential_evolution(
        many, [(0.0, 1.0)] * len(axes), init=first, maxiter=max(1, round(count / members) - 1),
        vectorized=True, updating="deferred", polish=False, tol=0.0, rng=rng,
    )  # fmt: skip
