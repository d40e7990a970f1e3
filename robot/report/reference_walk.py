"""What a walk over a face is expected to show: time on each part, visits with refixations."""

from collections.abc import Sequence

import numpy as np

from gazerig.gaze.scanpath import ScanpathParams, Walk, normalised, without_refixations
from gazerig.gaze.scanpath_dwell import dwell_distribution
from gazerig.gaze.types import PARTS, Floats
from gazerig.robot.analysis import human_norms as human

_DRAWS = 3000


class ReferenceWalk:
    """A chain of steps with a dwell each (Nakamoto & Tsuruno 3.2); staying lengthens a visit.

    Args:
        steps: (8, 8) transition probabilities in the order of PARTS, rows from.
        dwell_mean_s: mean dwell on each part.
        dwell_sd_s: its standard deviation.
        law: distribution of the dwells.
        tempo: dwells are divided by it.
        floor_s: shortest dwell.
    """

    def __init__(
        self,
        steps: Floats,
        dwell_mean_s: Sequence[float],
        dwell_sd_s: Sequence[float],
        law: str = "lognormal",
        tempo: float = 1.0,
        floor_s: float = 0.0,
    ) -> None:
        self._steps = steps
        statistics = zip(dwell_mean_s, dwell_sd_s, strict=True)
        self._laws = [dwell_distribution(law, mean, sd) for mean, sd in statistics]
        self._tempo, self._floor_s = tempo, floor_s

    def visits(self, part: int, count: int, rng: np.random.Generator) -> Floats:
        """Draw lengths of visits to a part, in s."""
        steps = rng.geometric(1.0 - self._steps[part, part], count)
        return np.array([self._dwells(part, int(n), rng).sum() for n in steps])

    def share(self, rng: np.random.Generator) -> Floats:
        """Return the share of time on each part, (8,)."""
        mean = [float(self._dwells(part, _DRAWS, rng).mean()) for part in range(len(self._laws))]
        return human.time_share(self._steps, mean)

    def _dwells(self, part: int, count: int, rng: np.random.Generator) -> Floats:
        drawn = np.array([self._laws[part](rng) for _ in range(count)])
        return np.maximum(drawn / self._tempo, self._floor_s)


def published() -> ReferenceWalk:
    """Return the walk of Nakamoto & Tsuruno, eq 1 and table 1."""
    return ReferenceWalk(human.matrix(), human.DWELL_MEAN_S, human.DWELL_SD_S)


def own(params: ScanpathParams, walk: Walk) -> ReferenceWalk | None:
    """Return the walk that a rig's parameters ask for, None where it has another model."""
    if params.model != "markov":
        return None
    merged = params.diagonal == "whole_visit"
    steps = without_refixations(walk.matrix) if merged else normalised(walk.matrix)
    order = [walk.order.index(_OTHER.get(p, p) if params.viewers_left else p) for p in PARTS]
    return ReferenceWalk(
        steps[np.ix_(order, order)],
        [walk.dwell_mean_s[i] for i in order],
        [walk.dwell_sd_s[i] for i in order],
        params.dwell_distribution,
        params.rate_scale,
        params.min_dwell_ms / 1e3,
    )


_OTHER = {"LE": "RE", "RE": "LE", "FL": "FR", "FR": "FL"}
