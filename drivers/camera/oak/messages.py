"""Conversion of an OAK pipeline's messages to frames with distances, lens and faces."""

from math import isfinite
from typing import Any

import numpy as np

from gazerig.drivers.camera.depth_roi import resize_depth, to_metres
from gazerig.drivers.camera.oak.pipeline import COLOUR, DEPTH, FACES
from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.camera.source import to_bgr
from gazerig.drivers.types import Depth, DetectedFace, ImageArray

_LANDMARKS = 5
# A frame without a lens contains the unit matrix.
_LEAST_FOCAL_PX = 10.0


def message_names(group: Any) -> set[str]:
    """Return the names of the messages in a group."""
    return set(group.getMessageNames())


def image_of(group: Any) -> ImageArray | None:
    """Return the colour frame of a group, None if it has none."""
    return to_bgr(group[COLOUR].getCvFrame())


def depth_of(group: Any, width_px: int, height_px: int) -> Depth | None:
    """Return the depth of a group in metres and in the size of its frame."""
    if DEPTH not in message_names(group):
        return None
    mm = np.asarray(group[DEPTH].getFrame())
    if mm.dtype != np.uint16 or mm.ndim != 2 or not mm.size:
        return None
    return resize_depth(to_metres(mm), width_px, height_px)


def lens_of(group: Any) -> Intrinsics | None:
    """Return the lens of the frame, None if it has none."""
    matrix = np.asarray(group[COLOUR].getTransformation().getIntrinsicMatrix(), dtype=float)
    if matrix.shape != (3, 3) or not np.isfinite(matrix).all() or matrix[0, 0] < _LEAST_FOCAL_PX:
        return None
    return Intrinsics(
        float(matrix[0, 0]), float(matrix[1, 1]), float(matrix[0, 2]), float(matrix[1, 2])
    )


def faces_of(
    group: Any, width_px: int, height_px: int, min_confidence: float
) -> tuple[DetectedFace, ...] | None:
    """Return the faces that the camera found, the largest first; None if it did not search.

    Detections without five landmarks are omitted, as their gaze is unknown.
    """
    if FACES not in message_names(group):
        return None
    message = group[FACES]
    target = group[COLOUR].getTransformation()
    if message.getTransformation() is not None and target is not None:
        message = message.transformTo(target)
    found = [_face(detection, width_px, height_px) for detection in message.detections]
    sure = [face for face in found if face is not None and face.confidence >= min_confidence]
    return tuple(sorted(sure, key=lambda face: -face.box_px[2] * face.box_px[3]))


def _face(detection: Any, width_px: int, height_px: int) -> DetectedFace | None:
    """Convert a detection from shares of the frame to pixels."""
    points = np.array([[p.x, p.y] for p in detection.getKeypoints2f()], dtype=np.float64)
    edges = (detection.xmin, detection.ymin, detection.xmax, detection.ymax)
    if points.shape != (_LANDMARKS, 2) or not all(map(isfinite, (*edges, *points.ravel()))):
        return None
    # Pixels have their centres at whole numbers; the frame begins half a pixel before 0.
    landmarks = points * (width_px, height_px) - 0.5
    left, top, right, bottom = edges
    box = (
        left * width_px - 0.5,
        top * height_px - 0.5,
        (right - left) * width_px,
        (bottom - top) * height_px,
    )
    landmarks.setflags(write=False)
    return DetectedFace(box, landmarks, min(1.0, max(0.0, float(detection.confidence))))
