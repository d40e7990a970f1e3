"""Localisation of an image's contents in the camera's axes, from image and calibration only.

It runs next to the detector, in the camera's process. Across the line of view a position is
accurate to about a pixel. Along it, the accuracy is that of the camera's depth if the camera
measures one there; otherwise it is limited by the spread of face sizes.
"""

from dataclasses import dataclass
from heapq import nlargest
from math import hypot, isfinite, sqrt

import numpy as np

from gazerig.drivers.camera.capture_loop import is_off_frame
from gazerig.drivers.camera.depth_roi import depth_at
from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import (
    DetectedFace,
    DetectedPalm,
    DetectedPerson,
    Detections,
    Located,
    LocatedFrame,
    MovingBlob,
)
from gazerig.gaze.angles import norm, scale
from gazerig.gaze.types import Vec3, vec
from gazerig.robot.model.face_geometry import LANDMARKS_FACE_M, PUPIL_DISTANCE_M
from gazerig.robot.model.frames import LensParams
from gazerig.robot.model.intrinsics import intrinsics_of_lens, lens_fault, rays
from gazerig.robot.perception.face_pose import FacePose, face_pose, read_mesh

_FACE_RADIUS_M = 0.1
# Length from the hips of a person to the top of the head as the detector defines it, and the error
# of the head's centre. Measured on three people in front of webcams, by the distance of their eyes:
# .76 to .87 m, and 2 cm.
_TRUNK_M, _HEAD_SD_M = 0.83, 0.05
# Length from the wrist of an adult to the root of the middle finger, the error of its centre, and
# the radius of a hand.
_PALM_M, _PALM_SD_M, _HAND_RADIUS_M = 0.088, 0.03, 0.07
# Spread of both lengths over people and postures.
_LENGTH_SPREAD = 0.15
# A head outside the image is placed inside it by this fraction of its width: over the visible body.
_EDGE = 0.02
# A face this near to the centre of a person's head, in trunk lengths, is that person's.
_OWN_FACE = 0.25
# A face printed on a shirt, or on a badge, is rejected: its confidence is below this, and below
# another's divided by this factor, or its width is below this share of the other's, whose body
# would hide a person who is farther away; and its middle is within these distances below and aside
# of the other's, in heights of that one.
_DOUBTFUL, _SURER, _SMALL, _ON_CHEST, _ASIDE = 0.9, 10.0, 0.6, (1.0, 3.0), 1.0
# Error of a face's centre from five landmarks: fractions of a pixel and of the eye distance.
_CENTRE_PX, _CENTRE_OF_EYES = 0.4, 0.015
# Error of its size from frame to frame, in the same units. The eye distance of a person typically
# differs from the mean by 6 % (Gordon et al., ANSUR): this error is constant, and no filter removes
# it.
_SIZE_PX, _SIZE_OF_EYES = 0.7, 0.03
SIZE_SPREAD = 0.06
# Depth of a face: rejected if too few of its pixels have one, or if they spread over more than a
# face; its error is at least a fraction of the depth.
_LEAST_SHARE, _MOST_SPREAD_M, _LEAST_SD = 0.3, 0.12, 0.01
# Largest ratio between the measured distance of a face and the one at an adult's size, either way;
# beyond it the depth is that of a hand before the face, or of the background. The distance at an
# adult's size is calibrated by a distance of the pupils of 61.9 mm (Mitake et al. table 1) and the
# proportions of averaged photographs. Pupils of adults are 45 to 80 mm apart, of children from the
# age of five at least 40 mm (Dodgson, "Variation and extrema of human interpupillary distance",
# 2004): ratios of 1.29 and 1.55 at most.
_MOST_DEPTH_RATIO = 1.6
# A face is flat if the depth beside and above it differs by at most this at 0 m, and in addition
# per squared metre: a stereo camera's error grows so. The face of a person who leans at a wall is
# .18 m before it. Places beside and above a head, in heights from its eyes to its mouth (.07 m).
_FLAT_M, _FLAT_PER_M2 = 0.05, 0.01
_AROUND = (-2.9, 0.0), (2.9, 0.0), (0.0, -3.4)
# The centre of a patch wanders within it; the error of its flow is proportional to the flow and to
# the search range.
_MIDDLE_OF_RADIUS, _PLACED_M = 0.3, 0.002
_FLOW_SHARE, _FLOW_RAD_S, _LOOM_SD_1_S, _MOST_LOOM_SD_1_S = 0.1, 0.03, 0.5, 10.0
# Striding legs and people who part make a patch grow and shrink although it does not approach;
# growth that no measured distance confirms gets less weight.
_SHAPE_1_S = 0.3
# A patch this many times as high as wide is a walking person; the centre of the head is this
# fraction of the height below its upper edge.
_UPRIGHT, _HEAD_DOWN = 1.4, 1.0 / 14.0
# Largest number of things of a frame that are passed on: the largest and fastest ones.
_MOST_THINGS = 24
# A patch is compact if its aspect ratio and the filled share of its box (of a disc's: .79) are
# above these.
_LEAST_ASPECT, _LEAST_FILL = 0.87, 0.6


