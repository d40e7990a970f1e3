"""Data association: the most likely joint assignment of detections to tracks.

The cost of a pair is the distance from the track's expected position to the detection, in standard
deviations of their difference. A few pairs are computed one by one, many in one array expression.
A greedy choice of the nearest pair would exchange the detections of two people who pass each other
whenever one of them is nearer to both positions.
"""

from collections.abc import Sequence
from math import inf, log, sqrt
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.types import Clothing
from gazerig.gaze.types import Floats

FORBIDDEN: Final = 1e6
"""Cost of an impossible pair; larger than the cost of all possible pairs."""
NO_MARK = -1
"""Mark of a detection without a number of its detector."""
UNPAIRED: Final = 30.0
"""Cost of an unseen track and a detection of a new person; no possible pair costs more. Without
this limit a new person would shift the other tracks, each to the position of the next."""
# Above this, costs approach that limit more and more slowly.
_NEARLY_UNPAIRED = 25.0
_SLOWLY = _NEARLY_UNPAIRED * (UNPAIRED - _NEARLY_UNPAIRED)
# A motion that no filter predicts (a lunge, a jump of the detector) happens in one frame of twenty.
# The cost is minus twice the logarithm of that probability.
_SURPRISE = 6.0
# A person out of sight is found again in one frame of ten.
_BACK = 4.6
# A detection of one or two frames is false in one case of ten, as between two people who overlap.
_UNPROVED = 4.6
# A person's height changes by at most about this in one frame.
_BOB_M = 0.1
# A person who is about to be hidden moves by at most this.
_HIDDEN_M = 0.05
# Two people at about the same distance may each hide the other.
_NEARER = 1.1
# Lower limit of measurement errors.
_LEAST_SD_M = 1e-4
# Cost of two detector numbers for one thing: 4 standard deviations.
_OTHER_MARK = 16.0
# Extent of a thing around its centre, in radii.
_OUTLINE = 1.5
# Hellinger distance of two clothes' colours at which the cost is 0, and the slopes of the cost
# below and above it. At .105, one person at two times is as frequent as two people at one time.
# Measured on people in a square (75 tracks; medians: .044 for one person, .13 for two people).
_AS_LIKELY, _NEARER_COST, _FARTHER_COST = 0.105, 55.0, 14.0
# The errors of successive frames are correlated (light, covers): each frame counts for this share
# of an independent one.
_CLOTHES = 0.6
# Clothes of which this share is visible count as fully visible.
_ENOUGH = 0.4
# A person dressed at least this similarly may have moved while out of sight, and reappear
# elsewhere.
_ALIKE = -2.0
# Largest difference of two ranges of one position, in standard deviations.
_RANGE_SIGMA = 3.0
GATE_M = 0.35
"""Largest distance between predicted and detected position across the line of sight, for distances
up to 1 m; beyond, it grows in proportion to the distance."""
_GATE_SIGMA = 4.0
"""Largest distance between them, in standard deviations of their difference."""
# Up to this number of pairs plain numbers are faster than arrays, which take as long for one pair
# as for fifty.
_FEW_PAIRS = 25


class TrackRow(NamedTuple):
    """Track in data association, as plain numbers.

    kind, mark: numbers of its kind and of the detector
    x, y, z, range_m: unit vector from the camera to its expected position, and the distance
    across_m2, along_m2: variances of its position across and along the view
    radius_m: half its size
    size: factor of distances that come from the size of a face
    moved_m: extra distance allowed because it was unseen
    in_sight: whether it was seen recently
    gone_m: extra distance allowed if the clothes match
    fastest_m: largest motion along the view since it was seen
    upright_m2: variance of its height, if smaller than that of its position
    proved: whether several frames confirm it, so that it is not a false detection
    """

    kind: int
    mark: int
    x: float
    y: float
    z: float
    range_m: float
    across_m2: float
    along_m2: float
    radius_m: float
    size: float
    moved_m: float
    in_sight: bool
    gone_m: float = 0.0
    fastest_m: float = inf
    upright_m2: float = inf
    proved: bool = True


class DetectionRow(NamedTuple):
    """Detection in data association, as plain numbers.

    kind, mark, x, y, z, range_m, radius_m: as in ``TrackRow``
    across_sd_m, along_sd_m: standard deviations of its position
    by_size: 1 if its distance comes from the size of a face, else 0
    """

    kind: int
    mark: int
    x: float
    y: float
    z: float
    range_m: float
    across_sd_m: float
    along_sd_m: float
    radius_m: float
    by_size: int


