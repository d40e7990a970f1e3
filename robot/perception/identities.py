"""Identities: people who were confused while they were hidden get their numbers back.

What tells them apart is the colours of their clothes, as they were seen in many frames.
"""

from dataclasses import dataclass, field
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from gazerig.drivers.camera.located_frame import Clothing
from gazerig.gaze.angles import norm, sub
from gazerig.gaze.types import Floats
from gazerig.robot.model.track_params import TrackParams
from gazerig.robot.perception.data_association import FORBIDDEN, assign

if TYPE_CHECKING:
    from gazerig.robot.perception.tracker import LocalisedDetection, Track

# How fast the colours of clothes are learned, and how fast if they do not fit; in how many frames
# they must have been seen to tell who somebody is; and in how many until nobody takes the person
# for one who was here before.
_COLOURS_GAIN, _UNFIT_GAIN, _PROVED, _OWN = 0.15, 0.005, 3, 60
# Inner product of colours that are much alike.
_LIKE = 0.9
# Who was not seen for longer than the first has been out of sight; who is not for longer than the
# second is lost.
_GAP_S, _LOST_S = 0.12, 0.25
# In so many frames they must be one's own; no more than so many count; clothes that cost more than
# the third do not fit.
_CONFIRMED, _MOST_CONFIRMED, _MISFITS = 3.0, 6.0, 2.0
# Clothes that cost less than the first fit; two people change their numbers when that costs so
# much less, summed over frames, of each no more than the third number.
_FITS, _SURE, _MOST_OF_FRAME = -1.0, 9.0, 6.0
# A doubt goes within so many frames in which nothing speaks for it.
_DOUBT_KEPT = 0.9


@dataclass(slots=True)
class KnownClothes:
    """What is known of the clothes of one person.

    colours: as they usually are seen, as in ``Clothing``
    frames: in how many frames they were seen, parts of them counting as such
    confirmed: in how many frames they were the person's own since the person was out of sight
    lost_sight: whether the person was out of sight, and they were not confirmed since
    doubts: how much more they are like those of others, by the numbers of these, as a cost
    """

    colours: Floats | None = None
    frames: float = 0.0
    confirmed: float = 0.0
    lost_sight: bool = False
    doubts: dict[int, float] = field(default_factory=dict)

    def miss(self, unseen_s: float) -> None:
        """Note for how long the person was not seen before this frame."""
        if unseen_s > _GAP_S:
            self.confirmed, self.lost_sight = 0.0, True

    def learn(self, clothing: Clothing | None) -> None:
        """Learn how the person is dressed, the slower the less of it is seen."""
        if clothing is None:
            return
        self.frames += clothing.share
        seen, before = np.array(clothing.colours), self.colours
        if before is None:
            self.colours = seen
            return
        fits = float(before @ seen) > _LIKE
        gain = clothing.share * (
            max(_COLOURS_GAIN, 1.0 / (1.0 + self.frames)) if fits else _UNFIT_GAIN
        )
        mean = before + gain * (seen - before)
        self.colours = mean / sqrt(float(mean @ mean))


def settle(
    tracks: "list[Track]",
    worn: list[list[float]],
    column: dict[int, int],
    detections: "list[LocalisedDetection]",
    params: TrackParams,
) -> None:
    """Give people who were confused while they were hidden the numbers of their clothes.

    Who comes out from behind another shows the face first, and the clothes later.

    Args:
        tracks: all of them; one that proves to be another's is taken out.
        worn: what clothes tell of each pair of track and detection, as a cost.
        column: the detection of each track that has one.
        detections: of the frame.
        params: in force.
    """
    sure = True
    for i, j in column.items():
        track, own = tracks[i], worn[i][j]
        clothing, known = detections[j].clothing, track.clothes
        if clothing is None or not track.is_person:
            continue
        new = max(own, 0.0) if known.frames < _OWN else own  # may be one who was here before
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


def _renumber(tracks: "list[Track]", seen: "list[Track]", params: TrackParams) -> None:
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
                tracks.remove(one)  # nobody new came: that was this one


def _reachable(one: "Track", other: "Track", params: TrackParams) -> bool:
    """Return whether a person out of sight can have come to where a track is."""
    known = 2.0 * sqrt(one.filter.along.p + other.filter.along.p)
    gone = params.gate_speed_m_s * (other.at_s - other.seen_s)
    reach = params.gate_m * max(1.0, one.filter.range_m) + gone + known
    return norm(sub(one.p_world_m, other.p_world_m)) < reach
