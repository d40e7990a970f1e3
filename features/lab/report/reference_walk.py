"""Expected results of a walk over a face: time on each part, visits with refixations."""

from collections.abc import Sequence

import numpy as np

from gazerig.gaze.scanpath.dwell import Draw, dwell_distribution
from gazerig.gaze.scanpath.scanpath import ScanpathParams, Walk, steps_and_dwells
from gazerig.gaze.types import PARTS, Floats
from gazerig.robot.analysis import human_norms as human

_DRAWS = 3000


class ReferenceWalk:
    """A chain of steps with a dwell each (Nakamoto & Tsuruno 3.2); staying lengthens a visit.

    Args:
        steps: (8, 8) transition probabilities in the order of PARTS, rows from.
        dwells: the dwell law of each part.
    """

    def __init__(self, steps: Floats, dwells: Sequence[Draw]) -> None:
        self._steps, self._laws = steps, tuple(dwells)

    def visits(self, part: int, count: int, rng: np.random.Generator) -> Floats:
        """Draw lengths of visits to a part, in s."""
        steps = rng.geometric(1.0 - self._steps[part, part], count)
        return np.array([self._dwells(part, int(n), rng).sum() for n in steps])

    def share(self, rng: np.random.Generator) -> Floats:
        """Return the share of time on each part, (8,)."""
        mean = [float(self._dwells(part, _DRAWS, rng).mean()) for part in range(len(self._laws))]
        return human.time_share(self._steps, mean)

    def _dwells(self, part: int, count: int, rng: np.random.Generator) -> Floats:
        return np.array([self._laws[part](rng) for _ in range(count)])


def published_walk() -> ReferenceWalk:
    """Return the walk of Nakamoto & Tsuruno, eq 1 and table 1."""
    table = zip(human.DWELL_MEAN_S, human.DWELL_SD_S, strict=True)
    return ReferenceWalk(
        human.matrix(), [dwell_distribution("lognormal", mean, sd) for mean, sd in table]
    )


def rig_walk(params: ScanpathParams, walk: Walk) -> ReferenceWalk | None:
    """Return the walk of a rig's parameters, None for another scanpath model."""
    if params.model != "markov":
        return None
    steps, dwells = steps_and_dwells(params, walk)
    order = [walk.order.index(_OTHER.get(p, p) if params.viewers_left else p) for p in PARTS]
    return ReferenceWalk(steps[np.ix_(order, order)], [dwells[i] for i in order])


_OTHER = {"LE": "RE", "RE": "LE", "FL": "FR", "FR": "FL"}
