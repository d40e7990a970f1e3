"""Data of tracking: a detection in the world, one person or thing, its eyes, lips and clothes."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import inf, radians, sqrt
from typing import NamedTuple

import numpy as np

from gazerig.drivers.types import Clothing, Located
from gazerig.gaze.angles import add, angle_between, compose, rotate, scale, sub
from gazerig.gaze.types import Floats, Mat3, Vec3
from gazerig.robot.perception.kalman import TrackFilter

EYES_HELD_S = 0.12
"""Time for which a gaze stays valid if the next frames show a mesh, but not the irises."""
_EYES_SD_RAD = radians(4.0)
"""Usual error of a gaze from images of both eyes."""
_SMOOTHED = 0.6
"""Ratio of the deviation of a track's turn, smoothed over some frames, to that of one frame: a part
of the landmark errors is the same in all frames."""
_FACE_AT_HEAD_RAD, _EYES_AT_HEAD_RAD = radians(10.0), radians(6.0)
"""Half angles of the cones within which a face, and a gaze of the eyes if it is found, is turned
to the head."""
_EDGE_OF_CONE, _EDGE_OF_SD = 0.2, 0.5
"""Distance of inner and outer edge from the cone: fractions of the cone and of the uncertainty."""


def looks_at_head(
    off_rad: float, turn_sd_rad: float, by_eyes: bool, before: bool | None
) -> bool | None:
    """Return whether a person looks at the head, None if that is too uncertain.

    A face that is turned to the head within a cone counts as looking at it. Five landmarks
    determine a turn only to a few degrees. So the cone has an inner and an outer edge, and between
    them the last result is kept; the less certain the turn, the farther apart the edges.

    Args:
        off_rad: angle between the person's gaze and the direction to the head.
        turn_sd_rad: standard deviation of the face's turn in one frame.
        by_eyes: whether the angle is that of the eyes' gaze instead of the face.
        before: result of the previous frame.
    """
    cone = _EYES_AT_HEAD_RAD if by_eyes else _FACE_AT_HEAD_RAD
    sd = _EYES_SD_RAD if by_eyes else _SMOOTHED * turn_sd_rad
    if sd > max(cone, _EYES_SD_RAD):
        return None
    edge = max(_EDGE_OF_CONE * cone, min(_EDGE_OF_SD * sd, 0.5 * cone))
    return off_rad < cone + edge if before else off_rad < cone - edge


# Smallest swing of the gap that counts; changes of its direction within a window that make speech,
# or a swing of some times that size and the start of the next within a syllable.
_SWING_M, _TURNS, _WINDOW_S, _WIDE, _SYLLABLE_S = 0.0024, 3, 1.0, 2.0, 0.2


class Speech(NamedTuple):
    """Recent motion of the gap between a person's lips; a value.

    Speech opens and closes the mouth three to six times a second; a smile, a yawn and a mouth that
    stays open do not. A person speaks while the mouth has recently opened and closed several times,
    each time by more than the usual error of the mesh, or once quickly and far.

    start_m, extreme_m: ends of the present swing; opens: its direction; turned_s: times of the last
    changes of direction
    """

    start_m: float = 0.0
    extreme_m: float = inf
    opens: bool = False
    turned_s: tuple[float, ...] = ()

    def advance(self, gap_m: float, t_s: float, sd_m: float = 0.0) -> "Speech":
        """Return the motion after another frame; sd_m: standard deviation of the gap's changes."""
        extreme_m = (max if self.opens else min)(self.extreme_m, gap_m)
        least_m, turned_s = max(_SWING_M, 4.0 * sd_m), self.turned_s
        if abs(gap_m - extreme_m) < least_m:
            return self._replace(extreme_m=extreme_m)
        syllable = turned_s and t_s - turned_s[-1] <= _SYLLABLE_S
        if syllable and abs(extreme_m - self.start_m) > _WIDE * least_m:
            turned_s = (t_s,) * _TURNS
        return Speech(extreme_m, gap_m, not self.opens, (*turned_s[1 - _TURNS :], t_s))

    def speaks(self, t_s: float) -> bool:
        """Return whether the mouth moves like that of a speaking person."""
        return len(self.turned_s) == _TURNS and t_s - self.turned_s[0] <= _WINDOW_S


