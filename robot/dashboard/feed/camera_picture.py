"""Pictures of the camera for clients: a small JPEG, and what was detected in it."""

from typing import Any, cast

import cv2
import numpy as np

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import Detections, ImageArray
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.intrinsics import project
from gazerig.robot.net.topics import (
    Picture,
    Pixel,
    SeenFace,
    SeenPerson,
    SeenThing,
    ShownPicture,
)

WIDTH_PX = 640
_JPEG_QUALITY = 65
_DARK_GROUND = 38
_NEAREST_M = 0.05
"""Smallest distance of a marked point from the plane of the camera, m."""


def camera_picture(
    found: Detections, lens: Intrinsics, R: Mat3, p_m: Vec3, gaze_point_m: Vec3
) -> ShownPicture:
    """Return a frame and its detections.

    Args:
        found: Frame; without an image it is shown as a dark ground.
        lens: Lens of the full frame.
        R: Rotation of the camera in the world at the exposure.
        p_m: Its position.
        gaze_point_m: Gaze point at the exposure, world.
    """
    picture = Picture(
        found.number,
        found.captured_s,
        found.width_px,
        found.height_px,
        gaze_pixel(gaze_point_m, R, p_m, lens),
        tuple(
            SeenFace(
                _rounded(face.box_px), tuple(map(_rounded, face.landmarks_px)),
                round(float(face.confidence), 2),
            )
            for face in found.faces
        ),
        tuple(
            SeenPerson(
                _rounded(one.box_px), _rounded(one.head_px), round(float(one.confidence), 2)
            )
            for one in found.people
        ),
        _things(found, lens),
        found.conditions,
    )  # fmt: skip
    return ShownPicture(picture, encode(_shrink(found)))


def gaze_pixel(point_m: Vec3, R: Mat3, p_m: Vec3, lens: Intrinsics) -> Pixel | None:
    """Return the gaze point in the image of a camera at (R, p_m), None if it is behind it."""
    seen = (np.array(point_m) - np.array(p_m)) @ np.array(R)
    return _rounded(project(seen, lens)[0]) if seen[2] >= _NEAREST_M else None


def encode(image: ImageArray) -> bytes:
    """Encode a BGR image as JPEG."""
    done, jpeg = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
    if not done:
        raise ValueError(f"an image of shape {image.shape} cannot be written as JPEG")
    return jpeg.tobytes()


def _things(found: Detections, lens: Intrinsics) -> tuple[SeenThing, ...]:
    """Return the moving things before the camera, and the palms."""
    blobs = [
        SeenThing(
            blob.kind,
            _rounded(project([blob.p_camera_m], lens)[0]),
            round(lens.fx_px * blob.radius_m / blob.p_camera_m[2], 1),
        )
        for blob in found.blobs
        if blob.p_camera_m[2] >= _NEAREST_M
    ]
    palms = [
        SeenThing("hand", _rounded(palm.centre_px), round(0.5 * palm.size_px, 1))
        for palm in found.palms or ()
    ]
    return (*blobs, *palms)


def _rounded(values: Any) -> Any:
    return tuple(round(float(value), 1) for value in values)


def _shrink(found: Detections) -> ImageArray:
    scale = min(1.0, WIDTH_PX / found.width_px)
    width = max(1, round(found.width_px * scale))
    height = max(1, round(found.height_px * scale))
    if found.image is None:
        return np.full((height, width, 3), _DARK_GROUND, np.uint8)
    if found.image.shape[:2] == (height, width):
        return found.image
    size = (width, height)
    return cast(ImageArray, cv2.resize(found.image, size, interpolation=cv2.INTER_AREA))
