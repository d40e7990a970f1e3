"""Vertex colours as a texture, for viewers and engines that do not support vertex colours.

Every two triangles get a small square of the image, which is interpolated like vertex colours.
They are in the order of the faces, so neighbours on a surface are mostly neighbours in the image.
"""

from math import ceil, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.gaze.types import Floats
from gazerig.robot.description.mesh import Painted, smooth_normals

_PATCH = 4
"""Side of the square of two triangles, in texels."""


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

    A square contains one triangle below and one above the diagonal. Two triangles (a, b, c) and
    (a, c, d) share a square without a seam; any other triangle has its own square.
    """
    (vertices, faces), colours, normals = painted
    if normals is None:
        normals = smooth_normals(painted.mesh)
    # Of length one; upwards for points without a face of non-zero size.
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.where(length > 1e-6, normals / np.maximum(length, 1e-6), (0.0, 0.0, 1.0))
    if np.ptp(colours, axis=0).max() == 0.0:
        return TexturedMesh(
            vertices, normals, np.full((len(vertices), 2), 0.5), faces, _as_image(colours[:1, None])
        )
    corners = _quadrangles(faces)
    count = len(corners)
    across = ceil(sqrt(count))
    down = ceil(count / across)
    share = np.linspace(0.0, 1.0, _PATCH)
    right, below = share[None, :, None], share[:, None, None]
    a, b, c, d = (colours[corners[:, i]][:, None, None] for i in range(4))
    # The colours on each side of the diagonal from a to c are those of its triangle.
    lower = a + right * (b - a) + below * (c - b)
    upper = a + below * (d - a) + right * (c - d)
    patches = np.zeros((across * down, _PATCH, _PATCH, colours.shape[1]))
    patches[:count] = np.where(right >= below, lower, upper)
    table = patches.reshape(down, across, _PATCH, _PATCH, -1).swapaxes(1, 2)
    # An edge around all, as engines repeat an image without end.
    edge = (_PATCH, _PATCH)
    image = np.pad(table.reshape(down * _PATCH, across * _PATCH, -1), (edge, edge, (0, 0)), "edge")
    place = np.stack((np.arange(count) % across, np.arange(count) // across), axis=-1) * _PATCH
    ends = np.array(((0, 0), (1, 0), (1, 1), (0, 1))) * (_PATCH - 1) + _PATCH + 0.5
    uv = (place[:, None] + ends).reshape(-1, 2) / (image.shape[1], image.shape[0])
    first = 4 * np.arange(count)[:, None]
    two = np.concatenate((first + (0, 1, 2), first + (0, 2, 3)), axis=1).reshape(-1, 3)
    kept = np.ones(len(two), bool)
    kept[1::2] = corners[:, 3] != corners[:, 2]
    used = corners.reshape(-1)
    return TexturedMesh(
        vertices[used], normals[used], uv, two[kept].astype(np.uint32), _as_image(image)
    )


def _as_image(colours: Floats) -> NDArray[np.uint8]:
    return np.rint(np.clip(colours, 0.0, 255.0)).astype(np.uint8)


def _quadrangles(faces: NDArray[np.uint32]) -> NDArray[np.int64]:
    """Return corners (n, 4); if the last two are equal, it is a triangle."""
    table, at = [], 0
    rows = faces.astype(int).tolist()
    while at < len(rows):
        a, b, c = rows[at]
        other = rows[at + 1] if at + 1 < len(rows) else [a, b, c]
        # In a mirrored surface the shared side is not the first one.
        d = next((other[i - 1] for i in range(3) if [other[i], other[i - 2]] == [a, c]), c)
        table.append((a, b, c, d))
        at += 1 + (d != c)
    return np.array(table)
