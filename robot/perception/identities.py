"""Identities: people who return, or who appear from behind another, keep their numbers.

The tracker looks for a person who is out of sight only at the last position; one who appears
elsewhere keeps the number if position, time, height, size of the face and colours of the clothes
together allow it. The cost of a pair is minus twice the log of the odds that both are one person,
as in ``data_association``.
"""

from collections.abc import Sequence
from math import inf, log, log10

from gazerig.drivers.types import Clothing
from gazerig.gaze.angles import norm, sub
from gazerig.robot.perception.track import SeenPerson, clothing_costs

# Cost of a return after a time, its increase for each factor of ten in time, and the least time.
_SOON, _PER_DECADE, _FIRST_S, _LEAST_S = -2.75, 1.25, 10.0, 0.1
# Extra cost without clothes: a stranger of the same height matches too easily.
_UNDRESSED = 0.75
# Standard deviations of a person's height from visit to visit, and of the logarithm of the size of
# a face; largest cost of either, as people sit down and faces are measured inaccurately.
_HEIGHT_SD_M, _SIZE_SD, _MOST = 0.12, 0.06, 6.0
# Standard deviations of a person's position at once, and in addition per second of absence; and
# the largest distance, in them.
_AT_ONCE_SD_M, _WALKS_SD_M_S, _FARTHEST = 0.25, 1.0, 2.0


def _return_cost(gone: SeenPerson, new: SeenPerson) -> float:
    """Return the cost of the match of a new person and one who left; infinite if impossible."""
    gone_s = new.seen_s - gone.seen_s
    moved = norm(sub(gone.p_world_m, new.p_world_m)) / (_AT_ONCE_SD_M + _WALKS_SD_M_S * gone_s)
    if moved > _FARTHEST:
        return inf
    cost = moved * moved + _SOON + _PER_DECADE * log10(max(gone_s, _LEAST_S) / _FIRST_S)
    cost += min(((new.p_world_m[2] - gone.p_world_m[2]) / _HEIGHT_SD_M) ** 2, _MOST)
    if gone.face_size is not None and new.face_size is not None:
        cost += min((log(new.face_size / gone.face_size) / _SIZE_SD) ** 2, _MOST)
    if gone.colours is None or new.colours is None:
        return cost + _UNDRESSED
    worn = clothing_costs([gone.colours], [Clothing(tuple(new.colours.tolist()), 1.0)])
    return cost + (worn[0][0] if worn else 0.0)


def find_returned(left: Sequence[SeenPerson], new: SeenPerson) -> SeenPerson | None:
    """Return the person who left and has returned as a new person, None if there is none."""
    costs = [_return_cost(one, new) for one in left]
    return left[costs.index(min(costs))] if min(costs, default=inf) < 0.0 else None
