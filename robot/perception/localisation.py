"""What a frame shows -> sightings in the world, each with how well it is known.

Across the line of view a place is known to about a pixel. Along it, a distance is as good
as the camera's depth where it has one there, else as what is known of the size of faces.
"""

from collections.abc import Callable
from math import hypot, isfinite, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import DetectedFace, MovingBlob
from gazerig.gaze.angles import add, compose, norm, rotate, scale
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.face_geometry import LANDMARKS_FACE_M, PUPIL_DISTANCE_M
from gazerig.robot.perception.face_pose import FacePose, face_pose
from gazerig.robot.perception.tracker import LocalisedDetection

Box = tuple[float, float, float, float]
"""x, y, width, height in pixels."""
Reading = tuple[float | None, float, float]
"""Distance along the optical axis (m), its spread (m), and the share of pixels with any."""
DepthReader = Callable[[Box], Reading]

_FACE_RADIUS_M = 0.1
# Error of a face's centre from five landmarks: part of a pixel, and of the eyes' distance.
_CENTRE_PX, _CENTRE_OF_EYES = 0.4, 0.015
# Error of its size from frame to frame, the same way. People's eyes themselves lie 6 %
# nearer or farther apart than usual (Gordon et al., ANSUR): that stays, and no filter helps.
_SIZE_PX, _SIZE_OF_EYES = 0.7, 0.03
SIZE_SPREAD = 0.06
# Depth of a face: refused where too few of its pixels have one, or where they belong to
# more than a face; never better than a part of itself.
_LEAST_SHARE, _MOST_SPREAD_M, _LEAST_SD = 0.3, 0.12, 0.01
# The size of a face, over an adult's, that is believed.
_SMALLEST, _LARGEST = 0.3, 3.0
# A blob's middle wanders about in it; its flow is off by part of itself and of the search.
_MIDDLE_OF_RADIUS, _PLACED_M = 0.3, 0.002
_FLOW_SHARE, _FLOW_RAD_S, _LOOM_SD_1_S = 0.1, 0.03, 0.5
# Legs that stride and people who part grow and shrink a patch that comes no nearer; where
# no distance bears a growth out, it is believed the less.
_SHAPE_1_S = 0.3


def face_sighting(
    face: DetectedFace,
    R_world_camera: Mat3,
    p_world_camera_m: Vec3,
    lens: Intrinsics,
    depth: DepthReader | None = None,
) -> LocalisedDetection | None:
    """Place a face in the world, None where its landmarks show none from its front.

    depth: reads the depth image that belongs to the landmarks' frame
    """
    pose = face_pose(face.landmarks_px, lens)
    if pose is None:
        return None
    focal_px = sqrt(lens.fx_px * lens.fy_px)
    eyes_px = focal_px * PUPIL_DISTANCE_M / pose.p_camera_m[2]
    far = norm(pose.p_camera_m)
    measured = _measured(face, pose, depth)
    share, sd = (
        measured if measured is not None else (1.0, hypot(_SIZE_PX / eyes_px, _SIZE_OF_EYES))
    )
    return LocalisedDetection(
        "face",
        add(p_world_camera_m, rotate(R_world_camera, scale(pose.p_camera_m, share))),
        compose(R_world_camera, pose.R_camera_face),
        _FACE_RADIUS_M,
        0.0,
        face.confidence,
        pose.length,
        depth_measured=measured is not None,
        across_sd_m=share * far * hypot(_CENTRE_PX, _CENTRE_OF_EYES * eyes_px) / focal_px,
        along_sd_m=share * far * sd,
        size_depth=None if measured is None else 1.0 / share,
    )


def _measured(
    face: DetectedFace, pose: FacePose, depth: DepthReader | None
) -> tuple[float, float] | None:
    """Return the measured distance over that from the size, and its relative deviation.

    None where the camera's depth does not tell the distance of this face.
    """
    if depth is None:
        return None
    low, high = face.landmarks_px.min(axis=0), face.landmarks_px.max(axis=0)
    (x, y), (width, height) = low.tolist(), (high - low).tolist()
    z, spread, valid = depth((x, y, width, height))
    if z is None or not (isfinite(z) and z > 0.0 and valid >= _LEAST_SHARE):
        return None
    if not spread <= _MOST_SPREAD_M:
        return None
    # Between eyes and mouth the surface lies behind the tip of the nose, the face's place.
    behind = float((LANDMARKS_FACE_M @ np.array(pose.R_camera_face).T)[:, 2].mean())
    share = (z - behind) / pose.p_camera_m[2]
    if not _SMALLEST < share < _LARGEST:
        return None
    return share, hypot(_LEAST_SD, 0.5 * spread / z)


def blob_sighting(
    blob: MovingBlob, R_world_camera: Mat3, p_world_camera_m: Vec3
) -> LocalisedDetection | None:
    """Place something that moves in the world, None where it has no place at all."""
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
    return LocalisedDetection(
        blob.kind,
        add(p_world_camera_m, rotate(R_world_camera, blob.p_camera_m)),
        None,
        blob.radius_m,
        blob.spin_rad_s if isfinite(blob.spin_rad_s) else 0.0,
        1.0,
        depth_measured=blob.depth_known,
        across_sd_m=hypot(_PLACED_M, _MIDDLE_OF_RADIUS * blob.radius_m if drawn else 0.0),
        along_sd_m=hypot(_LEAST_SD * far, blob.depth_sd_m if isfinite(blob.depth_sd_m) else far),
        v_world_m_s=None if v is None else rotate(R_world_camera, v),
        across_sd_m_s=across,
        along_sd_m_s=far * (min(hypot(loom_sd, shape), 10.0) if isfinite(loom_sd) else 10.0),
        mark=blob.id,
    )


def reader_of(
    depth_m: NDArray[Any] | None,
    depth_at: Callable[[NDArray[Any], Box], Reading] | None,
) -> DepthReader | None:
    """Return what reads one depth image, None where there is none or nothing reads it."""
    if depth_m is None or depth_at is None:
        return None
    return lambda box: depth_at(depth_m, box)