@dataclass(frozen=True)
class FrameLocator:
    """Locates faces and things in the camera's axes by one calibration; picklable.

    lens: measured lens; field_rad: horizontal field of view, used without a measured lens
    """

    lens: LensParams | None
    field_rad: float

    def intrinsics(self, found: Detections) -> Intrinsics:
        """Return the intrinsics of a frame: measured, the camera's, or from the field of view."""
        size_px = found.width_px, found.height_px
        return intrinsics_of_lens(self.lens, self.field_rad, *size_px, found.lens)

    def fault(self, found: Detections) -> str:
        """Return why the measured lens is not used for a frame, in one line; "" if it is used."""
        why = "" if self.lens is None else lens_fault(self.lens, found.width_px, found.height_px)
        if not why:
            return ""
        return (
            f"camera.lens does not fit: {why}; the camera's lens or camera.horizontal_field_deg is "
            "used instead: calibrate the lens at this size (gazerig calibrate camera RIG)"
        )

    def __call__(self, found: Detections) -> LocatedFrame:
        """Return a frame's contents in the camera's axes."""
        intrinsics = self.intrinsics(found)
        inside = [
            face
            for face in found.faces
            if not is_off_frame(face, found.width_px, found.height_px)
            and not any(_is_on_chest(face, other) for other in found.faces)
        ]
        faces = [_face(face, found, intrinsics) for face in inside]
        faces += [
            _person(person, found, intrinsics)
            for person in found.people
            if not any(_is_face_of(person, face) for face in inside)
        ]
        things = [
            _thing(blob, intrinsics) for blob in nlargest(_MOST_THINGS, found.blobs, _swept_m)
        ]
        return LocatedFrame(
            intrinsics,
            tuple([face for face in faces if face is not None]),
            tuple([thing for thing in things if thing is not None]),
            None
            if found.palms is None
            else tuple([_palm(palm, found, intrinsics) for palm in found.palms]),
        )


def _face(face: DetectedFace, found: Detections, lens: Intrinsics) -> Located | None:
    """Locate a face, None if its landmarks are not those of a face from its front."""
    pose = read_mesh(face.mesh, lens) if face.mesh is not None else None
    pose = pose or face_pose(face.landmarks_px, lens)
    if pose is None:
        return None
    x, _, width, _ = face.box_px
    edge_px = _EDGE * found.width_px
    focal_px = sqrt(lens.fx_px * lens.fy_px)
    eyes_px = focal_px * PUPIL_DISTANCE_M / pose.p_camera_m[2]
    signs = face.signs or pose.signs
    if face.signs is not None and pose.signs is not None:
        # A picture shows the changes of a mouth better than a mesh does, but not the lids.
        signs = face.signs._replace(eye_opening=pose.signs.eye_opening)
    measured = _depth_ratio(face, pose, found)
    share, sd = measured or (1.0, hypot(_SIZE_PX / eyes_px, _SIZE_OF_EYES))
    far = share * norm(pose.p_camera_m)
    return Located(
        "face",
        scale(pose.p_camera_m, share),
        pose.R_camera_face,
        _FACE_RADIUS_M,
        confidence=face.confidence,
        face_length=pose.length,
        depth_measured=measured is not None,
        across_sd_m=far * hypot(_CENTRE_PX, _CENTRE_OF_EYES * eyes_px) / focal_px,
        along_sd_m=far * sd,
        size_depth=None if measured is None else 1.0 / share,
        turn_sd_rad=pose.turn_sd_rad,
        gaze=pose.gaze_camera or face.gaze_camera,
        from_side=x < edge_px or x + width > found.width_px - edge_px,
        signs=signs,
        clothing=face.clothing,
        flat=_is_flat(face, found),
    )


