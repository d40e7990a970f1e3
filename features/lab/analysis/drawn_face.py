"""A plain frontal face, drawn to scale, under heat maps of the gaze (Nakamoto & Tsuruno figs 8, 9).

Gaze points are in the face's own frame, y to the owner's left and z up, in metres from the tip of
the nose. On the canvas y, to the owner's left, points right and z points up, as an opposite viewer
sees the face.
"""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.gaze.types import Floats
from gazerig.robot.model.face_geometry import PARTS_FACE_M

WIDTH_PX, HEIGHT_PX = 720, 860
PX_PER_M = 3000.0
# Position of the tip of the nose.
_NOSE_PX = (WIDTH_PX / 2.0, 480.0)

Image = NDArray[np.uint8]
_PAPER, _SKIN, _SHADE = (243, 244, 245), (226, 230, 234), (205, 210, 216)
_INK, _HAIR, _IRIS = (120, 124, 130), (150, 153, 158), (110, 114, 120)
# Factor by which it is drawn larger before it is scaled down, for smooth edges.
_FINE = 3
_Colour = tuple[int, int, int]


def canvas_pixels(points_face_m: Floats) -> Floats:
    """Return the pixels (column, row) of (n, 2) points (y, z) of the face frame."""
    return np.asarray(points_face_m) * (PX_PER_M, -PX_PER_M) + _NOSE_PX


class _Pen:
    """Draws shapes given in millimetres of the face frame on a fine canvas."""

    def __init__(self) -> None:
        size = (HEIGHT_PX * _FINE, WIDTH_PX * _FINE, 3)
        self.canvas: NDArray[np.uint8] = np.full(size, _PAPER, np.uint8)

    def fill_outline(self, yz_mm: Sequence[tuple[float, float]], fill: _Colour) -> None:
        """Fill a closed, smooth outline through points."""
        cv2.fillPoly(self.canvas, [self._pixels(_spline(yz_mm, closed=True))], fill, cv2.LINE_AA)

    def draw_line(
        self, yz_mm: Sequence[tuple[float, float]], width_mm: float, ink: _Colour
    ) -> None:
        """Draw a smooth line through points."""
        wide = max(1, round(width_mm * 1e-3 * PX_PER_M * _FINE))
        path = self._pixels(_spline(yz_mm, closed=False))
        cv2.polylines(self.canvas, [path], False, ink, wide, cv2.LINE_AA)

    def draw_both_sides(
        self, yz_mm: Sequence[tuple[float, float]], width_mm: float, ink: _Colour
    ) -> None:
        """Draw a line and its mirror image."""
        self.draw_line(yz_mm, width_mm, ink)
        self.draw_line([(-y, z) for y, z in yz_mm], width_mm, ink)

    def fill_disc(self, y_mm: float, z_mm: float, radius_mm: float, fill: _Colour) -> None:
        """Fill a circle."""
        (centre,) = self._pixels(np.array([(y_mm, z_mm)]))
        radius = round(radius_mm * 1e-3 * PX_PER_M * _FINE)
        cv2.circle(self.canvas, (int(centre[0]), int(centre[1])), radius, fill, -1, cv2.LINE_AA)

    def _pixels(self, yz_mm: Floats) -> NDArray[np.int32]:
        fine = canvas_pixels(yz_mm * 1e-3) * _FINE
        return np.rint(fine).astype(np.int32)


def draw_face() -> NDArray[np.uint8]:
    """Draw the face on a canvas of HEIGHT_PX by WIDTH_PX."""
    pen = _Pen()
    _draw_head(pen)
    for side in (-1.0, 1.0):
        _draw_eye(pen, side)
    _draw_nose_and_mouth(pen)
    small = cv2.resize(pen.canvas, (WIDTH_PX, HEIGHT_PX), interpolation=cv2.INTER_AREA)
    return np.asarray(small, dtype=np.uint8)