def pair_costs(
    tracks: Sequence[TrackRow],
    detections: Sequence[DetectionRow],
    clothing: Sequence[Sequence[float]] | None = None,
) -> list[list[float]]:
    """Return the cost of each pair: minus twice the log likelihood.

    A track that was unseen for long could be anywhere; without the logarithm it would match every
    detection best. If the detector numbers things in the image, its numbers take precedence: a
    detection with another number can match only within the track's own outline.

    Args:
        tracks: n tracks.
        detections: m detections.
        clothing: costs of the clothes of each pair, from ``clothing_costs``; None: no known
            clothes.

    Returns:
        n rows of m, FORBIDDEN for an impossible pair.
    """
    if len(tracks) * len(detections) > _FEW_PAIRS:
        return _all_pairs(tracks, detections, clothing)
    return [
        [
            _pair_cost(k, found, tracks, clothing[k][j] if clothing else 0.0)
            for j, found in enumerate(detections)
        ]
        for k in range(len(tracks))
    ]


def clothing_costs(
    tracks: Sequence[Floats | None], detections: Sequence[Clothing | None]
) -> list[list[float]] | None:
    """Return the cost of the clothes of each pair, below 0 if they are similar.

    Args:
        tracks: colours of n tracks, None for unknown ones.
        detections: clothes of m detections, None for invisible ones.

    Returns:
        n rows of m; None if no pair has known clothes.
    """
    rows = [k for k, colours in enumerate(tracks) if colours is not None]
    columns = [j for j, one in enumerate(detections) if one is not None]
    seen = [one for one in detections if one is not None]
    if not rows or not columns:
        return None
    alike = np.array([tracks[k] for k in rows]) @ np.array([one[0] for one in seen]).T
    apart = np.sqrt(np.maximum(0.0, 1.0 - alike)) - _AS_LIKELY
    shares = np.minimum(1.0, np.array([one[1] for one in seen]) / _ENOUGH)
    costs = np.zeros((len(tracks), len(detections)))
    costs[np.ix_(rows, columns)] = shares * np.minimum(_NEARER_COST * apart, _FARTHER_COST * apart)
    out: list[list[float]] = costs.tolist()
    return out


def _all_pairs(
    tracks: Sequence[TrackRow],
    detections: Sequence[DetectionRow],
    clothing: Sequence[Sequence[float]] | None = None,
) -> list[list[float]]:
    """Return the costs of all pairs, in array expressions."""
    t, d = np.array(tracks).T[:, :, None], np.array(detections).T
    far_m = d[5] * (1.0 + d[9] * (t[9] - 1.0))
    widest_m = GATE_M * np.maximum(1.0, far_m)
    outline_m = _OUTLINE * np.maximum(t[8], d[8])
    other = (t[1] != d[1]) & (t[1] != NO_MARK) & (d[1] != NO_MARK)
    wide_m = np.where(other, np.minimum(widest_m, outline_m), widest_m)
    worn = np.zeros(wide_m.shape) if clothing is None else np.array(clothing)
    alike = (worn < _ALIKE) & (t[11] == 0.0)
    wide_m = wide_m + t[12] * alike
    ratio = (t[5] / far_m) ** 2
    aside = t[5] * t[5] * ((t[2] - d[2]) ** 2 + (t[3] - d[3]) ** 2 + (t[4] - d[4]) ** 2)
    deep_m = 2.0 * t[5] * (far_m - t[5]) / (far_m + t[5])  # nearly the logarithm of their ratio
    deep = deep_m * deep_m
    across_sd, along_sd = np.maximum(d[6], _LEAST_SD_M), np.maximum(d[7], _LEAST_SD_M)
    across, along = ratio * across_sd * across_sd, ratio * along_sd * along_sd
    across_sum, along_sum = t[6] + across, t[7] + along
    upright_sum = np.minimum(t[6], t[14]) + across
    exact = across * across * along
    higher = t[5] * t[5] * (t[4] - d[4]) ** 2
    far = (aside - higher) / across_sum + higher / upright_sum + deep / along_sum
    expected: Floats = far + np.log(across_sum * upright_sum * along_sum / exact)
    surprise = ratio * (wide_m / _GATE_SIGMA) ** 2
    far = aside / (across_sum + surprise) + deep / (along_sum + surprise)
    hidden = _hidden_tracks(t[:, :, 0])[:, None] & ((t[1] != d[1]) | (t[1] == NO_MARK)) & ~alike
    surprise = np.where(hidden, np.minimum(surprise, ratio * (_HIDDEN_M * _HIDDEN_M)), surprise)
    across_sum, along_sum = across_sum + surprise, along_sum + surprise
    bob = np.where(t[14] == inf, inf, ratio * (_BOB_M * _BOB_M))
    upright_sum += np.minimum(surprise, bob)
    unlike = (aside - higher) / across_sum + higher / upright_sum + deep / along_sum
    surprising = unlike + np.log(across_sum * upright_sum * along_sum / exact) + _SURPRISE
    costs = np.minimum(expected, surprising) + _OTHER_MARK * other + _BACK * (t[11] == 0.0)
    costs += _UNPROVED * (t[15] == 0.0)
    costs += _CLOTHES * worn
    unlikely = (hidden | (worn > 0.0)) & (costs > UNPAIRED)
    unlikely |= np.abs(deep_m) > t[13] + _RANGE_SIGMA * np.sqrt(t[7] + along)
    costs = np.minimum(costs, UNPAIRED - _SLOWLY / np.maximum(costs, _NEARLY_UNPAIRED))
    reach = wide_m + t[10]
    costs[unlikely | (t[0] != d[0]) | (aside > reach * reach) | (far > _GATE_SIGMA**2)] = FORBIDDEN
    rows: list[list[float]] = costs.tolist()
    return rows


