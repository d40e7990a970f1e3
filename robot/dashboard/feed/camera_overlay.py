"""Draw detections into the camera image, scaled down for the page."""

from typing import cast

import cv2
import numpy as np

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import Detections, ImageArray
from gazerig.gaze.types import Floats
from gazerig.robot.dashboard.feed.gaze_trail import EVERY_S
from gazerig.robot.model.intrinsics import project

IMAGE_WIDTH_PX = 640
_JPEG_QUALITY = 80
_FACE = (120, 220, 90)  # BGR
_LANDMARK = (255, 255, 255)
_BLOB = (255, 170, 60)
_GAZE, _GAZE_EDGE = (40, 130, 255), (250, 250, 250)
_DARK_GROUND = 38

Point = tuple[int, int]


def draw_detections(
    image: ImageArray | None,
    detections: Detections,
    gaze_px: tuple[float, float] | None,
    lens: Intrinsics,
    *,
    faces: bool = True,
    heat_px: Floats | None = None,
) -> ImageArray:
    """Draw faces, landmarks, moving blobs and the gaze point into a copy.

    image: the camera's image, None if the source has none: a dark background
    gaze_px: gaze point of the rig in the full image, pixels; None draws none
    lens: lens of the full image; it places the blobs
    faces: whether faces, landmarks and blobs are drawn
    heat_px: past gaze points (n, 2) in the full image, pixels; None draws none
    Returns an image at most IMAGE_WIDTH_PX wide; the input is not changed.
    """
    scale = min(1.0, IMAGE_WIDTH_PX / detections.width_px)
    drawn = _shrink(image, detections, scale)
    if heat_px is not None:
        draw_heat(drawn, scale * heat_px)
    for person in detections.people if faces else ():
        x, y, width, height = person.box_px
        corner = _pixel(x, y, scale)
        cv2.rectangle(drawn, corner, _pixel(x + width, y + height, scale), _FACE, 1, cv2.LINE_AA)
        cv2.circle(drawn, _pixel(*person.head_px, scale), 4, _FACE, 1, cv2.LINE_AA)
        _draw_text(drawn, f"person {person.confidence:.2f}", corner, _FACE)
    for palm in (detections.palms or ()) if faces else ():
        radius = max(2, round(0.5 * palm.size_px * scale))
        cv2.circle(drawn, _pixel(*palm.centre_px, scale), radius, _BLOB, 1, cv2.LINE_AA)
    for face in detections.faces if faces else ():
        x, y, width, height = face.box_px
        corner = _pixel(x, y, scale)
        cv2.rectangle(drawn, corner, _pixel(x + width, y + height, scale), _FACE, 2, cv2.LINE_AA)
        _draw_text(drawn, f"{face.confidence:.2f}", corner, _FACE)
        for landmark_x, landmark_y in face.landmarks_px:
            cv2.circle(drawn, _pixel(landmark_x, landmark_y, scale), 2, _LANDMARK, -1, cv2.LINE_AA)
    for blob in detections.blobs if faces else ():
        z = blob.p_camera_m[2]
        if z <= 0.0:  # behind the camera
            continue
        u, v = project([blob.p_camera_m], lens)[0].tolist()
        radius = max(2, _clip(lens.fx_px * blob.radius_m / z * scale))
        centre = _pixel(u, v, scale)
        cv2.circle(drawn, centre, radius, _BLOB, 1, cv2.LINE_AA)
        _draw_text(drawn, blob.kind, (centre[0] - radius, centre[1] - radius), _BLOB)
    if gaze_px is not None:
        share = drawn.shape[1] / IMAGE_WIDTH_PX  # small images are shown in the same size
        ring, edge, line, dot = (max(2, round(share * px)) for px in (14, 5, 3, 3))
        at = _pixel(*gaze_px, scale)
        cv2.circle(drawn, at, ring, _GAZE_EDGE, edge, cv2.LINE_AA)
        cv2.circle(drawn, at, ring, _GAZE, line, cv2.LINE_AA)
        cv2.circle(drawn, at, dot, _GAZE, -1, cv2.LINE_AA)
    return drawn


def encode(image: ImageArray) -> bytes:
    """Encode a BGR image as JPEG."""
    done, jpeg = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
    if not done:
        raise ValueError(f"an image of shape {image.shape} cannot be written as JPEG")
    return jpeg.tobytes()


def _shrink(image: ImageArray | None, detections: Detections, scale: float) -> ImageArray:
    width = max(1, round(detections.width_px * scale))
    height = max(1, round(detections.height_px * scale))
    if image is None:
        return np.full((height, width, 3), _DARK_GROUND, np.uint8)
    if image.shape[:2] == (height, width):
        return image.copy()
    return cast(ImageArray, cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA))


def _draw_text(drawn: ImageArray, text: str, at: Point, colour: tuple[int, int, int]) -> None:
    above = (at[0], max(12, at[1] - 4))
    cv2.putText(drawn, text, above, cv2.FONT_HERSHEY_SIMPLEX, 0.5, colour, 1, cv2.LINE_AA)


def _pixel(x: float, y: float, scale: float) -> Point:
    return _clip(x * scale), _clip(y * scale)


def _clip(value: float) -> int:
    """Round and limit; OpenCV draws wrongly at coordinates beyond 16 bits."""
    return round(min(max(value, -30_000.0), 30_000.0))


_SMALL = 8  # pixels of the image for each pixel of the map
_BLUR = 2.6  # in pixels of the map
_FULL = 0.05  # blurred seconds of the map at which the colour is hottest
_STRONGEST = 0.62


def draw_heat(image: ImageArray, points_px: Floats) -> None:
    """Draw the density of points (n, 2), pixels, over an image, in place."""
    height, width = image.shape[:2]
    low = np.zeros((-(-height // _SMALL), -(-width // _SMALL)), np.float32)
    cells = np.floor(points_px / _SMALL)
    inside = (cells >= 0).all(axis=1) & (cells[:, 0] < low.shape[1]) & (cells[:, 1] < low.shape[0])
    columns, rows = cells[inside].astype(int).T
    np.add.at(low, (rows, columns), EVERY_S)
    low = cv2.GaussianBlur(low, (0, 0), _BLUR).astype(np.float32)
    share = np.clip(low / _FULL, 0.0, 1.0)
    colours = cv2.applyColorMap((255.0 * share).astype(np.uint8), cv2.COLORMAP_INFERNO)
    size = (width, height)
    over = cv2.resize(colours, size, interpolation=cv2.INTER_LINEAR).astype(np.float32)
    part = cv2.resize(_STRONGEST * np.sqrt(share), size, interpolation=cv2.INTER_LINEAR)[..., None]
    image[:] = (image * (1.0 - part) + over * part).astype(np.uint8)
