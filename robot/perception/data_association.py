"""Data association: the most likely joint assignment of detections to tracks.

The cost of a pair is the distance from the track's expected position to the detection, in standard
deviations of their difference. A greedy choice of the nearest pair would exchange the detections of
two people who pass each other whenever one of them is nearer to both positions.
"""

from collections.abc import Sequence
from math import dist, inf, log, sqrt
from typing import Final

from gazerig.drivers.types import Located
from gazerig.gaze.types import Vec3
from gazerig.robot.perception.kalman import view_and_range
from gazerig.robot.perception.track import IN_SIGHT_S, BodyTrack

FORBIDDEN: Final = 1e6
"""Cost of an impossible pair; larger than the cost of all possible pairs."""
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
# The errors of successive frames are correlated (light, covers): each frame counts for this share
# of an independent one.
_CLOTHES = 0.6
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
GATE_SPEED_M_S = 1.0
"""Speed at which ``GATE_M`` widens while a track gets no detection."""
FASTEST_M_S = 4.0
"""Largest speed of a person."""
# Variance of a person's height, and its growth while the person is not seen.
_UPRIGHT_M2, _STOOPS_M_S = 0.03**2, 0.03
# Number of frames that prove that a track is not a false detection.
_PROVED = 3


def pair_costs(
    tracks: Sequence[BodyTrack],
    detections: Sequence[Located],
    p_camera: Vec3,
    clothing: Sequence[Sequence[float]] | None = None,
) -> list[list[float]]:
    """Return the cost of each pair: minus twice the log likelihood.

    A track that was unseen for long could be anywhere; without the logarithm it would match every
    detection best. If the detector numbers things in the image, its numbers take precedence: a
    detection with another number can match only within the track's own outline.

    Args:
        tracks: n tracks.
        detections: m detections in the world.
        p_camera: position of the camera.
        clothing: costs of the clothes of each pair, from ``clothing_costs``; None: no known
            clothes.

    Returns:
        n rows of m, FORBIDDEN for an impossible pair.
    """
    places = [view_and_range(found.p_m, p_camera) for found in detections]
    none = [0.0] * len(detections)
    return [
        _track_costs(track, detections, places, clothing[k] if clothing else none)
        for k, track in enumerate(tracks)
    ]


def _track_costs(
    track: BodyTrack,
    detections: Sequence[Located],
    places: Sequence[tuple[Vec3, float]],
    clothing: Sequence[float],
) -> list[float]:
    """Return the cost of one track's pair with each detection.

    Args:
        track: the track.
        detections: all detections.
        places: direction and distance of each.
        clothing: cost of the clothes of each pair.
    """
    last, known, unseen_s, person = track.detection, track.filter, track.unseen_s, track.is_person
    range_m, gone_m, in_sight = known.range_m, GATE_SPEED_M_S * unseen_s, unseen_s <= IN_SIGHT_S
    moved_m, size = 0.0 if track.is_remembered else gone_m, track.face_size or 1.0
    upright_m2 = known.across.p
    if person:
        upright_m2 = min(upright_m2, _UPRIGHT_M2 + (_STOOPS_M_S * unseen_s) ** 2)
    always = (0.0 if in_sight else _BACK) + (0.0 if track.frames >= _PROVED else _UNPROVED)
    costs = [FORBIDDEN] * len(detections)
    for j, (found, (view, far_m), worn) in enumerate(
        zip(detections, places, clothing, strict=True)
    ):
        if last.kind != found.kind:
            continue
        if not found.depth_measured and found.R_face is not None:
            far_m *= size
        wide_m = GATE_M * max(1.0, far_m)
        numbered = last.detector_id is not None and found.detector_id is not None
        other = numbered and last.detector_id != found.detector_id
        if other:
            wide_m = min(wide_m, _OUTLINE * max(last.radius_m, found.radius_m))
        alike = worn < _ALIKE and not in_sight
        if alike:
            wide_m += gone_m
        away_m = range_m * dist(known.view, view)
        if away_m > wide_m + moved_m:
            continue
        aside, ratio = away_m * away_m, (range_m / far_m) ** 2
        across = ratio * max(found.across_sd_m, _LEAST_SD_M) ** 2
        along = ratio * max(found.along_sd_m, _LEAST_SD_M) ** 2
        across_sum, along_sum = known.across.p + across, known.along.p + along
        deep = 2.0 * range_m * (far_m - range_m) / (far_m + range_m)  # nearly their log ratio
        if person and abs(deep) > FASTEST_M_S * unseen_s + _RANGE_SIGMA * sqrt(along_sum):
            continue
        deep *= deep
        surprise = ratio * (wide_m / _GATE_SIGMA) ** 2
        if not aside / (across_sum + surprise) + deep / (along_sum + surprise) <= _GATE_SIGMA**2:
            continue
        hidden = known.is_covered and not alike and (other or not numbered)
        if hidden:
            surprise = min(surprise, ratio * (_HIDDEN_M * _HIDDEN_M))
        bob = min(surprise, ratio * (_BOB_M * _BOB_M)) if person else surprise
        higher, exact = (range_m * (known.view[2] - view[2])) ** 2, across * across * along
        expected, surprising = (
            (aside - higher) / across_m2
            + higher / upright
            + deep / along_m2
            + log(across_m2 * upright * along_m2 / exact)
            for across_m2, upright, along_m2 in (
                (across_sum, upright_m2 + across, along_sum),
                (across_sum + surprise, upright_m2 + across + bob, along_sum + surprise),
            )
        )
        cost = min(expected, surprising + _SURPRISE) + always + _CLOTHES * worn
        if other:
            cost += _OTHER_MARK
        if not ((hidden or worn > 0.0) and cost > UNPAIRED):
            costs[j] = min(cost, UNPAIRED - _SLOWLY / max(cost, _NEARLY_UNPAIRED))
    return costs