def _hidden_tracks(t: Floats) -> NDArray[np.bool_]:
    """Return which tracks are expected behind or right next to a nearer one.

    A person who is about to be hidden does not suddenly appear elsewhere: a detection there is
    another person, unless the detector gave both the same number.

    Args:
        t: columns of the track rows.
    """
    apart = (t[2][:, None] - t[2]) ** 2 + (t[3][:, None] - t[3]) ** 2 + (t[4][:, None] - t[4]) ** 2
    covered = (t[8] + t[8][:, None]) / t[5]
    before = (t[11] > 0.0) & (t[5] < _NEARER * t[5][:, None]) & (apart < covered * covered)
    np.fill_diagonal(before, False)
    hidden: NDArray[np.bool_] = before.any(axis=1)
    return hidden


def _pair_cost(k: int, found: DetectionRow, tracks: Sequence[TrackRow], worn: float) -> float:
    """Return the cost of track k and one detection; same rules as ``_all_pairs``."""
    kind, mark, x, y, z, range_m, across_m2, along_m2, radius_m, size, moved_m, in_sight, *_ = (
        tracks[k]
    )
    gone_m, fastest_m, upright_m2, proved = tracks[k][12:]
    its_kind, its_mark, its_x, its_y, its_z, its_m, across_sd, along_sd, its_radius_m, sized = found
    if kind != its_kind:
        return FORBIDDEN
    far_m = its_m * (1.0 + sized * (size - 1.0))
    wide_m = GATE_M * max(1.0, far_m)
    other = NO_MARK != mark != its_mark != NO_MARK
    if other:
        wide_m = min(wide_m, _OUTLINE * max(radius_m, its_radius_m))
    alike = worn < _ALIKE and not in_sight
    if alike:
        wide_m += gone_m
    dx, dy, dz = x - its_x, y - its_y, z - its_z
    aside = range_m * range_m * (dx * dx + dy * dy + dz * dz)
    reach = wide_m + moved_m
    if aside > reach * reach:
        return FORBIDDEN
    ratio = range_m / far_m
    ratio *= ratio
    deep = 2.0 * range_m * (far_m - range_m) / (far_m + range_m)  # nearly log(far_m / range_m)
    if abs(deep) > fastest_m + _RANGE_SIGMA * sqrt(along_m2 + ratio * along_sd * along_sd):
        return FORBIDDEN
    deep *= deep
    across_sd, along_sd = max(across_sd, _LEAST_SD_M), max(along_sd, _LEAST_SD_M)
    across, along = ratio * across_sd * across_sd, ratio * along_sd * along_sd
    exact = across * across * along
    wide = wide_m / _GATE_SIGMA
    surprise = ratio * (wide * wide)
    across_sum, along_sum = across_m2 + across, along_m2 + along
    most_across, most_along = across_sum + surprise, along_sum + surprise
    far = aside / most_across + deep / most_along
    if not (far <= _GATE_SIGMA * _GATE_SIGMA and across_sum > 0.0 and along_sum > 0.0):
        return FORBIDDEN  # too far away, or not finite
    upright_sum, higher = min(across_m2, upright_m2) + across, range_m * range_m * dz * dz
    cost = (aside - higher) / across_sum + higher / upright_sum + deep / along_sum
    cost += log(across_sum * upright_sum * along_sum / exact)
    hidden = not alike and (mark != its_mark or mark == NO_MARK) and _is_hidden(k, tracks)
    if hidden:
        surprise = min(surprise, ratio * (_HIDDEN_M * _HIDDEN_M))
        most_across, most_along = across_sum + surprise, along_sum + surprise
    upright_sum += min(surprise, ratio * (_BOB_M * _BOB_M) if upright_m2 < inf else inf)
    surprising = (aside - higher) / most_across + higher / upright_sum + deep / most_along
    surprising += log(most_across * upright_sum * most_along / exact) + _SURPRISE
    cost = min(cost, surprising)
    if other:
        cost += _OTHER_MARK
    if not in_sight:
        cost += _BACK
    if not proved:
        cost += _UNPROVED
    cost += _CLOTHES * worn
    if (hidden or worn > 0.0) and cost > UNPAIRED:
        return FORBIDDEN
    return min(cost, UNPAIRED - _SLOWLY / max(cost, _NEARLY_UNPAIRED))


