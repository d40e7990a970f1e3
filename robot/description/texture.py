"""Vertex colours as a texture, for viewers and engines that do not support vertex colours."""

from math import ceil, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.gaze.types import Floats
from gazerig.robot.description.mesh import Painted


class TexturedMesh(NamedTuple):
    """Triangle mesh with a texture.

    vertices: (n, 3)
    normals: (n, 3) outward unit normals
    uv: (n, 2) in 0..1 from the image's upper left corner, to the right and down
    faces: (m, 3), counter-clockwise seen from outside
    image: (rows, columns, 3 or 4) red, green, blue and optionally opacity
    """

    vertices: Floats
    normals: Floats
    uv: Floats
    faces: NDArray[np.uint32]
    image: NDArray[np.uint8]


def add_texture(painted: Painted) -> TexturedMesh:
    """Return a painted mesh with its colours as a texture; the triangles do not change.

    Every triangle has vertices of its own and four texels of the image: between three of them
    engines interpolate as between the colours of its corners.
    """
    (vertices, faces), colours, normals = painted
    a, b, c = (colours[faces[:, i]] for i in range(3))
    side = ceil(sqrt(len(faces)))
    cells = np.zeros((side * side, 4, colours.shape[1]))
    cells[: len(faces)] = np.stack((a, b, c, b + c - a), axis=1)
    image = cells.reshape(side, side, 2, 2, -1).swapaxes(1, 2).reshape(2 * side, 2 * side, -1)
    number = np.arange(len(faces))
    first = 2 * np.stack((number % side, number // side), axis=-1)
    uv = (first[:, None] + ((0.5, 0.5), (1.5, 0.5), (0.5, 1.5))) / (2 * side)
    corners = faces.reshape(-1)
    return TexturedMesh(
        vertices[corners],
        normals[corners],
        uv.reshape(-1, 2),
        np.arange(len(corners), dtype=np.uint32).reshape(-1, 3),
        np.rint(np.clip(image, 0.0, 255.0)).astype(np.uint8),
    )
