"""Identities of people: numbers that were confused, and people who return.

Clothes restore the numbers of people who were confused while hidden. The tracker looks for a person
who is out of sight only at the last position; one who appears elsewhere keeps the number if
position, time, height, size of the face and colours of the clothes together allow it. The cost of a
pair is minus twice the log of the odds that both are one person, as in ``data_association``.
"""

from collections.abc import Sequence
from math import inf, log, log10, sqrt

from gazerig.drivers.types import Clothing, Located
from gazerig.gaze.angles import norm, sub
from gazerig.robot.perception.data_association import FORBIDDEN, GATE_M, GATE_SPEED_M_S, assign
from gazerig.robot.perception.track import (
    IN_SIGHT_S,
    BodyTrack,
    KnownClothes,
    SeenPerson,
    clothing_costs,
)

# Number of frames with clothes after which they identify a person; number below which the person
# may be one who returned.
_CLOTHES_PROVED, _OWN = 3, 60
# Number of frames that confirm a person's clothes; largest number that counts; cost above which
# clothes do not match.
_CONFIRMED, _MOST_CONFIRMED, _MISFITS = 3.0, 6.0, 2.0
# Cost below which clothes match; advantage, summed over frames, at which two people exchange their
# numbers; largest advantage of one frame.
_FITS, _SURE, _MOST_OF_FRAME = -1.0, 9.0, 6.0
# Fraction of a doubt that remains after a frame without evidence for it.
_DOUBT_KEPT = 0.9
# Cost of a return within seconds, and its increase for each factor of ten in time after that.
_SOON, _PER_DECADE, _FIRST_S = -2.75, 1.25, 10.0
# Extra cost without clothes: a stranger of the same height matches too easily.
_UNDRESSED = 0.75
# Standard deviations of a person's height from visit to visit, and of the logarithm of the size of
# a face; largest cost of either, as people sit down and faces are measured inaccurately.
_HEIGHT_SD_M, _SIZE_SD, _MOST = 0.12, 0.06, 6.0
# People may cover this distance immediately, and walk at this speed later.
_AT_ONCE_M, _WALKS_M_S = 0.5, 2.0


def resolve_identities(
    tracks: list[BodyTrack],
    worn: list[list[float]],
    column: dict[int, int],
    detections: list[Located],
) -> None:
    """Restore by their clothes the numbers of people who were confused while hidden.

    A person who emerges from behind another shows the face first, and the clothes later.

    Args:
        tracks: all tracks; one that turns out to be a copy of another is removed.
        worn: cost of the clothes of each pair of track and detection.
        column: the detection of each track that has one.
        detections: detections of the frame.
    """
    sure = True
    for i, j in column.items():
        track, own = tracks[i], worn[i][j]
        clothing, known = detections[j].clothing, track.clothes
        if clothing is None:  # a thing has none
            continue
        new = max(own, 0.0) if known.frames < _OWN else own  # may be a person who returned
        if new < _FITS:
            known.confirmed = min(known.confirmed + clothing.share, _MOST_CONFIRMED)
        elif own > _MISFITS:
            known.confirmed -= clothing.share
        if known.confirmed >= _CONFIRMED:
            known.doubts, known.lost_sight = {}, False
            continue
        before, known.doubts = known.doubts, {}
        for k, other in enumerate(tracks):
            lost = other.unseen_s > IN_SIGHT_S
            if not lost and not (k in column and (known.lost_sight or other.clothes.lost_sight)):
                continue
            if k != i and other.clothes.frames >= _CLOTHES_PROVED:
                gain = max((new if lost else own) - worn[k][j], -_MOST_OF_FRAME)
                gain = min(gain, _MOST_OF_FRAME if not lost or worn[k][j] < _FITS else 0.0)
                doubt = _DOUBT_KEPT * before.get(other.id, 0.0) + gain
                if doubt > 1.0:
                    known.doubts[other.id] = doubt
                    sure = sure and doubt < _SURE
    if not sure:
        seen = [tracks[i] for i in column if tracks[i].is_person]
        _renumber(tracks, [one for one in seen if one.clothes.confirmed < _CONFIRMED])


def _renumber(tracks: list[BodyTrack], seen: list[BodyTrack]) -> None:
    """Exchange the numbers of the tracks in sight so that they match all of them best."""
    people = [
        track
        for track in tracks
        if track.is_person and (track in seen or track.unseen_s > IN_SIGHT_S)
    ]
    costs = [
        [
            0.0 if one is other else _SURE - one.clothes.doubts.get(other.id, 0.0)
            if other.seen_s == other.at_s or _reachable(one, other) else FORBIDDEN
            for other in people
        ]
        for one in seen
    ]  # fmt: skip
    persons = [(one.id, one.clothes.colours, one.clothes.frames) for one in people]
    place = {column: seen[row] for row, column in assign(costs)}
    free = [one for one in people if one not in place.values()]
    for k, one in enumerate(people):
        if k not in place and one in free:
            place[k] = one
            free.remove(one)
    for k, (number, colours, frames) in enumerate(persons):
        one = place[k] if k in place else free.pop()
        if one is not people[k]:
            one.id = number
            one.clothes = KnownClothes(colours, frames, lost_sight=one.clothes.lost_sight)
            one.returned_person, one.is_number_final = None, True
            if one.seen_s < one.at_s and frames < _OWN:
                tracks.remove(one)  # the supposed new person was this one


def _reachable(one: BodyTrack, other: BodyTrack) -> bool:
    """Return whether a person out of sight can have reached the position of a track."""
    known = 2.0 * sqrt(one.filter.along.p + other.filter.along.p)
    gone = GATE_SPEED_M_S * other.unseen_s
    reach = GATE_M * max(1.0, one.filter.range_m) + gone + known
    return norm(sub(one.p_world_m, other.p_world_m)) < reach


def _return_cost(gone: SeenPerson, new: SeenPerson) -> float:
    """Return the cost of the match of a new person and one who left; infinite if impossible."""
    gone_s = new.seen_s - gone.seen_s
    if norm(sub(gone.p_world_m, new.p_world_m)) > _AT_ONCE_M + _WALKS_M_S * gone_s:
        return inf
    cost = _SOON + _PER_DECADE * log10(max(gone_s, 0.1) / _FIRST_S)
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