def _is_hidden(k: int, tracks: Sequence[TrackRow]) -> bool:
    """Return whether track k is expected behind a nearer one; same rules as ``_hidden_tracks``."""
    _, _, x, y, z, range_m, _, _, radius_m, *_ = tracks[k]
    far_m = _NEARER * range_m
    for i, (_, _, its_x, its_y, its_z, its_m, _, _, its_radius_m, _, _, in_sight, *_) in enumerate(
        tracks
    ):
        if in_sight and its_m < far_m and i != k:
            dx, dy, dz = x - its_x, y - its_y, z - its_z
            covered = (its_radius_m + radius_m) / its_m
            if dx * dx + dy * dy + dz * dz < covered * covered:
                return True
    return False


def assign(costs: Sequence[Sequence[float]], unpaired: float = FORBIDDEN) -> list[tuple[int, int]]:
    """Return the pairs (row, column) with the smallest sum of costs.

    SciPy has this too, but its import takes half a second of CPU time at every start.

    Args:
        costs: n rows of m; FORBIDDEN or NaN for an impossible pair.
        unpaired: cost of leaving a row and a column unpaired; by default so high that the number of
            pairs is maximal.
    """
    if not len(costs) or not len(costs[0]):
        return []
    finite = [[c if c < FORBIDDEN else unpaired for c in row] for row in costs]
    if len(finite) == len(finite[0]) == 1:  # usually one person
        pairs = [(0, 0)]
    elif len(finite) <= len(finite[0]):
        pairs = list(enumerate(_shortest_paths(finite)))
    else:
        columns = _shortest_paths([list(column) for column in zip(*finite, strict=True)])
        pairs = sorted((j, i) for i, j in enumerate(columns))
    return [(i, j) for i, j in pairs if costs[i][j] < FORBIDDEN]


def _shortest_paths(costs: list[list[float]]) -> list[int]:
    """Return the column of each row in the cheapest pairing; no fewer columns than rows.

    Rows whose cheapest columns differ are paired with them. Each other row is paired along the path
    of least reduced cost to a free column, which moves the rows on that path to their next columns.
    Column 0 represents the row being paired.

    Source: Jonker and Volgenant, "A shortest augmenting path algorithm for dense and sparse
    linear assignment problems" (1987).
    """
    n, m = len(costs), len(costs[0])
    row_price, column_price = [0.0, *map(min, costs)], [0.0] * (m + 1)
    row_of = [0] * (m + 1)  # rows count from 1, and 0 is a free column
    waits = []
    for row in range(1, n + 1):
        cheapest = costs[row - 1].index(row_price[row]) + 1
        if row_of[cheapest]:
            waits.append(row)
        else:
            row_of[cheapest] = row
    for row in waits:
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
