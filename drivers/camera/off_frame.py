"""Faces with landmarks outside the frame; such faces are ignored.

A network may guess points of a face cut by the edge; a face whose centre is outside is not in view.
If a face or a landmark is farther outside than the size of the face, the detector is wrong, usually
because its pixels belong to another frame size; that is reported.
"""

from math import isnan

from gazerig.drivers.types import DetectedFace


def is_off_frame(face: DetectedFace, width_px: int, height_px: int) -> bool:
    """Return whether a face is outside the frame by its landmarks."""
    points: list[tuple[float, float]] = face.landmarks_px.tolist()
    if not points:
        return False  # a face without points: its consumer reports that
    x, y = sum(x for x, _ in points) / len(points), sum(y for _, y in points) / len(points)
    if isnan(x) or isnan(y):
        return False  # not numbers: likewise
    outside = _outside_px(x, y, width_px, height_px)
    return outside > 0.0 or _is_misplaced(points, width_px, height_px)


def _outside_px(x: float, y: float, width_px: int, height_px: int) -> float:
    """Return the distance of a point outside the frame; negative inside."""
    return max(-0.5 - x, x - width_px + 0.5, -0.5 - y, y - height_px + 0.5)


def _is_misplaced(points: list[tuple[float, float]], width_px: int, height_px: int) -> bool:
    """Return whether a point is farther outside the frame than the size of the face."""
    size = max((max(along) - min(along) for along in zip(*points, strict=True)), default=0.0)
    return any(_outside_px(x, y, width_px, height_px) > size for x, y in points)


class OffFrameReport:
    """Report, made once, that a detector returns such faces."""

    def __init__(self) -> None:
        self._reported = False

    def report(
        self, faces: tuple[DetectedFace, ...], width_px: int, height_px: int
    ) -> tuple[str, ...]:
        """Return the line about the faces of a frame, or an empty tuple."""
        if self._reported:
            return ()
        for face in faces:
            if _is_misplaced(face.landmarks_px.tolist(), width_px, height_px):
                self._reported = True
                x, y = face.landmarks_px.mean(axis=0).tolist()
                return (
                    f"a face with landmarks about ({x:.0f}, {y:.0f}), outside the frame of "
                    f"{width_px} x {height_px}, is ignored, as are all such faces: a detector "
                    "must return pixels of the frame that it was given",
                )
        return ()
