"""Rests on a face: as different as people's, with long looks at an eye, two to three a second.

Rests run from landing to departure, visits from shift to shift. Table 1 of Nakamoto & Tsuruno has
standard deviations of .14 to .38 s; its mean visits alone, .27 s, would make 3.7 shifts a second.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from human.measured_run import Figures, MeasuredRun, Runs

from gazerig.config.schema import load_rig, load_walk
from gazerig.gaze.scanpath.scanpath import steps_and_dwells

SCENE = "face-to-face"
TICK_S = 0.005
SLOT_S = 0.01
TABLE_S = {
    "DN": 0.244, "F": 0.361, "E": 0.258, "M": 0.261, "N": 0.288, "UP": 0.165,
}  # fmt: skip
"""Mean visits by eq 1 and table 1, refixations included; both sides and both eyes together."""

WANTED = {
    "largest slot of 10 ms beyond the law, %": (-1.0, 3.0),
    "rests below 150 ms, %": (0.0, 8.0),
    "mean visit over the table's, same for all parts": (1.1, 1.6),
    "mean visits off that multiple, mean over parts, s": (0.0, 0.03),
    "rests, smallest SD of a part, s": (0.12, 0.38),
    "rests, largest SD of a part, s": (0.14, 0.38),
    "rests, SD over mean": (0.5, 0.6),
    "rests above 0.5 s, %": (7.0, 13.0),
    "rests above 1 s on an eye, %": (0.3, 4.0),
    "saccades, 1/s": (2.0, 3.0),
}


class Visit(NamedTuple):
    """A visit to a part: from the shift to it until the next one; its rest."""

    part: str
    seconds: float
    rest_s: float


def visits(run: MeasuredRun) -> list[Visit]:
    """Return the visits that begin with a shift between parts of one face.

    They end with such a shift, or with a look away, which waits for the end of a rest: without
    these the longest rests would be missing most often.
    """
    flight = run.phase == "saccade"
    begins = np.flatnonzero(np.diff(run.shift) != 0) + 1
    found = []
    for begin, end in pairwise(begins.tolist()):
        away = str(run.target_name[end]).startswith("away")
        if not run.part[begin - 1] or not (run.part[end] or away):
            continue  # the face was entered, or is lost
        flown = np.flatnonzero(flight[begin:end])
        if run.part[begin] and len(flown):
            # If a target moves, later saccades catch up within the rest.
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
    params = load_rig("desk").gaze.scanpath
    walk = load_walk(params.transition_matrix)
    _, dwells = steps_and_dwells(params, walk)
    rng = np.random.default_rng(0)
    law = np.array([dwells[walk.order.index(p)](rng) for p in parts for _ in range(40)])
    # Arrival is noticed in the tick after landing, and the end in the first tick after it.
    law = (np.ceil(law / TICK_S) + 1.0) * TICK_S
    slots = np.arange(0.0, 3.0, SLOT_S) - 0.5 * TICK_S
    shares = [np.histogram(each, slots)[0] / len(each) for each in (rests_s, law)]
    return (shares[0] - shares[1]).max()


def measure(runs: Runs) -> Figures:
    """Return the figures over all seeds."""
    every_run = runs(SCENE)
    every = [visit for one in every_run for visit in visits(one)]
    rests, lasting = (np.array([getattr(v, f) for v in every]) for f in ("rest_s", "seconds"))
    names = [visit.part for visit in every]
    parts = np.array([part[0] if part in ("LE", "RE", "FL", "FR") else part for part in names])
    parts[np.isin(names, ("LE", "RE"))] = "E"
    seen = [part for part in TABLE_S if (parts == part).sum() > 10]
    table = np.array([TABLE_S[part] for part in seen])
    mean = np.array([lasting[parts == part].mean() for part in seen])
    weight = np.array([(parts == part).mean() for part in seen])
    ratio = (weight * mean).sum() / (weight * table).sum()
    sds = [rests[parts == part].std() for part in seen]
    return {
        "largest slot of 10 ms beyond the law, %": 100.0 * beyond_the_law(rests, names),
        "rests below 150 ms, %": 100.0 * (rests < 0.15 - 1e-6).mean(),
        "mean visit over the table's, same for all parts": ratio,
        "mean visits off that multiple, mean over parts, s": (
            weight * np.abs(mean - ratio * table)
        ).sum(),
        "rests, smallest SD of a part, s": min(sds),
        "rests, largest SD of a part, s": max(sds),
        "rests, SD over mean": (rests.std() / rests.mean()),
        "rests above 0.5 s, %": 100.0 * (rests > 0.5).mean(),
        "rests above 1 s on an eye, %": 100.0 * (rests[parts == "E"] > 1.0).mean(),
        "saccades, 1/s": (
            sum(one.saccades[-1] - one.saccades[0] for one in every_run)
            / sum(one.t_s[-1] - one.t_s[0] for one in every_run)
        ),
    }
