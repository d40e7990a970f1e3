"""Localisation of an image's contents in the camera's axes, from image and calibration only.

It runs next to the detector, in the camera's process. Across the line of view a position is
accurate to about a pixel. Along it, the accuracy is that of the camera's depth if the camera
measures one there; otherwise it is limited by the spread of face sizes.
"""

from collections.abc import Callable
from dataclasses import dataclass
from heapq import nlargest
from math import degrees, hypot, isfinite, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera import depth_roi
from gazerig.drivers.camera.capture_loop import is_off_frame
from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import (
    DetectedFace,
    DetectedPalm,
    DetectedPerson,
    DetectionInCamera,
    Detections,
    LocatedFrame,
    MovingBlob,
)
from gazerig.gaze.angles import norm, scale
from gazerig.gaze.types import Vec3
from gazerig.robot.model.face_geometry import LANDMARKS_FACE_M, PUPIL_DISTANCE_M
from gazerig.robot.model.frames import LensParams
from gazerig.robot.model.intrinsics import intrinsics_of_lens, lens_fault, rays
from gazerig.robot.perception.face_pose import FacePose, face_pose
from gazerig.robot.perception.mesh_reading import read_mesh

Box = tuple[float, float, float, float]
"""x, y, width, height in pixels."""
Reading = tuple[float | None, float, float]
"""Distance along the optical axis (m), its spread (m), and the share of pixels with a distance."""
DepthAt = Callable[[NDArray[Any], Box], Reading]
"""Reads the distance of a box of pixels from a depth image."""

_FACE_RADIUS_M = 0.1
# Length from the hips of a person to the top of the head as the detector defines it, its spread
# over people and postures, and the error of the head's centre. Measured on three people in front of
# webcams, by the distance of their eyes: .76 to .87 m, and 2 cm.
_TRUNK_M, _TRUNK_SPREAD, _HEAD_SD_M = 0.83, 0.15, 0.05
# Length from the wrist of an adult to the root of the middle finger, its spread over people and
# postures, and the error of its centre; radius of a hand.
_PALM_M, _PALM_SPREAD, _PALM_SD_M, _HAND_RADIUS_M = 0.088, 0.15, 0.03, 0.07
# A head outside the image is placed inside it by this fraction of its width: over the visible body.
_EDGE = 0.02
# A face this near to the centre of a person's head, in trunk lengths, is that person's.
_OWN_FACE = 0.25
# A face printed on a shirt is rejected: its confidence is below this, and below another's divided
# by this factor, and its middle is within these distances below and aside of the other's, in
# heights of that one.
_DOUBTFUL, _SURER, _ON_CHEST, _ASIDE = 0.9, 10.0, (1.0, 3.0), 1.0
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
# Accepted sizes of a face, relative to an adult's.
_SMALLEST, _LARGEST = 0.3, 3.0
# The centre of a patch wanders within it; the error of its flow is proportional to the flow and to
# the search range.
_MIDDLE_OF_RADIUS, _PLACED_M = 0.3, 0.002
_FLOW_SHARE, _FLOW_RAD_S, _LOOM_SD_1_S = 0.1, 0.03, 0.5
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
# A face has no measured velocity; these fields are errors of a velocity.
_NO_SPEED_SDS = (0.1, 0.5)


