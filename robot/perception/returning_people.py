"""Recognition of people who return, so that they keep their number.

The tracker looks for a person who is out of sight only at the last position. A person who appears
elsewhere keeps the number if position, time, height, size of the face and colours of the clothes
together allow it. The cost of a pair is minus twice the log of the odds that both are one person,
as in ``data_association``.
"""

from collections.abc import Sequence
from math import inf, log, log10
from typing import NamedTuple

from gazerig.drivers.types import Clothing
from gazerig.gaze.angles import norm, sub
from gazerig.gaze.types import Floats, Vec3
from gazerig.robot.perception.data_association import clothing_costs

# Cost of a return within seconds, and its increase for each factor of ten in time after that.
_SOON, _PER_DECADE, _FIRST_S = -2.75, 1.25, 10.0
# Extra cost without clothes: a stranger of the same height matches too easily.
_UNDRESSED = 0.75
# Standard deviations of a person's height from visit to visit, and of the logarithm of the size of
# a face; largest cost of either, as people sit down and faces are measured inaccurately.
_HEIGHT_SD_M, _SIZE_SD, _MOST = 0.12, 0.06, 6.0
# People may cover this distance immediately, and walk at this speed later.
_AT_ONCE_M, _WALKS_M_S = 0.5, 2.0


class SeenPerson(NamedTuple):
    """Known features of one person at one time.

    p_world_m: position of the head at ``seen_s``
    face_size: size of the face relative to an adult's, None if never measured
    colours: colours of the clothes, None if never seen
    """

    id: int
    p_world_m: Vec3
    seen_s: float
    face_size: float | None = None
    colours: Floats | None = None


def return_cost(gone: SeenPerson, new: SeenPerson) -> float:
    """Return the cost of the match of a new person and one who left; infinite if impossible."""
    gone_s = new.seen_s - gone.seen_s
    if norm(sub(gone.p_world_m, new.p_world_m)) > _AT_ONCE_M + _WALKS_M_S * gone_s:
        return inf
    cost = _SOON + _PER_DECADE * log10(1.0 + gone_s / _FIRST_S)
    cost += min(((new.p_world_m[2] - gone.p_world_m[2]) / _HEIGHT_SD_M) ** 2, _MOST)
    if gone.face_size is not None and new.face_size is not None:
        cost += min((log(new.face_size / gone.face_size) / _SIZE_SD) ** 2, _MOST)
    if gone.colours is None or new.colours is None:
        return cost + _UNDRESSED
    worn = clothing_costs([gone.colours], [Clothing(tuple(new.colours.tolist()), 1.0)])
    return cost + (worn[0][0] if worn else 0.0)


def find_returned(left: Sequence[SeenPerson], new: SeenPerson) -> SeenPerson | None:
    """Return the person who left and has returned as a new person, None if there is none."""
    costs = [return_cost(one, new) for one in left]
    return left[costs.index(min(costs))] if min(costs, default=inf) < 0.0 else None
