"""Vertex colours as a texture, for viewers and engines that do not support vertex colours.

A part that is a grid of points becomes a rectangle of the image with one texel per vertex, which is
interpolated exactly like vertex colours. Any other part becomes a small square for every two
triangles. Neighbours on a grid remain neighbours in the image, so mipmaps keep their colours.
"""

from collections.abc import Iterator
from math import ceil, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.gaze.types import Floats
from gazerig.robot.description.mesh import Painted, quads, smooth_normals

_PATCH = 4
"""Side of the square of two triangles, in texels."""
_MARGIN = 2
"""Width of the repeated edge around a part, in texels; it keeps parts from bleeding together."""


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


class _TexturePart(NamedTuple):
    """Rectangle of texels, and the vertices in it; ``uv`` in texels."""

    vertices: Floats
    normals: Floats
    uv: Floats
    faces: NDArray[np.uint32]
    texels: Floats


def add_texture(painted: Painted) -> TexturedMesh:
    """Return a painted mesh with its colours as a texture; the triangles do not change."""
    parts = [_texture_part(piece) for piece in _pieces(painted)]
    corners, size = _pack_rectangles([part.texels.shape[:2] for part in parts])
    image = np.zeros((*size, painted.colours.shape[1]))
    first, uv, faces = 0, [], []
    for part, (row, column) in zip(parts, corners, strict=True):
        rows, columns = part.texels.shape[:2]
        padded = np.pad(part.texels, ((_MARGIN, _MARGIN), (_MARGIN, _MARGIN), (0, 0)), "edge")
        image[row : row + rows + 2 * _MARGIN, column : column + columns + 2 * _MARGIN] = padded
        uv.append((part.uv + (column + _MARGIN, row + _MARGIN)) / (size[1], size[0]))
        faces.append(part.faces + first)
        first += len(part.vertices)
    normals = np.concatenate([part.normals for part in parts])
    # Of length one; upwards for points without a face of non-zero size.
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return TexturedMesh(
        np.concatenate([part.vertices for part in parts]),
        np.where(length > 1e-6, normals / np.maximum(length, 1e-6), (0.0, 0.0, 1.0)),
        np.concatenate(uv),
        np.concatenate(faces).astype(np.uint32),
        np.rint(np.clip(image, 0.0, 255.0)).astype(np.uint8),
    )


def _pieces(painted: Painted) -> Iterator[Painted]:
    """Yield the parts that were merged: runs of faces that share no vertex with the others."""
    mesh, colours, _ = painted
    normals = smooth_normals(mesh) if painted.normals is None else painted.normals
    highest = np.maximum.accumulate(mesh.faces.max(axis=1))
    lowest = np.minimum.accumulate(mesh.faces.min(axis=1)[::-1])[::-1]
    cuts = np.flatnonzero(lowest[1:] > highest[:-1]) + 1
    for faces in np.split(mesh.faces, cuts):
        start, end = int(faces.min()), int(faces.max()) + 1
        local = mesh._replace(vertices=mesh.vertices[start:end], faces=faces - np.uint32(start))
        yield Painted(local, colours[start:end], normals[start:end])


def _texture_part(piece: Painted) -> _TexturePart:
    """Return the texels of one part, in the simplest form that contains its colours."""
    (vertices, faces), colours, normals = piece
    assert normals is not None
    if np.ptp(colours, axis=0).max() == 0.0:
        middle = np.full((len(vertices), 2), 0.5)
        return _TexturePart(vertices, normals, middle, faces, colours[:1, None])
    for backwards in (False, True):
        shape = _grid_shape(faces[:, ::-1] if backwards else faces, len(vertices))
        if shape is not None:
            return _grid_part(piece, *shape, backwards=backwards)
    return _part_in_patches(piece)


