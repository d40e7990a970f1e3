"""What one picture shows: faces and what moves."""

from collections.abc import Callable

from gazerig.drivers.camera.source import Shot
from gazerig.drivers.types import Detections, FaceDetector, MovingBlob

Motion = Callable[[Shot], tuple[MovingBlob, ...]]
"""Finds what moves, from one picture to the next."""


def look(shot: Shot, detector: FaceDetector, motion: Motion | None = None) -> Detections:
    """Find the faces of a picture, unless the camera itself has, and what moves in it."""
    faces = shot.faces if shot.faces is not None else detector.find(shot.picture)
    blobs = motion(shot) if motion is not None else ()
    height, width = shot.picture.shape[:2]
    return Detections(
        shot.captured_s,
        shot.number,
        width,
        height,
        faces,
        blobs,
        shot.picture,
        shot.depth_m,
        shot.lens,
    )