# Deviations beyond which the mean position of a head over a time has moved, and the share of a turn
# of the camera by which its pose may be wrong; time after which motion is measured anew, and the
# largest turn in it with which rest is certain. A standing person's head sways by millimetres
# within seconds.
_SIGMAS, _MEAN_S, _OF_TURN, _ANEW_S, _STEADY_RAD = 3.0, 0.33, 0.05, 1.9, 0.02
# A face that has rested for no longer than this lives. A person whose face was not visible for
# longer, and who has rested for so long, may be a bottle or a coat.
_LIVES_S, _COUNTS_S = 5.0, 18.0
# Time for which a face in a film is known as such; share of flat frames above which a face is a
# picture.
_FILMED_S, _FLAT = 30.0, 0.5


@dataclass(slots=True)
class Life:
    """Motion of a head, which pictures, statues and bottles do not have.

    still_s: time without motion while the camera hardly turned, since the last motion
    mean, at_s: mean direction to the head, and its time
    view, axis, since_s: mean from which motion is measured, the camera's axis then, and that time
    has_moved: whether there was any motion
    """

    still_s: float
    mean: Vec3 = (1.0, 0.0, 0.0)
    at_s: float = -inf
    view: Vec3 = mean
    axis: Vec3 = mean
    since_s: float = -inf
    has_moved: bool = False

    def record(self, known: TrackFilter, axis: Vec3, t_s: float) -> None:
        """Record the position of a head that was seen now, with the camera's present axis."""
        share, self.at_s = min(1.0, (t_s - self.at_s) / _MEAN_S), t_s
        self.mean = add(self.mean, scale(sub(known.view, self.mean), share))
        turned_rad = angle_between(axis, self.axis)
        least_rad = _SIGMAS * sqrt(known.across.p) / known.range_m + _OF_TURN * turned_rad
        if t_s - self.since_s < _ANEW_S:
            if angle_between(self.mean, self.view) <= least_rad:
                return
            self.still_s, self.has_moved = 0.0, True
        elif turned_rad < _STEADY_RAD:
            self.still_s += _ANEW_S
        self.view, self.axis, self.since_s = self.mean, axis, t_s


FACE = "face"
"""Kind of people, also while their face is not visible."""
UNNAMED = "thing"
"""Kind of a moving patch that is not recognised; other kinds do not change."""
# Hellinger distance of two clothes' colours at which the cost is 0, and the slopes of the cost
# below and above it. At .105, one person at two times is as frequent as two people at one time.
# Measured on people in a square (75 tracks; medians: .044 for one person, .13 for two people).
_AS_LIKELY, _NEARER_COST, _FARTHER_COST = 0.105, 55.0, 14.0
_NO_CLOTHING = Clothing((0.0,) * 24, 0.0)
# Clothes of which this share is visible count as fully visible.
_ENOUGH = 0.4
# Gain with which the colours of clothes are learned, and gain if they do not match.
_COLOURS_GAIN, _UNFIT_GAIN = 0.15, 0.005
# Inner product of colours above which they are similar.
_LIKE = 0.9
IN_SIGHT_S = 0.25
"""A track without a detection is still reported for this long."""
FORGET_S = 1.5
"""A track without a detection is deleted after this long; what returns later is a new one."""


@dataclass(slots=True)
class KnownClothes:
    """Clothes of one person, as learned so far.

    colours: mean colours, as in ``Clothing``
    frames: number of frames with clothes; a frame that shows a part counts as a fraction
    """

    colours: Floats | None = None
    frames: float = 0.0

    def learn(self, clothing: Clothing | None) -> None:
        """Learn the clothes, more slowly if less of them is visible."""
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
    if all(colours is None for colours in tracks) or not any(detections):
        return None
    shown = [found or _NO_CLOTHING for found in detections]
    worn = np.array([_NO_CLOTHING.colours if colours is None else colours for colours in tracks])
    shares = np.minimum(1.0, np.array([found.share for found in shown]) / _ENOUGH)
    known = np.outer([colours is not None for colours in tracks], shares)
    alike = worn @ np.array([found.colours for found in shown]).T
    apart = np.sqrt(np.maximum(0.0, 1.0 - alike)) - _AS_LIKELY
    costs = known * np.minimum(_NEARER_COST * apart, _FARTHER_COST * apart)
    out: list[list[float]] = costs.tolist()
    return out


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


