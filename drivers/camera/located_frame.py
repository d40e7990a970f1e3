"""What one image shows, located in the camera's axes by the process that found it."""

from typing import NamedTuple

from gazerig.drivers.camera.pinhole import Intrinsics

_Row = tuple[float, float, float]


class Clothing(NamedTuple):
    """Colours of the clothes below a head, as gazerig.drivers.vision.clothing finds them.

    colours: roots of the shares of 24 bins of colour; the inner product of two is their
        Bhattacharyya coefficient, 1 where they are the same
    share: of the place that counts, how much of it is seen, 0..1
    """

    colours: tuple[float, ...]
    share: float


class FaceSigns(NamedTuple):
    """What eyes and mouth of a face do, at an adult's size.

    eye_opening: of the lids, over the usual opening, 0 is shut; None where lids are not seen
    mouth_opening_m: gap between the lips
    """

    eye_opening: float | None
    mouth_opening_m: float


class DetectionInCamera(NamedTuple):
    """One detection with its place in the camera's axes (x right, y down, z forward).

    All of it follows from the image and the calibration alone.

    R_camera_face: axes of a face, None of anything else
    confidence: 0..1
    face_length: of a face, in lengths of the canonical one
    depth_measured: whether the distance was measured by the camera; else a face's is from
        its size and a thing's is assumed
    across_sd_m, along_sd_m: standard deviations of the place, across and along the view
    v_camera_m_s: velocity over ground, None where only the place is known;
        across_sd_m_s, along_sd_m_s: its standard deviations
    size_depth: of a face, its distance if it were of an adult's size, over the distance
        measured; None where the camera measured none
    mark: the detector's own number of it, None where it gives none
    turn_sd_rad: of a face, standard deviation of its turn
    gaze_camera: of a face, unit vector along which the eyes look, None where it is unknown
    fastest_m, fastest_m_s: of what moves, place and velocity of its fastest part, None where
        they are not known
    signs: of a face, what eyes and mouth do, None where they are not found
    upper_m: of what moves and is upright, place of its upper end, where a person's head is
    compact: of what moves, whether its patch is about as wide as high and full, as a fist's or a
        hand's alone is and an arm's is not
    thickness_m: of what moves, diameter of the largest disc within its patch, as far away as its
        place; from_side: the patch goes on beyond the left or right edge of the image
    clothing: of a person, colours of the clothes, None where they are not seen
    box_m: of a face, size of its box as far away as its place, the root of its area
    lower_face: of a face, width of the mouth over the distance of the eyes, times the part of the
        way from the eyes to the mouth at which the nose is; 0 of anything else
    """

    kind: str
    p_camera_m: tuple[float, float, float]
    R_camera_face: tuple[_Row, _Row, _Row] | None
    radius_m: float
    spin_rad_s: float
    confidence: float
    face_length: float
    depth_measured: bool
    across_sd_m: float
    along_sd_m: float
    v_camera_m_s: tuple[float, float, float] | None
    across_sd_m_s: float
    along_sd_m_s: float
    size_depth: float | None
    mark: int | None
    turn_sd_rad: float = 0.0
    gaze_camera: tuple[float, float, float] | None = None
    fastest_m: tuple[float, float, float] | None = None
    fastest_m_s: tuple[float, float, float] | None = None
    signs: FaceSigns | None = None
    compact: bool = False
    thickness_m: float = 0.0
    from_side: bool = False
    upper_m: tuple[float, float, float] | None = None
    clothing: Clothing | None = None
    box_m: float = 0.0
    lower_face: float = 0.0


class LocatedFrame(NamedTuple):
    """What one image shows, located in the camera's axes by one calibration.

    intrinsics: the calibration; things: what moves, with a place
    faces: behind those seen, the heads of people whose face is not; they have no ``R_camera_face``
    palms: of the nearest person, None in a frame that was not searched for them
    """

    intrinsics: Intrinsics
    faces: tuple[DetectionInCamera, ...]
    things: tuple[DetectionInCamera, ...]
    palms: tuple[DetectionInCamera, ...] | None = None
