"""Data of tracking: a detection in the world, one person or thing, its eyes, lips and clothes."""

from dataclasses import dataclass, field, replace
from math import inf, radians, sqrt
from typing import NamedTuple, Self

import numpy as np

from gazerig.drivers.types import Clothing, DetectionInCamera, FaceSigns
from gazerig.gaze.angles import add, angle_between, compose, rotate
from gazerig.gaze.types import Floats, Mat3, Vec3
from gazerig.robot.perception.kalman import TrackFilter
from gazerig.robot.perception.returning_people import SeenPerson

_EYES_HELD_S = 0.12
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


class EyeObservation(NamedTuple):
    """State of a person's eyes in the last frame that showed them.

    gaze_world: unit vector of their gaze, None if they were shut
    opening: opening of the lids relative to the usual one
    at_s: capture time of that frame
    """

    gaze_world: Vec3 | None
    opening: float
    at_s: float

    def at(self, t_s: float) -> Self | None:
        """Return the state if it is still valid at a time, else None."""
        return self if t_s - self.at_s <= _EYES_HELD_S else None


def angle_off_head_rad(R_world_face: Mat3, gaze_world: Vec3 | None, from_face_m: Vec3) -> float:
    """Return the angle between a person's gaze and the direction to the head.

    Args:
        R_world_face: face axes, x out of the face.
        gaze_world: direction of the gaze of the eyes, None if unknown.
        from_face_m: vector from the face to the head, world.
    """
    ahead = R_world_face[0][0], R_world_face[1][0], R_world_face[2][0]
    return angle_between(ahead if gaze_world is None else gaze_world, from_face_m)


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


# Time constant of the mean; least distance from it that counts; crossings within a window that make
# speech; time without a crossing that ends it.
_MEAN_S, _LEAST_M, _WINDOW_S, _CROSSINGS = 0.6, 0.0012, 1.5, 4


@dataclass(frozen=True, slots=True)
class Speech:
    """Recent motion of the gap between a person's lips; a value.

    Speech opens and closes the mouth three to six times a second; a smile, a yawn and a mouth that
    stays open do not. A person speaks while the gap has recently crossed its own mean several
    times, each time by more than the usual error of the mesh.

    mean_m: running mean of the gap, None before the first; above: whether the last crossing was
    upwards; crossed_s: times of the last crossings; at_s: time of the last gap
    """

    mean_m: float | None = None
    above: bool = False
    crossed_s: tuple[float, ...] = ()
    at_s: float = 0.0

    def advance(self, gap_m: float, t_s: float) -> Self:
        """Return the motion after another frame."""
        if self.mean_m is None:
            return replace(self, mean_m=gap_m, at_s=t_s)
        share = min(1.0, max(0.0, t_s - self.at_s) / _MEAN_S)
        off_m = gap_m - self.mean_m
        mean_m = self.mean_m + share * off_m
        if abs(off_m) < _LEAST_M or (off_m > 0.0) is self.above:
            return replace(self, mean_m=mean_m, at_s=t_s)
        crossed = (*self.crossed_s[1 - _CROSSINGS :], t_s)
        return replace(self, mean_m=mean_m, above=not self.above, crossed_s=crossed, at_s=t_s)

    def speaks(self, t_s: float) -> bool:
        """Return whether the mouth moves like that of a speaking person."""
        return len(self.crossed_s) == _CROSSINGS and t_s - self.crossed_s[0] <= _WINDOW_S


NO_SPEECH = Speech()

FACE = "face"
"""Kind of people, also while their face is not visible."""
UNNAMED = "thing"
"""Kind of a moving patch that is not recognised; other kinds do not change."""
# Gain with which the colours of clothes are learned, and gain if they do not match.
_COLOURS_GAIN, _UNFIT_GAIN = 0.15, 0.005
# Inner product of colours above which they are similar.
_LIKE = 0.9
# A person who was not seen for longer than this was out of sight.
_GAP_S = 0.12


@dataclass(slots=True)
class KnownClothes:
    """Clothes of one person, as learned so far.

    colours: mean colours, as in ``Clothing``
    frames: number of frames with clothes; a frame that shows a part counts as a fraction
    confirmed: number of frames in which they matched since the person was out of sight
    lost_sight: whether the person was out of sight and the clothes are unconfirmed since then
    doubts: number of another person -> cost by which that person's clothes match better
    """

    colours: Floats | None = None
    frames: float = 0.0
    confirmed: float = 0.0
    lost_sight: bool = False
    doubts: dict[int, float] = field(default_factory=dict)

    def record_absence(self, unseen_s: float) -> None:
        """Start the confirmation again if the person was out of sight, for a time in seconds."""
        if unseen_s > _GAP_S:
            self.confirmed, self.lost_sight = 0.0, True

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