def note_covered(tracks: Sequence[BodyTrack]) -> None:
    """Note in the filters which tracks are expected behind or right next to a nearer one.

    A person who is about to be hidden does not suddenly appear elsewhere: a detection there is
    another person, unless the detector gave both the same number.
    """
    for track in tracks:
        known, radius_m = track.filter, track.detection.radius_m
        far_m = _NEARER * known.range_m
        known.is_covered = any(
            other.filter.range_m < far_m
            and other is not track
            and other.unseen_s <= IN_SIGHT_S
            and dist(known.view, other.filter.view)
            < (radius_m + other.detection.radius_m) / other.filter.range_m
            for other in tracks
        )


def assign(costs: Sequence[Sequence[float]], unpaired: float = FORBIDDEN) -> list[tuple[int, int]]:
    """Return the pairs (row, column) with the smallest sum of costs.

    SciPy has this too, but its import takes half a second of CPU time at every start.

    Args:
        costs: n rows of m; FORBIDDEN or NaN for an impossible pair.
        unpaired: cost of leaving a row and a column unpaired; by default so high that the number of
            pairs is maximal.
    """
    if not costs or not costs[0]:
        return []
    finite = [[c if c < FORBIDDEN else unpaired for c in row] for row in costs]
    if len(finite) <= len(finite[0]):
        pairs = list(enumerate(_shortest_paths(finite)))
    else:
        columns = _shortest_paths([list(column) for column in zip(*finite, strict=True)])
        pairs = sorted((j, i) for i, j in enumerate(columns))
    return [(i, j) for i, j in pairs if costs[i][j] < FORBIDDEN]


def _shortest_paths(costs: list[list[float]]) -> list[int]:
    """Return the column of each row in the cheapest pairing; no fewer columns than rows.

    Each row is paired along the path of least reduced cost to a free column, which moves the rows
    on that path to their next columns. Column 0 represents the row being paired.

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
            column = min(waiting, key=length.__getitem__)
            step = length[column]
            for j in range(m + 1):
                if j in waiting:
                    length[j] -= step
                else:
                    row_price[row_of[j]] += step
                    column_price[j] -= step
            waiting.remove(column)
        while column:
            row_of[column] = row_of[before[column]]
            column = before[column]
    column_of = {row: j - 1 for j, row in enumerate(row_of)}
    return [column_of[row] for row in range(1, n + 1)]