@dataclass(frozen=True)
class FrameLocator:
    """Locates faces and things in the camera's axes by one calibration; picklable.

    lens: measured lens; field_rad: horizontal field of view, used without a measured lens
    depth_at: reads depth images; None: distances come from the size of faces
    """

    lens: LensParams | None
    field_rad: float
    depth_at: DepthAt | None = depth_roi.depth_at

    def __call__(self, found: Detections) -> LocatedFrame:
        """Return a frame's contents in the camera's axes."""
        return self.locate(found, self.intrinsics(found))

    def intrinsics(self, found: Detections) -> Intrinsics:
        """Return the intrinsics of a frame: measured, the camera's, or from the field of view."""
        size_px = found.width_px, found.height_px
        return intrinsics_of_lens(self.lens, self.field_rad, *size_px, found.lens)

    def fault(self, found: Detections) -> str:
        """Return why the measured lens is not used for a frame, in one line; "" if it is used."""
        if self.lens is None:
            return ""
        why = lens_fault(self.lens, found.width_px, found.height_px)
        if not why:
            return ""
        field = f"the field of view of {degrees(self.field_rad):.0f} deg"
        instead = "what the camera reports" if found.lens is not None else field
        return (
            f"camera.lens does not fit: {why}; {instead} is used instead: calibrate the lens at "
            "this size (gazerig calibrate camera), or ask the camera for that one"
        )

    def locate(self, found: Detections, intrinsics: Intrinsics) -> LocatedFrame:
        """Return the contents of a frame of known intrinsics in the camera's axes."""
        inside = [
            face
            for face in found.faces
            if not is_off_frame(face, found.width_px, found.height_px)
            and not any(_is_on_chest(face, other) for other in found.faces)
        ]
        faces = [self._face(face, found, intrinsics) for face in inside]
        faces += [
            self._person(person, found, intrinsics)
            for person in found.people
            if not any(_is_face_of(person, face) for face in inside)
        ]
        blobs = found.blobs
        if len(blobs) > _MOST_THINGS:
            blobs = tuple(nlargest(_MOST_THINGS, blobs, key=_swept_m))
        things = [thing_in_camera(blob, intrinsics) for blob in blobs]
        return LocatedFrame(
            intrinsics,
            tuple([face for face in faces if face is not None]),
            tuple([thing for thing in things if thing is not None]),
            None
            if found.palms is None
            else tuple([self._palm(palm, found, intrinsics) for palm in found.palms]),
        )

    def _face(
        self, face: DetectedFace, found: Detections, lens: Intrinsics
    ) -> DetectionInCamera | None:
        """Locate a face, None if its landmarks are not those of a face from its front."""
        reading = read_mesh(face.mesh, lens) if face.mesh is not None else None
        pose = face_pose(face.landmarks_px, lens) if reading is None else reading.pose
        if pose is None:
            return None
        gaze, signs = face.gaze_camera, face.signs
        if reading is not None:
            gaze, signs = reading.gaze_camera or gaze, reading.signs
        focal_px = sqrt(lens.fx_px * lens.fy_px)
        eyes_px = focal_px * PUPIL_DISTANCE_M / pose.p_camera_m[2]
        far = norm(pose.p_camera_m)
        measured = self._depth_ratio(face, pose, found)
        share, sd = (
            measured if measured is not None else (1.0, hypot(_SIZE_PX / eyes_px, _SIZE_OF_EYES))
        )
        return DetectionInCamera(
            "face",
            scale(pose.p_camera_m, share),
            pose.R_camera_face,
            _FACE_RADIUS_M,
            0.0,
            face.confidence,
            pose.length,
            measured is not None,
            share * far * hypot(_CENTRE_PX, _CENTRE_OF_EYES * eyes_px) / focal_px,
            share * far * sd,
            None,
            *_NO_SPEED_SDS,
            None if measured is None else 1.0 / share,
            None,
            pose.turn_sd_rad,
            gaze,
            signs=signs,
            clothing=face.clothing,
        )

    def _person(
        self, person: DetectedPerson, found: Detections, lens: Intrinsics
    ) -> DetectionInCamera:
        """Locate the head of a person without a visible face, or the visible part nearest to it."""
        (x, y), edge = person.head_px, _EDGE * found.width_px
        at_px = (
            min(max(x, edge), found.width_px - edge),
            min(max(y, edge), found.height_px - edge),
        )
        z, sd = sqrt(lens.fx_px * lens.fy_px) * _TRUNK_M / person.trunk_px, _TRUNK_SPREAD
        depth = self._depth_about(found, at_px, person.trunk_px * _FACE_RADIUS_M / _TRUNK_M)
        if depth is not None:
            z, sd = depth[0] + _FACE_RADIUS_M, hypot(_LEAST_SD, 0.5 * depth[1] / depth[0])
        p_m = _point_at_depth(at_px, z, lens)
        return DetectionInCamera(
            "face", p_m, None, _FACE_RADIUS_M, 0.0, person.confidence, 1.0, depth is not None,
            _HEAD_SD_M, norm(p_m) * sd, None, *_NO_SPEED_SDS, None, None, clothing=person.clothing,
        )  # fmt: skip

    def _palm(self, palm: DetectedPalm, found: Detections, lens: Intrinsics) -> DetectionInCamera:
        """Locate a palm, by its size if its depth is not measured."""
        z, sd = sqrt(lens.fx_px * lens.fy_px) * _PALM_M / palm.size_px, _PALM_SPREAD
        depth = self._depth_about(found, palm.centre_px, 0.25 * palm.size_px)
        if depth is not None:
            z, sd = depth[0], hypot(_LEAST_SD, 0.5 * depth[1] / depth[0])
        p_m = _point_at_depth(palm.centre_px, z, lens)
        return DetectionInCamera(
            "hand", p_m, None, _HAND_RADIUS_M, 0.0, palm.confidence, 1.0, depth is not None,
            _PALM_SD_M, norm(p_m) * sd, None, *_NO_SPEED_SDS, None, None,
        )  # fmt: skip

    def _depth_about(
        self, found: Detections, at_px: tuple[float, float], half_px: float
    ) -> tuple[float, float] | None:
        """Return the measured depth in a square with a centre and half side; see _depth."""
        (x, y), side = at_px, 2.0 * half_px
        return self._depth(found, (x - half_px, y - half_px, side, side))

    def _depth(self, found: Detections, box: Box) -> tuple[float, float] | None:
        """Return the measured depth in a box and its spread, None if it is uncertain."""
        if found.depth_m is None or self.depth_at is None:
            return None
        z, spread, valid = self.depth_at(found.depth_m, box)
        if z is None or not (isfinite(z) and z > 0.0 and valid >= _LEAST_SHARE):
            return None
        return (z, spread) if spread <= _MOST_SPREAD_M else None

    def _depth_ratio(
        self, face: DetectedFace, pose: FacePose, found: Detections
    ) -> tuple[float, float] | None:
        """Return the ratio of measured distance to distance from size, and its relative deviation.

        Return None if the camera's depth does not give the distance of this face.
        """
        if found.depth_m is None:
            return None
        low, high = face.landmarks_px.min(axis=0), face.landmarks_px.max(axis=0)
        (x, y), (width, height) = low.tolist(), (high - low).tolist()
        depth = self._depth(found, (x, y, width, height))
        if depth is None:
            return None
        z, spread = depth
        # Between eyes and mouth the surface is behind the tip of the nose, which defines the
        # position.
        behind = float((LANDMARKS_FACE_M @ np.array(pose.R_camera_face).T)[:, 2].mean())
        share = (z - behind) / pose.p_camera_m[2]
        if not _SMALLEST < share < _LARGEST:
            return None
        return share, hypot(_LEAST_SD, 0.5 * spread / z)


