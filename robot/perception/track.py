"""What tracking is about: a detection in the world, one person or thing, and a person's clothes."""

from dataclasses import dataclass, field
from math import inf, sqrt

import numpy as np

from gazerig.drivers.types import Clothing, FaceSigns
from gazerig.gaze.types import Floats, Mat3, Vec3
from gazerig.robot.perception.gaze_at_head import SeenEyes
from gazerig.robot.perception.kalman import TrackFilter
from gazerig.robot.perception.speech import NO_SPEECH, Speech

FACE = "face"
"""What people are called, also while their face is not seen."""
UNNAMED = "thing"
"""What a moving patch is called whose kind is not known; a named one is always itself."""
# Gain with which the colours of clothes are learned, and gain if they do not fit.
_COLOURS_GAIN, _UNFIT_GAIN = 0.15, 0.005
# Inner product of colours that are much alike.
_LIKE = 0.9
# A person who was not seen for longer than this was out of sight.
_GAP_S = 0.12
# The lower half of a face in one frame is about so uncertain, as a part.
_SHAPE_SD = 0.1


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


@dataclass(slots=True)
class LocalisedDetection:
    """One thing as one frame shows it, placed in the world.

    R_world_face: axes of a face, None of anything else and of a person whose face is not seen
    face_length: of a face, in lengths of the canonical one
    depth_measured: whether the distance was measured by the camera; else a face's is from
        its size and a thing's is assumed
    across_sd_m, along_sd_m: standard deviations of the place, across and along the view
    v_world_m_s: velocity as measured in the image, None where only the place is known;
        across_sd_m_s, along_sd_m_s: its standard deviations
    size_depth: of a face, its distance if it were of an adult's size, over the distance
        measured; None where the camera measured none
    mark: the detector's own number of it, None where it gives none
    turn_sd_rad: of a face, standard deviation of its turn
    gaze_world: of a face, direction of the gaze of the eyes, None where it is unknown
    fastest_m, fastest_m_s: of what moves, place and velocity of its fastest part
    signs: of a face, what eyes and mouth do, None where they are not found
    upper_m: of what moves and is upright, place of its upper end, where a person's head is
    compact: of what moves, whether its patch is about as wide as high and full, as a fist's or a
        hand's alone is and an arm's is not
    thickness_m: of what moves, diameter of the largest disc within its patch, as far away as its
        place; from_side: the patch goes on beyond the left or right edge of the image
    clothing: of a person, colours of the clothes, None where they are not seen
    box_m, lower_face: of a face, as in ``DetectionInCamera``
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
    box_m: float = 0.0
    lower_face: float = 0.0


@dataclass(slots=True, eq=False)
class Track:
    """One thing through time.

    R_world_face: axes of a face; None of anything else, and while the person's face is not seen
    seen_s, at_s: capture times of its last detection and of its place
    frames: in how many it was detected
    faced_s: of a person, capture time of the last detection of the face
    face_size: of a face, its size over an adult's, learned where the camera measures depth
    depth_s: capture time of the last measured distance, None before the first
    looks_at_head: of a face, whether the person looked at the head in its last frame; None where
        that was too uncertain
    speech: of a face, how its mouth has moved lately
    eyes: of a face, what its eyes did when they were seen last
    clothes: of a person, as they usually are seen
    box_m, lower_face: as of a detection, of the face as it usually is; bare: in how many frames
        they were seen; lower_var: its variance from frame to frame, as a part of it
    covered: for how many frames the lower half of the face has been covered; covered_s: capture
        time of the last of them; cover_share: by which its distance is multiplied since
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
    eyes: SeenEyes | None = None
    faced_s: float = -inf
    frames: int = 1
    clothes: KnownClothes = field(default_factory=KnownClothes)
    box_m: float = 0.0
    lower_face: float = 0.0
    lower_var: float = _SHAPE_SD * _SHAPE_SD
    bare: int = 0
    covered: int = 0
    covered_s: float = -inf
    cover_share: float = 1.0

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

        That of a person whose face is not seen is from the size of the body.
        """
        if self.detection.depth_measured:
            return "camera"
        return "face size" if self.is_person else "assumed"

    @property
    def is_person(self) -> bool:
        """Return whether it is a person, with a visible face or without."""
        return self.detection.kind == FACE