@dataclass(slots=True)
class LocalisedDetection:
    """Detection of one thing in one frame, in the world.

    R_world_face: axes of a face, None for a thing and for a person without a visible face
    face_length: of a face, length relative to the canonical face
    depth_measured: whether the camera measured the distance; otherwise a face's is computed from
        its size and a thing's is assumed
    across_sd_m, along_sd_m: standard deviations of the position, across and along the view
    v_world_m_s: velocity measured in the image, None if only the position is known;
        across_sd_m_s, along_sd_m_s: its standard deviations
    size_depth: of a face, its distance at an adult's size over the measured distance; None without
        a measured distance
    mark: number assigned by the detector, None without one
    turn_sd_rad: of a face, standard deviation of its turn
    gaze_world: of a face, direction of the gaze of the eyes, None if unknown
    fastest_m, fastest_m_s: of a moving thing, position and velocity of its fastest part
    signs: of a face, state of eyes and mouth, None if not found
    upper_m: of an upright moving thing, position of its upper end, the head of a person
    compact: of a moving thing, whether its patch is about as wide as high and full, like that of a
        fist or a single hand and unlike that of an arm
    thickness_m: of a moving thing, diameter of the largest disc within its patch, at its distance;
        from_side: whether the patch continues beyond the left or right edge of the image
    clothing: of a person, colours of the clothes, None if not visible
    """

    kind: str
    p_world_m: Vec3
    R_world_face: Mat3 | None
    radius_m: float
    spin_rad_s: float
    confidence: float
    face_length: float = 1.0
    depth_measured: bool = False
    across_sd_m: float = 0.002
    along_sd_m: float = 0.08
    v_world_m_s: Vec3 | None = None
    across_sd_m_s: float = 0.1
    along_sd_m_s: float = 0.5
    size_depth: float | None = None
    mark: int | None = None
    turn_sd_rad: float = 0.0
    gaze_world: Vec3 | None = None
    fastest_m: Vec3 | None = None
    fastest_m_s: Vec3 | None = None
    signs: FaceSigns | None = None
    compact: bool = False
    thickness_m: float = 0.0
    from_side: bool = False
    upper_m: Vec3 | None = None
    clothing: Clothing | None = None


@dataclass(slots=True, eq=False)
class BodyTrack:
    """Track of one person or thing through time.

    R_world_face: axes of a face; None for a thing, and while the person's face is not visible
    seen_s, at_s: capture times of its last detection and of its position
    frames: number of frames in which it was detected
    faced_s: of a person, capture time of the last detection of the face
    face_size: of a face, size relative to an adult's, learned if the camera measures depth
    depth_s: capture time of the last measured distance, None before the first
    looks_at_head: of a face, whether the person looked at the head in its last frame; None if
        uncertain
    speech: of a face, recent motion of the mouth
    eyes: of a face, last observed state of the eyes
    clothes: of a person, learned clothes
    returned_person: the person whose number a new track has received, None for a new number;
        is_number_final: whether the number is final because the clothes are known
    """

    id: int
    detection: LocalisedDetection
    filter: TrackFilter
    R_world_face: Mat3 | None
    seen_s: float
    at_s: float
    face_length: float
    face_size: float = 1.0
    depth_s: float | None = None
    looks_at_head: bool | None = None
    speech: Speech = NO_SPEECH
    eyes: EyeObservation | None = None
    faced_s: float = -inf
    frames: int = 1
    clothes: KnownClothes = field(default_factory=KnownClothes)
    returned_person: SeenPerson | None = None
    is_number_final: bool = False

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


def place_in_world(
    found: DetectionInCamera, R_world_camera: Mat3, p_world_m: Vec3
) -> LocalisedDetection:
    """Return a detection in the world, from the camera's pose at the exposure."""
    R, v, gaze = found.R_camera_face, found.v_camera_m_s, found.gaze_camera
    fastest, faster, upper = found.fastest_m, found.fastest_m_s, found.upper_m
    return LocalisedDetection(
        found.kind,
        add(p_world_m, rotate(R_world_camera, found.p_camera_m)),
        None if R is None else compose(R_world_camera, R),
        found.radius_m,
        found.spin_rad_s,
        found.confidence,
        found.face_length,
        found.depth_measured,
        found.across_sd_m,
        found.along_sd_m,
        None if v is None else rotate(R_world_camera, v),
        found.across_sd_m_s,
        found.along_sd_m_s,
        found.size_depth,
        found.detector_id,
        found.turn_sd_rad,
        None if gaze is None else rotate(R_world_camera, gaze),
        None if fastest is None else add(p_world_m, rotate(R_world_camera, fastest)),
        None if faster is None else rotate(R_world_camera, faster),
        found.signs,
        found.compact,
        found.thickness_m,
        found.from_side,
        None if upper is None else add(p_world_m, rotate(R_world_camera, upper)),
        found.clothing,
    )
