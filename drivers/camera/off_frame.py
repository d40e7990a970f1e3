"""Faces whose landmarks are not in the frame: no such face is looked at.

A net may guess a point or two of a face that the edge cuts; a face whose middle lies outside, or a
point of which lies farther outside than the face is large, is a mistake of the detector, mostly
pixels of another size of frame.
"""

from math import isnan

from gazerig.drivers.types import DetectedFace


def is_off_frame(face: DetectedFace, width_px: int, height_px: int) -> bool:
    """Return whether the landmarks of a face are not those of a face in the frame."""
    points: list[tuple[float, float]] = face.landmarks_px.tolist()
    if not points:
        return False  # a face without points: whoever needs them says so
    xs, ys = [x for x, _ in points], [y for _, y in points]
    x, y = sum(xs) / len(xs), sum(ys) / len(ys)
    if isnan(x) or isnan(y):
        return False  # no numbers: the same
    right, bottom = width_px - 0.5, height_px - 0.5
    if not (-0.5 <= x <= right and -0.5 <= y <= bottom):
        return True
    left_x, right_x, top_y, bottom_y = min(xs), max(xs), min(ys), max(ys)
    size = max(right_x - left_x, bottom_y - top_y)
    least = -0.5 - size
    return min(left_x, top_y) < least or right_x > right + size or bottom_y > bottom + size


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
            if is_off_frame(face, width_px, height_px):
                self._told = True
                x, y = face.landmarks_px.mean(axis=0).tolist()
                return (
                    f"a face with landmarks about ({x:.0f}, {y:.0f}), outside the frame of "
                    f"{width_px} x {height_px}, is left out, and so is every other: a detector "
                    "must give them in pixels of the frame it was given",
                )
        return ()
