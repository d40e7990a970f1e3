"""Rests on a face: spread as by their law, rarely short, at the rate of the paper's table 1.

Rests run from landing to departure. Visits run from shift to shift, as the table timed the gaze
within the rectangle of a part, with the shift that leads there.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from human.measured_run import MeasuredRun, Runner

from gazerig.config.schema import load_rig, load_walk
from gazerig.gaze.scanpath.scanpath import steps_and_dwells

SCENE = "face-to-face"
TICK_S = 0.005
SLOT_S = 0.01
TABLE_S = {
    "DN": 0.244, "FL": 0.480, "LE": 0.173, "M": 0.261, "N": 0.288, "FR": 0.286, "RE": 0.286, "UP": 0.165,
}  # fmt: skip
"""Mean visits by eq 1 and table 1, refixations included."""

WANTED = {
    "largest slot of 10 ms beyond the law, %": (-1.0, 3.0),
    "rests below 150 ms, %": (0.0, 8.0),
    "mean visit, s": (0.26, 0.283),
    "shifts on the face, 1/s": (3.53, 3.85),
    "visits off the table, mean over parts, s": (0.0, 0.02),
}


class Visit(NamedTuple):
    """A visit to a part: from the shift that leads there to the next; its rest."""

    part: str
    seconds: float
    rest_s: float


def visits(run: MeasuredRun) -> list[Visit]:
    """Return the visits that begin and end with a shift between parts of one face."""
    flight = run.phase == "saccade"
    begins = np.flatnonzero(np.diff(run.shift) != 0) + 1
    found = []
    for begin, end in pairwise(begins.tolist()):
        if not run.part[begin - 1] or not run.part[end]:
            continue  # the face was entered, or is left
        flown = np.flatnonzero(flight[begin:end])
        if run.part[begin] and len(flown):
            # Where a target moves, later saccades catch up within the rest.
            landed = begin + int(np.argmin(flight[begin + flown[0] : end])) + flown[0]
            found.append(
                Visit(
                    str(run.part[begin]),
                    float(run.t_s[end] - run.t_s[begin]),
                    float(run.t_s[end] - run.t_s[landed]),
                )
            )
    return found


def beyond_the_law(rests_s: np.ndarray, parts: Sequence[str]) -> float:
    """Return the largest share of rests in a slot beyond that of the law for the same parts."""
    walk, params = load_walk("nakamoto_tsuruno"), load_rig("desk").gaze.scanpath
    _, dwells = steps_and_dwells(params, walk)
    rng = np.random.default_rng(0)
    law = np.array([dwells[walk.order.index(p)](rng) for p in parts for _ in range(40)])
    # Arrival is noticed in the tick after landing, and the end in the first tick after it.
    law = (np.ceil(law / TICK_S) + 1.0) * TICK_S
    slots = np.arange(0.0, 3.0, SLOT_S) - 0.5 * TICK_S
    shares = [np.histogram(each, slots)[0] / len(each) for each in (rests_s, law)]
    return float((shares[0] - shares[1]).max())


def measure(run: Runner, seconds: float, seeds: Sequence[int]) -> dict[str, float]:
    """Return the figures over all seeds."""
    runs = [run(SCENE, seed=seed, seconds=seconds) for seed in seeds]
    every = [visit for one in runs for visit in visits(one)]
    rests, lasting = (np.array([getattr(v, f) for v in every]) for f in ("rest_s", "seconds"))
    parts = np.array([visit.part for visit in every])
    off = [
        abs(lasting[parts == part].mean() - wanted) * (parts == part).mean()
        for part, wanted in TABLE_S.items()
        if (parts == part).any()
    ]
    return {
        "largest slot of 10 ms beyond the law, %": 100.0 * beyond_the_law(rests, parts.tolist()),
        "rests below 150 ms, %": 100.0 * float((rests < 0.15 - 1e-6).mean()),
        "mean visit, s": float(lasting.mean()),
        "shifts on the face, 1/s": len(lasting) / float(lasting.sum()),
        "visits off the table, mean over parts, s": float(sum(off)),
        "rests": float(len(rests)),
        "mean rest, s": float(rests.mean()),
        "shortest rest, s": float(rests.min()),
    }