def _person(person: DetectedPerson, found: Detections, lens: Intrinsics) -> Located:
    """Locate the head of a person without a visible face, or the visible part nearest to it."""
    (x, y), edge = person.head_px, _EDGE * found.width_px
    at_px = (
        min(max(x, edge), found.width_px - edge),
        min(max(y, edge), found.height_px - edge),
    )
    half_px = person.trunk_px * _FACE_RADIUS_M / _TRUNK_M
    head = _by_length("face", at_px, _TRUNK_M / person.trunk_px, half_px, found, lens)
    return head._replace(
        radius_m=_FACE_RADIUS_M,
        confidence=person.confidence,
        across_sd_m=_HEAD_SD_M,
        from_side=at_px != (x, y),
        clothing=person.clothing,
    )


def _palm(palm: DetectedPalm, found: Detections, lens: Intrinsics) -> Located:
    half_px = 0.25 * palm.size_px
    hand = _by_length("hand", palm.centre_px, _PALM_M / palm.size_px, half_px, found, lens)
    return hand._replace(confidence=palm.confidence, across_sd_m=_PALM_SD_M)


def _by_length(
    kind: str,
    at_px: tuple[float, float],
    m_per_px: float,
    half_px: float,
    found: Detections,
    lens: Intrinsics,
) -> Located:
    """Return a part of a body at its depth, measured or by its length.

    Args:
        kind: kind of the part.
        at_px: its centre.
        m_per_px: usual length of the part over its length in the image.
        half_px: half side of the square around the centre whose depth is read.
        found: the frame.
        lens: lens of the frame.
    """
    (x, y), side = at_px, 2.0 * half_px
    depth = _depth(found, (x - half_px, y - half_px, side, side))
    z, sd = sqrt(lens.fx_px * lens.fy_px) * m_per_px, _LENGTH_SPREAD
    if depth is not None:
        z, sd = depth[0], hypot(_LEAST_SD, 0.5 * depth[1] / depth[0])
        z += _FACE_RADIUS_M if kind == "face" else 0.0  # the middle of a head
    p_m = scale(vec(rays([at_px], lens)[0]), z)
    along_sd_m, measured = norm(p_m) * sd, depth is not None
    return Located(kind, p_m, None, _HAND_RADIUS_M, depth_measured=measured, along_sd_m=along_sd_m)


def _depth(found: Detections, box: tuple[float, float, float, float]) -> tuple[float, float] | None:
    """Return the measured depth in a box and its spread, None if it is uncertain."""
    if found.depth_m is None:
        return None
    z, spread, valid = depth_at(found.depth_m, box)
    if z is None or valid < _LEAST_SHARE or spread > _MOST_SPREAD_M:
        return None
    return z, spread


def _depth_ratio(
    face: DetectedFace, pose: FacePose, found: Detections
) -> tuple[float, float] | None:
    """Return the ratio of measured distance to distance from size, and its relative deviation.

    Return None if the camera's depth does not give the distance of this face.
    """
    if found.depth_m is None:
        return None
    low, high = face.landmarks_px.min(axis=0), face.landmarks_px.max(axis=0)
    (x, y), (width, height) = low.tolist(), (high - low).tolist()
    depth = _depth(found, (x, y, width, height))
    if depth is None:
        return None
    z, spread = depth
    # Between eyes and mouth the surface is behind the tip of the nose, which defines the
    # position.
    behind = float((LANDMARKS_FACE_M @ np.array(pose.R_camera_face).T)[:, 2].mean())
    share = (z - behind) / pose.p_camera_m[2]
    if not 1.0 / _MOST_DEPTH_RATIO < share < _MOST_DEPTH_RATIO:
        return None
    return share, hypot(_LEAST_SD, 0.5 * spread / z)


