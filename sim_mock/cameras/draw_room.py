"""A room with patterned walls, so that a turning camera sees them move.

World frame: the neck base is on a table, the floor is 0.9 m below it.
"""

from functools import lru_cache

import cv2
import numpy as np

from gazerig.gaze.types import Vec3
from gazerig.sim_mock.cameras.canvas import Bytes, Canvas, Colour, TexturedQuad

_LOW: Vec3 = (-2.5, -3.0, -0.9)
_HIGH: Vec3 = (4.0, 3.0, 1.6)
_PX_PER_M = 70.0
_CEILING: Colour = (215, 218, 220)
_FLOOR: Colour = (95, 120, 150)
_WALLS: tuple[Colour, ...] = ((190, 200, 196), (196, 190, 178), (182, 196, 204), (200, 196, 190))
# Sizes of the patches, and their contrast with the wall.
_PATCHES_M, _CONTRAST = (0.07, 0.2, 0.6), (26.0, 30.0, 24.0)


def draw_room(canvas: Canvas, seed: int = 0) -> None:
    """Draw the visible walls, floor and ceiling."""
    for quad in _room(seed):
        canvas.draw_quad(quad)


@lru_cache(maxsize=4)
def _room(seed: int) -> tuple[TexturedQuad, ...]:
    """Return the six sides; equal seeds give equal textures."""
    rng = np.random.default_rng(seed)
    (x0, y0, z0), (x1, y1, z1) = _LOW, _HIGH
    wide, long, tall = y1 - y0, x1 - x0, z1 - z0
    sides: tuple[tuple[Vec3, Vec3, Vec3, Colour], ...] = (
        ((x1, y1, z1), (0.0, -wide, 0.0), (0.0, 0.0, -tall), _WALLS[0]),
        ((x0, y0, z1), (0.0, wide, 0.0), (0.0, 0.0, -tall), _WALLS[1]),
        ((x0, y1, z1), (long, 0.0, 0.0), (0.0, 0.0, -tall), _WALLS[2]),
        ((x1, y0, z1), (-long, 0.0, 0.0), (0.0, 0.0, -tall), _WALLS[3]),
        ((x1, y1, z0), (0.0, -wide, 0.0), (-long, 0.0, 0.0), _FLOOR),
        ((x0, y1, z1), (0.0, -wide, 0.0), (long, 0.0, 0.0), _CEILING),
    )
    return tuple(
        TexturedQuad(corner, right, down, _texture(_length(right), _length(down), colour, rng))
        for corner, right, down, colour in sides
    )


def _texture(width_m: float, height_m: float, colour: Colour, rng: np.random.Generator) -> Bytes:
    """Return soft patches of several sizes on a colour."""
    width, height = round(width_m * _PX_PER_M), round(height_m * _PX_PER_M)
    grey = np.zeros((height, width))
    for size_m, contrast in zip(_PATCHES_M, _CONTRAST, strict=True):
        cells = max(2, round(width_m / size_m)), max(2, round(height_m / size_m))
        noise = rng.uniform(-1.0, 1.0, (cells[1], cells[0]))
        grey += contrast * cv2.resize(noise, (width, height), interpolation=cv2.INTER_CUBIC)
    out: Bytes = np.clip(grey[:, :, None] + np.array(colour), 0.0, 255.0).astype(np.uint8)
    return out


def _length(v: Vec3) -> float:
    return float(np.linalg.norm(v))