def _grid_shape(faces: NDArray[np.uint32], vertices: int) -> tuple[int, int, bool] | None:
    """Return rows, columns and whether the rows are closed, if the faces are those of a grid."""
    columns = int(faces[1, 2]) if len(faces) > 1 else 0
    if columns < 2 or vertices % columns:
        return None
    rows = vertices // columns
    closed = len(faces) == 2 * (rows - 1) * columns
    whole = quads(rows, columns, closed=closed) if rows > 1 else faces[:0]
    return (rows, columns, closed) if np.array_equal(whole, faces) else None


def _grid_part(
    piece: Painted, rows: int, columns: int, closed: bool, *, backwards: bool
) -> _TexturePart:
    """Return a part with one texel per vertex; a closed row repeats its first vertex at the end."""

    def laid_out(values: Floats) -> Floats:
        table = values.reshape(rows, columns, -1)
        return np.concatenate((table, table[:, :1]), axis=1) if closed else table

    (vertices, _), colours, normals = piece
    assert normals is not None
    across = columns + closed
    row, column = np.mgrid[0:rows, 0:across]
    faces = quads(rows, across, closed=False)
    return _TexturePart(
        laid_out(vertices).reshape(-1, 3),
        laid_out(normals).reshape(-1, 3),
        np.stack((column, row), axis=-1).reshape(-1, 2) + 0.5,
        faces[:, ::-1] if backwards else faces,
        laid_out(colours),
    )


def _part_in_patches(piece: Painted) -> _TexturePart:
    """Return a part with a square of texels for every two triangles, in the order of the faces.

    A square contains one triangle above and one below the diagonal. Two triangles (a, b, c) and
    (a, c, d) share a square without a seam; any other triangle has its own square.
    """
    (vertices, faces), colours, normals = piece
    assert normals is not None
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
    patches = np.where(right >= below, lower, upper)
    texels = np.broadcast_to(patches[-1:], (across * down, *patches.shape[1:])).copy()
    texels[:count] = patches
    table = texels.reshape(down, across, _PATCH, _PATCH, -1).swapaxes(1, 2)
    place = np.stack((np.arange(count) % across, np.arange(count) // across), axis=-1) * _PATCH
    ends = np.array(((0, 0), (1, 0), (1, 1), (0, 1))) * (_PATCH - 1) + 0.5
    first = 4 * np.arange(count)[:, None]
    two = np.concatenate((first + (0, 1, 2), first + (0, 2, 3)), axis=1).reshape(-1, 3)
    used = corners.reshape(-1)
    kept = np.ones(len(two), bool)
    kept[1::2] = corners[:, 3] != corners[:, 2]
    return _TexturePart(
        vertices[used],
        normals[used],
        (place[:, None] + ends).reshape(-1, 2),
        two[kept].astype(np.uint32),
        table.reshape(down * _PATCH, across * _PATCH, -1),
    )


def _quadrangles(faces: NDArray[np.uint32]) -> NDArray[np.int64]:
    """Return corners (n, 4); if the last two are equal, it is a triangle."""
    table, at = [], 0
    rows = faces.astype(int).tolist()
    while at < len(rows):
        a, b, c = rows[at]
        d = c
        if at + 1 < len(rows) and rows[at + 1][:2] == [a, c]:
            d = rows[at + 1][2]
            at += 1
        table.append((a, b, c, d))
        at += 1
    return np.array(table)


def _pack_rectangles(sizes: list[tuple[int, int]]) -> tuple[list[tuple[int, int]], tuple[int, int]]:
    """Arrange rectangles in rows, the tallest first; return their corners and the total size."""
    widest = max(columns for _, columns in sizes) + 2 * _MARGIN
    area = sum((rows + 2 * _MARGIN) * (columns + 2 * _MARGIN) for rows, columns in sizes)
    width = max(widest, ceil(sqrt(area)))
    corners = [(0, 0)] * len(sizes)
    top = left = height = 0
    for at in sorted(range(len(sizes)), key=lambda i: -sizes[i][0]):
        rows, columns = (size + 2 * _MARGIN for size in sizes[at])
        if left + columns > width:
            top, left, height = top + height, 0, 0
        corners[at] = (top, left)
        left, height = left + columns, max(height, rows)
    return corners, (top + height, width)