def _point_at_depth(at_px: tuple[float, float], z_m: float, lens: Intrinsics) -> Vec3:
    """Return the position of a pixel at a depth along the optical axis."""
    x, y, z = rays(np.array([at_px]), lens)[0].tolist()
    return scale((x, y, z), z_m)


def _is_face_of(person: DetectedPerson, face: DetectedFace) -> bool:
    """Return whether a face belongs to a person."""
    x, y = face.landmarks_px.mean(axis=0).tolist()
    apart = hypot(x - person.head_px[0], y - person.head_px[1])
    return apart < _OWN_FACE * person.trunk_px


def _is_on_chest(face: DetectedFace, other: DetectedFace) -> bool:
    """Return whether an uncertain face is on the chest of a more certain one."""
    if face.confidence > _DOUBTFUL or 1.0 - face.confidence < _SURER * (1.0 - other.confidence):
        return False
    (x, y, wide, high), (its_x, its_y, its_wide, its_high) = face.box_px, other.box_px
    aside = abs(x + 0.5 * wide - its_x - 0.5 * its_wide)
    below = y + 0.5 * high - its_y - 0.5 * its_high
    near, far = _ON_CHEST
    return aside < _ASIDE * its_high and near * its_high < below < far * its_high


def thing_in_camera(blob: MovingBlob, lens: Intrinsics | None = None) -> DetectionInCamera | None:
    """Return a moving thing with the errors of its position, None if it has no position.

    Args:
        blob: the detected patch.
        lens: lens of the frame; None: the upper end stays unknown.
    """
    far = norm(blob.p_camera_m)
    if not (isfinite(far) and isfinite(blob.radius_m)):
        return None
    drawn = blob.box_px is not None
    v = blob.v_camera_m_s
    if v is not None and not isfinite(norm(v)):
        v = None
    across = hypot(_FLOW_SHARE * (norm(v) if v else 0.0), far * _FLOW_RAD_S)
    shape = 0.0 if blob.depth_known else _SHAPE_1_S
    loom_sd = blob.loom_sd_1_s if blob.loom_sd_1_s > 0.0 else _LOOM_SD_1_S
    return DetectionInCamera(
        blob.kind,
        blob.p_camera_m,
        None,
        blob.radius_m,
        blob.spin_rad_s if isfinite(blob.spin_rad_s) else 0.0,
        1.0,
        1.0,
        blob.depth_known,
        hypot(_PLACED_M, _MIDDLE_OF_RADIUS * blob.radius_m if drawn else 0.0),
        hypot(_LEAST_SD * far, blob.depth_sd_m if isfinite(blob.depth_sd_m) else far),
        v,
        across,
        far * (min(hypot(loom_sd, shape), 10.0) if isfinite(loom_sd) else 10.0),
        None,
        blob.id,
        fastest_m=_finite(blob.fastest_m),
        fastest_m_s=_finite(blob.fastest_m_s),
        compact=_is_compact(blob),
        thickness_m=blob.thickness_m if isfinite(blob.thickness_m) else 0.0,
        from_side=blob.from_side,
        upper_m=None if lens is None else _upper_end(blob, lens, far),
    )


def _upper_end(blob: MovingBlob, lens: Intrinsics, far_m: float) -> Vec3 | None:
    """Return the position of the head if a patch is an upright person, else None."""
    if blob.box_px is None:
        return None
    x, y, width, height = blob.box_px
    if not height > _UPRIGHT * width > 0.0:
        return None
    x_ray, y_ray, z_ray = rays([(x + 0.5 * width, y + _HEAD_DOWN * height)], lens)[0].tolist()
    return scale((x_ray, y_ray, z_ray), far_m / norm((x_ray, y_ray, z_ray)))


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


def _finite(vector: tuple[float, float, float] | None) -> tuple[float, float, float] | None:
    """Return a vector, None if it is missing or not finite."""
    return vector if vector is not None and isfinite(norm(vector)) else None
