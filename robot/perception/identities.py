"""Correction of identities: people who were confused while hidden get their numbers back.

The colours of their clothes, learned over many frames, distinguish them.
"""

from math import sqrt

from gazerig.gaze.angles import norm, sub
from gazerig.robot.model.track_params import TrackParams
from gazerig.robot.perception.data_association import FORBIDDEN, assign
from gazerig.robot.perception.track import KnownClothes, LocalisedDetection, Track

# Number of frames with clothes after which they identify a person; number below which the person
# may be a person who was here before.
_PROVED, _OWN = 3, 60
# A person who is not seen for longer than this is lost.
_LOST_S = 0.25
# Number of frames that confirm a person's clothes; largest number that counts; cost above which
# clothes do not fit.
_CONFIRMED, _MOST_CONFIRMED, _MISFITS = 3.0, 6.0, 2.0
# Cost below which clothes fit; advantage, summed over frames, at which two people exchange their
# numbers; largest advantage of one frame.
_FITS, _SURE, _MOST_OF_FRAME = -1.0, 9.0, 6.0
# Share of a doubt that remains after a frame without evidence for it.
_DOUBT_KEPT = 0.9


def settle(
    tracks: list[Track],
    worn: list[list[float]],
    column: dict[int, int],
    detections: list[LocalisedDetection],
    params: TrackParams,
) -> None:
    """Give people who were confused while they were hidden the numbers of their clothes.

    A person who comes out from behind another shows the face first, and the clothes later.

    Args:
        tracks: all tracks; one that turns out to be a copy of another is removed.
        worn: cost of the clothes of each pair of track and detection.
        column: the detection of each track that has one.
        detections: of the frame.
        params: of tracking.
    """
    sure = True
    for i, j in column.items():
        track, own = tracks[i], worn[i][j]
        clothing, known = detections[j].clothing, track.clothes
        if clothing is None or not track.is_person:
            continue
        new = max(own, 0.0) if known.frames < _OWN else own  # may be a person who was here before
        if new < _FITS:
            known.confirmed = min(known.confirmed + clothing.share, _MOST_CONFIRMED)
        elif own > _MISFITS:
            known.confirmed -= clothing.share
        if known.confirmed >= _CONFIRMED:
            known.doubts, known.lost_sight = {}, False
            continue
        before, known.doubts = known.doubts, {}
        for k, other in enumerate(tracks):
            lost = other.at_s - other.seen_s > _LOST_S
            if not lost and not (k in column and (known.lost_sight or other.clothes.lost_sight)):
                continue
            if k != i and other.clothes.frames >= _PROVED and other.is_person:
                gain = max((new if lost else own) - worn[k][j], -_MOST_OF_FRAME)
                gain = min(gain, _MOST_OF_FRAME if worn[k][j] < _FITS else 0.0)
                doubt = _DOUBT_KEPT * before.get(other.id, 0.0) + gain
                if doubt > 1.0:
                    known.doubts[other.id] = doubt
                    sure = sure and doubt < _SURE
    if not sure:
        unsure = [tracks[i] for i in column if tracks[i].clothes.confirmed < _CONFIRMED]
        _renumber(tracks, [track for track in unsure if track.is_person], params)


def _renumber(tracks: list[Track], seen: list[Track], params: TrackParams) -> None:
    """Give the tracks in sight the numbers that fit all of them best; they exchange them."""
    people = [
        track
        for track in tracks
        if track.is_person and (track in seen or track.at_s - track.seen_s > _LOST_S)
    ]
    costs = [
        [
            0.0 if one is other else _SURE - one.clothes.doubts.get(other.id, 0.0)
            if other.seen_s == other.at_s or _reachable(one, other, params) else FORBIDDEN
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
            if one.seen_s < one.at_s and frames < _OWN:
                tracks.remove(one)  # no new person came: it was this one


def _reachable(one: Track, other: Track, params: TrackParams) -> bool:
    """Return whether a person out of sight can have reached the position of a track."""
    known = 2.0 * sqrt(one.filter.along.p + other.filter.along.p)
    gone = params.gate_speed_m_s * (other.at_s - other.seen_s)
    reach = params.gate_m * max(1.0, one.filter.range_m) + gone + known
    return norm(sub(one.p_world_m, other.p_world_m)) < reach
