"""Lips and brows as separate shapes on the front of a head, with sharp edges."""

from math import pi
from typing import NamedTuple

import numpy as np

from gazerig.gaze.types import Floats
from gazerig.robot.description.mesh import Colour, Mesh, Painted, grid, paint
from gazerig.robot.description.solid import Solid

_COLUMNS, _ROWS = 31, 7


class Mouth(NamedTuple):
    """Dimensions of a mouth, in the unit of its head.

    z: height of its centre; half_width: half the width of the line between the lips; smile: rise of
    its ends per squared unit of sideways distance; upper, lower: heights of the lips
    """

    z: float
    half_width: float
    smile: float
    upper: float
    lower: float

    def line(self, y: Floats) -> Floats:
        """Return the height of the line between the lips."""
        return np.asarray(self.z + self.smile * y * y)


class Lips(NamedTuple):
    """The two lips and the line between them."""

    upper: Painted
    lower: Painted
    line: Painted


def lips(head: Solid, mouth: Mouth, colour: Colour, dark: Colour) -> Lips:
    """Return the lips of a mouth on the front of a head."""
    share = np.linspace(-1.0, 1.0, _COLUMNS)
    y = mouth.half_width * share
    taper = np.maximum(1.0 - share * share, 0.0)
    bow = 1.0 - 0.28 * np.exp(-((share / 0.16) ** 2))
    line = mouth.line(y)
    upper = line + mouth.upper * taper**0.75 * bow
    lower = line - mouth.lower * taper**0.60
    width = 0.10 * mouth.upper
    return Lips(
        paint(_band(head, y, line, upper, 0.30 * mouth.upper), colour),
        paint(_band(head, y, lower, line, 0.38 * mouth.lower), colour),
        paint(_band(head, 1.06 * y, line - width, line + width, 0.30 * mouth.upper), dark),
    )


def _band(head: Solid, y: Floats, low: Floats, high: Floats, bulge: float) -> Mesh:
    """Return a band on the front between two heights, thicker in its middle."""
    share = np.linspace(0.0, 1.0, _ROWS)[:, None]
    z = low + share * (high - low)
    points = head.front(np.tile(y, _ROWS), z.reshape(-1)).reshape(_ROWS, len(y), 3)
    # Its edges are a little inside the skin, so that no gap is visible.
    points[..., 0] += bulge * (np.sin(pi * share) ** 0.7 * 1.25 - 0.25) + 0.006
    return grid(points, closed=False)


def brow(
    head: Solid, y: Floats, z: Floats, thick: float, colour: Colour, around: int = 12
) -> Painted:
    """Return a brow: a tapering arc on the front of a head.

    Args:
        head: surface of the head.
        y: positions from the nose outwards (n,).
        z: heights (n,).
        thick: half the greatest thickness.
        colour: colour of the hair.
        around: number of corners of the cross-section.
    """
    share = np.linspace(0.0, 1.0, len(y))
    middle = head.front(y, z) + (0.012, 0.0, 0.0)
    radius = thick * (1.0 - 0.70 * share**1.6) * np.sqrt(np.clip(share / 0.05, 0.25, 1.0))
    turn = np.linspace(2.0 * pi, 0.0, around, endpoint=False)
    ring = np.stack((0.55 * np.cos(turn), np.zeros(around), np.sin(turn)), axis=1)
    return paint(grid(middle[:, None] + radius[:, None, None] * ring, closed=True), colour)