def _is_flat(face: DetectedFace, found: Detections) -> bool:
    """Return whether a face is in one plane with what is beside and above it."""
    if found.depth_m is None:
        return False
    (x, y), side = face.landmarks_px.mean(axis=0).tolist(), float(np.ptp(face.landmarks_px[:, 1]))
    middle, *around = (
        _depth(found, (x + (across - 0.5) * side, y + (down - 0.5) * side, side, side))
        for across, down in ((0.0, 0.0), *_AROUND)
    )
    if middle is None:
        return False
    most_m = _FLAT_M + _FLAT_PER_M2 * middle[0] ** 2
    return all(one is not None and abs(one[0] - middle[0]) < most_m for one in around)


def _is_face_of(person: DetectedPerson, face: DetectedFace) -> bool:
    x, y = face.landmarks_px.mean(axis=0).tolist()
    apart = hypot(x - person.head_px[0], y - person.head_px[1])
    return apart < _OWN_FACE * person.trunk_px


def _is_on_chest(face: DetectedFace, other: DetectedFace) -> bool:
    """Return whether an uncertain or a small face is on the chest of another one."""
    (x, y, wide, high), (its_x, its_y, its_wide, its_high) = face.box_px, other.box_px
    sure = face.confidence > _DOUBTFUL or 1.0 - face.confidence < _SURER * (1.0 - other.confidence)
    if sure and wide > _SMALL * its_wide:
        return False
    aside = abs(x + 0.5 * wide - its_x - 0.5 * its_wide)
    below = y + 0.5 * high - its_y - 0.5 * its_high
    near, far = _ON_CHEST
    return aside < _ASIDE * its_high and near * its_high < below < far * its_high


def _thing(blob: MovingBlob, lens: Intrinsics) -> Located | None:
    """Return a moving thing with the errors of its position, None if a number is not finite."""
    far, speed = norm(blob.p_camera_m), norm(blob.v_camera_m_s or (0.0, 0.0, 0.0))
    fastest = *(blob.fastest_m or ()), *(blob.fastest_m_s or ())
    numbers = far, speed, blob.radius_m, blob.spin_rad_s, blob.depth_sd_m, blob.thickness_m
    if not all(map(isfinite, (*numbers, *fastest))):
        return None
    # The error of the growth may be infinite.
    shape = 0.0 if blob.depth_known else _SHAPE_1_S
    loom_sd = min(hypot(blob.loom_sd_1_s or _LOOM_SD_1_S, shape), _MOST_LOOM_SD_1_S)
    return Located(
        blob.kind,
        blob.p_camera_m,
        None,
        blob.radius_m,
        blob.spin_rad_s,
        depth_measured=blob.depth_known,
        across_sd_m=hypot(_PLACED_M, _MIDDLE_OF_RADIUS * blob.radius_m if blob.box_px else 0.0),
        along_sd_m=hypot(_LEAST_SD * far, blob.depth_sd_m),
        v_m_s=blob.v_camera_m_s,
        across_sd_m_s=hypot(_FLOW_SHARE * speed, far * _FLOW_RAD_S),
        along_sd_m_s=far * loom_sd,
        detector_id=blob.id,
        fastest_m=blob.fastest_m,
        fastest_m_s=blob.fastest_m_s,
        compact=_is_compact(blob),
        thickness_m=blob.thickness_m,
        from_side=blob.from_side,
        upper_m=_upper_end(blob, lens, far),
    )


def _upper_end(blob: MovingBlob, lens: Intrinsics, far_m: float) -> Vec3 | None:
    """Return the position of the head if a patch is an upright person, else None."""
    if blob.box_px is None:
        return None
    x, y, width, height = blob.box_px
    if not height > _UPRIGHT * width > 0.0:
        return None
    ray = vec(rays([(x + 0.5 * width, y + _HEAD_DOWN * height)], lens)[0])
    return scale(ray, far_m / norm(ray))


def _swept_m(blob: MovingBlob) -> float:
    """Return the radius of a thing plus its path in a tenth of a second."""
    return blob.radius_m + (0.1 * norm(blob.v_camera_m_s) if blob.v_camera_m_s else 0.0)


def _is_compact(blob: MovingBlob) -> bool:
    """Return whether a patch is about as wide as high and fills its box like a disc."""
    if blob.box_px is None:
        return False
    _, _, width, height = blob.box_px
    return (
        min(width, height) > _LEAST_ASPECT * max(width, height) > 0.0
        and blob.area_px > _LEAST_FILL * width * height
    )
