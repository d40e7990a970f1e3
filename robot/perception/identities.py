"""Identities: people who were confused while they were hidden get their numbers back.

The colours of their clothes, learned over many frames, distinguish them.
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

# Gain with which the colours of clothes are learned, and gain if they do not fit; number of frames
# after which they identify a person; number of frames below which the person may be one who was
# here before.
_COLOURS_GAIN, _UNFIT_GAIN, _PROVED, _OWN = 0.15, 0.005, 3, 60
# Inner product of colours that are much alike.
_LIKE = 0.9
# A person who was not seen for longer than the first time was out of sight; one who is not seen for
# longer than the second is lost.
_GAP_S, _LOST_S = 0.12, 0.25
# Number of frames that confirm a person's clothes; largest number that counts; cost above which
# clothes do not fit.
_CONFIRMED, _MOST_CONFIRMED, _MISFITS = 3.0, 6.0, 2.0
# Cost below which clothes fit; advantage, summed over frames, at which two people exchange their
# numbers; largest advantage of one frame.
_FITS, _SURE, _MOST_OF_FRAME = -1.0, 9.0, 6.0
# Share of a doubt that remains after a frame without evidence for it.
_DOUBT_KEPT = 0.9


@dataclass(slots=True)
class KnownClothes:
    """Clothes of one person, as learned so far.

    colours: their mean, as in ``Clothing``
    frames: number of frames with clothes; a frame that shows a part counts as that part
    confirmed: number of frames in which they fitted since the person was out of sight
    lost_sight: whether the person was out of sight, and they were not confirmed since
    doubts: by the number of another person, how much better that person's clothes fit, as a cost
    """

    colours: Floats | None = None
    frames: float = 0.0
    confirmed: float = 0.0
    lost_sight: bool = False
    doubts: dict[int, float] = field(default_factory=dict)

    def miss(self, unseen_s: float) -> None:
        """Start the confirmation again if the person was out of sight, for a time in seconds."""
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