def _draw_head(pen: _Pen) -> None:
    """Draw shoulders, neck, hair, ears, and the oval of the face."""
    pen.fill_outline(
        _close_with_mirror_image(
            [(0, -112), (34, -112), (58, -122), (100, -132), (124, -170), (0, -200)]
        ),
        _SHADE,
    )
    pen.fill_outline(
        _close_with_mirror_image([(0, -60), (33, -60), (35, -100), (42, -118), (0, -128)]), _SKIN
    )
    pen.draw_line([(-34, -84), (-18, -98), (0, -102), (18, -98), (34, -84)], 1.2, _SHADE)
    pen.fill_outline(
        _close_with_mirror_image(
            [(0, 141), (45, 134), (72, 108), (80, 70), (77, 30), (70, 18), (0, 20)]
        ),
        _HAIR,
    )
    for side in (-1.0, 1.0):
        ear = [(70, 30), (79, 36), (84, 22), (80, -2), (74, -16), (68, -14)]
        pen.fill_outline([(side * y, z) for y, z in ear], _SKIN)
    oval = [(0, 114), (36, 109), (60, 88), (70, 55), (72, 20), (70, -12), (62, -50)]
    oval += [(44, -84), (20, -104), (0, -107)]
    pen.fill_outline(_close_with_mirror_image(oval), _SKIN)
    fringe = [(0, 141), (45, 134), (72, 108), (79, 60), (71, 44), (64, 76), (46, 98), (0, 106)]
    pen.fill_outline(_close_with_mirror_image(fringe), _HAIR)


def _draw_eye(pen: _Pen, side: float) -> None:
    """Draw an eye with its brow, at the measured position of the pupil."""
    _, y0, z0 = (1e3 * metres for metres in PARTS_FACE_M["LE"])

    def at(y: float, z: float) -> tuple[float, float]:
        return side * (y0 + y), z0 + z

    white = [at(*p) for p in ((-15, -1.5), (-8, 4.5), (0, 6.5), (8, 5), (15, 0), (7, -5), (-6, -5))]
    pen.fill_outline(white, (250, 250, 251))
    pen.fill_disc(side * y0, z0, 5.8, _IRIS)
    pen.fill_disc(side * y0, z0, 2.6, (70, 72, 76))
    pen.fill_disc(side * y0 + 1.8, z0 + 2.2, 1.1, (250, 250, 251))
    pen.draw_line([at(-16, -2.5), at(-8, 4.8), at(0, 6.8), at(8, 5.3), at(16, 0.5)], 1.5, _INK)
    pen.draw_line([at(-13, -3), at(-6, -5.2), at(7, -5.2), at(14, -1)], 0.6, _INK)
    pen.draw_line([at(-16, 13), at(-4, 18.5), at(8, 19), at(20, 13)], 3.2, _HAIR)


def _draw_nose_and_mouth(pen: _Pen) -> None:
    pen.draw_both_sides([(8, 30), (7, 12), (9, 2)], 0.6, _SHADE)
    pen.draw_both_sides([(15, 1), (18, -5), (14, -9), (9, -8)], 1.0, _INK)
    pen.draw_line([(-7, -9), (0, -11.5), (7, -9)], 1.0, _INK)
    pen.fill_outline(
        [(-25, -36), (-10, -31), (0, -33), (10, -31), (25, -36), (12, -44), (0, -46), (-12, -44)],
        (196, 200, 212),
    )
    pen.draw_line([(-26, -36), (-10, -37), (0, -38), (10, -37), (26, -36)], 1.2, _INK)
    pen.draw_line([(-9, -60), (0, -62), (9, -60)], 0.7, _SHADE)


def _close_with_mirror_image(half: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Close the left half of an outline with its mirror image."""
    return [*half, *((-y, z) for y, z in reversed(half) if y != 0.0)]


def _spline(points: Sequence[tuple[float, float]], closed: bool) -> Floats:
    """Return a Catmull-Rom curve through points, (m, 2)."""
    p = np.asarray(points, dtype=float)
    first, last = (p[-1:], p[:2]) if closed else (p[:1], p[-1:])
    p = np.concatenate([first, p, last])
    t = np.linspace(0.0, 1.0, 16, endpoint=False)[None, :, None]
    a, b, c, d = (p[k : len(p) - 3 + k, None] for k in range(4))
    curve = 0.5 * (
        2.0 * b + (c - a) * t + (2.0 * a - 5.0 * b + 4.0 * c - d) * t**2
        + (3.0 * b - a - 3.0 * c + d) * t**3
    )  # fmt: skip
    out: Floats = np.concatenate([curve.reshape(-1, 2), p[-2:-1]])
    return out
