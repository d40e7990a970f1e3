"""Faces whose landmarks are not in the frame: no such face is looked at.

A net may guess points of a face that the edge cuts; one whose middle lies outside is not in view. A
face that lies farther outside than it is large, or a point of it, is a mistake of the detector,
mostly pixels of another size of frame; that is told.
"""

from math import isnan

from gazerig.drivers.types import DetectedFace


def is_off_frame(face: DetectedFace, width_px: int, height_px: int) -> bool:
    """Return whether the landmarks of a face are not those of a face in the frame."""
    points: list[tuple[float, float]] = face.landmarks_px.tolist()
    if not points:
        return False  # a face without points: whoever needs them says so
    x, y = sum(x for x, _ in points) / len(points), sum(y for _, y in points) / len(points)
    if isnan(x) or isnan(y):
        return False  # no numbers: the same
    outside = _outside_px(x, y, width_px, height_px)
    return outside > 0.0 or _is_misplaced(points, width_px, height_px)


def _outside_px(x: float, y: float, width_px: int, height_px: int) -> float:
    """Return how far a point is outside the frame; negative inside."""
    return max(-0.5 - x, x - width_px + 0.5, -0.5 - y, y - height_px + 0.5)


def _is_misplaced(points: list[tuple[float, float]], width_px: int, height_px: int) -> bool:
    """Return whether a point lies farther outside the frame than the face is large."""
    size = max((max(along) - min(along) for along in zip(*points, strict=True)), default=0.0)
    return any(_outside_px(x, y, width_px, height_px) > size for x, y in points)


class OffFrameReport:
    """Tells once that a detector gives such faces."""

    def __init__(self) -> None:
        self._told = False

    def told_of(
        self, faces: tuple[DetectedFace, ...], width_px: int, height_px: int
    ) -> tuple[str, ...]:
        """Return the line to tell of the faces of a frame; empty where there is none."""
        if self._told:
            return ()
        for face in faces:
            if _is_misplaced(face.landmarks_px.tolist(), width_px, height_px):
                self._told = True
                x, y = face.landmarks_px.mean(axis=0).tolist()
                return (
                    f"a face with landmarks about ({x:.0f}, {y:.0f}), outside the frame of "
                    f"{width_px} x {height_px}, is left out, and so is every other: a detector "
                    "must give them in pixels of the frame it was given",
                )
        return ()