@dataclass(slots=True, eq=False)
class BodyTrack:
    """Track of one person or thing through time.

    R_world_face: axes of a face; None for a thing, and while the person's face is not visible
    seen_s, at_s: capture times of its last detection and of its position
    frames: number of frames in which it was detected
    faced_s: of a person, capture time of the last detection of the face
    filmed_s: of a person, time at which the face was found to be in a film, on a screen
    life: motion of a person's head
    face_size: of a face, size relative to an adult's, learned if the camera measures depth; None
        before the first measured distance
    looks_at_head: of a face, whether the person looked at the head in its last frame; None if
        uncertain
    flat: of a face, share of recent frames in which it was flat
    speech: of a face, recent motion of the mouth
    eyes, eyes_s: of a face, last detection that showed the eyes, and its capture time
    clothes: of a person, learned clothes
    returned_person: the person whose number a new track has received, None for a new number;
        is_number_final: whether the number is final because the clothes are known
    """

    id: int
    detection: Located
    filter: TrackFilter
    R_world_face: Mat3 | None
    seen_s: float
    at_s: float
    face_length: float
    life: Life
    face_size: float | None = None
    looks_at_head: bool | None = None
    flat: float = 0.0
    speech: Speech = Speech()
    eyes: Located | None = None
    eyes_s: float = -inf
    faced_s: float = -inf
    filmed_s: float = -inf
    frames: int = 1
    clothes: KnownClothes = field(default_factory=KnownClothes)
    returned_person: SeenPerson | None = None
    is_number_final: bool = False

    @property
    def unseen_s(self) -> float:
        """Return the time since its last detection."""
        return self.at_s - self.seen_s

    @property
    def is_remembered(self) -> bool:
        """Return whether it has been out of sight for so long that it is assumed to stay."""
        return self.unseen_s > FORGET_S

    @property
    def p_world_m(self) -> Vec3:
        """Return the position at ``at_s``."""
        return self.filter.p_m

    @property
    def v_world_m_s(self) -> Vec3:
        """Return the velocity."""
        return self.filter.v_m_s

    @property
    def depth_from(self) -> str:
        """Return the source of its distance: "camera", "face size" or "assumed".

        Without a visible face, "face size" refers to the size of the body.
        """
        if self.detection.depth_measured:
            return "camera"
        return "face size" if self.is_person else "assumed"

    @property
    def is_person(self) -> bool:
        """Return whether it is a person, with or without a visible face."""
        return self.detection.kind == FACE

    @property
    def shows_face(self) -> bool:
        """Return whether the face of a person was seen recently."""
        return self.R_world_face is not None and self.at_s - self.faced_s <= IN_SIGHT_S

    @property
    def is_alive(self) -> bool:
        """Return whether a face has recently moved, and is neither in a film nor in a picture."""
        filmed = self.at_s - self.filmed_s <= _FILMED_S or self.flat > _FLAT
        return self.life.still_s <= _LIVES_S and not filmed

    @property
    def counts(self) -> bool:
        """Return whether it is a thing, or a person who has moved or shown the face."""
        return not self.is_person or min(self.life.still_s, self.at_s - self.faced_s) <= _COUNTS_S


def place_in_world(found: Located, R: Mat3, p_m: Vec3) -> Located:
    """Return a detection in the world, from the camera's pose at the exposure."""

    def turn(v: Vec3 | None) -> Vec3 | None:
        return None if v is None else rotate(R, v)

    def place(q_m: Vec3 | None) -> Vec3 | None:
        return None if q_m is None else add(p_m, rotate(R, q_m))

    return found._replace(
        p_m=add(p_m, rotate(R, found.p_m)),
        R_face=None if found.R_face is None else compose(R, found.R_face),
        v_m_s=turn(found.v_m_s),
        gaze=turn(found.gaze),
        fastest_m=place(found.fastest_m),
        fastest_m_s=turn(found.fastest_m_s),
        upper_m=place(found.upper_m),
    )
