"""Rests on the parts of a face, from landing to departure, none shorter than servos can show.

Table 1 of Nakamoto & Tsuruno times the gaze within the rectangle of a part, so that a visit, with
its refixations, includes about one shift between parts. Two of the eight parts are visited for no
longer than a shift and the shortest rest of people together (0.165 and 0.173 s). They get that and
a little; the other parts give up the same total in proportion to their excess over it. So the rate
of shifts and the mean visit stay those of the table, and no rest is cut off at a shortest one.
"""

import numpy as np

from gazerig.gaze.scanpath.dwell import Draw, dwell_distribution
from gazerig.gaze.types import Floats

_LEAST_ABOVE = 0.15
"""Least mean excess of a rest over the shortest one, as a share of it."""


def stationary(matrix: Floats) -> Floats:
    """Return the share of steps that a chain spends in each of its states, (n,)."""
    # A stay at every other step changes no share, and makes every chain converge.
    lazy = 0.5 * (matrix + np.eye(len(matrix)))
    share = np.linalg.matrix_power(lazy, 1 << 20)[0]
    out: Floats = share / share.sum()
    return out


def visits_s(steps: Floats, dwell_s: Floats) -> Floats:
    """Return the mean visit of each part, its refixations included, (n,).

    steps: (n, n) transition probabilities of single dwells; a part that is never left for another
        has visits of one dwell
    """
    stays = np.diag(steps)
    visits: Floats = dwell_s / np.where(stays < 1.0, 1.0 - stays, 1.0)
    return visits


def rests_s(share: Floats, visit_s: Floats, shift_s: float, shortest_s: float) -> Floats:
    """Return the mean rest on each part, (n,).

    share: (n,) of the visits that go to each part
    visit_s: (n,) mean visits, shifts included; their overall mean is kept, unless no rest above the
        shortest one remains
    """
    above, least = visit_s - shift_s - shortest_s, _LEAST_ABOVE * shortest_s
    wanted, low, high = float(share @ above), 0.0, 1.0
    for _ in range(40):
        kept = 0.5 * (low + high)
        if share @ np.maximum(least, kept * above) > wanted:
            high = kept
        else:
            low = kept
    rests: Floats = shortest_s + np.maximum(least, low * above)
    return rests


def shift_dwell(law: str, mean_s: float, sd_s: float, shortest_s: float) -> Draw:
    """Return a dwell law that begins at a shortest time instead of at 0 and keeps the mean.

    A mean that leaves nothing above the shortest time is raised by a little.
    """
    if shortest_s <= 0.0:
        return dwell_distribution(law, mean_s, sd_s)
    above_s = max(mean_s - shortest_s, _LEAST_ABOVE * shortest_s)
    beyond = dwell_distribution(law, above_s, sd_s)
    return lambda rng: shortest_s + beyond(rng)
