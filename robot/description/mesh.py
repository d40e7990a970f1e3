"""Triangle meshes of shapes in the page's scene: all are profiles rotated about an axis.

Metres. A mesh has vertices (n, 3) and faces (m, 3), counter-clockwise seen from outside.

Colours of vertices are 0..255 in sRGB: red, green, blue, and optionally opacity.
"""

from collections.abc import Sequence
from math import cos, pi, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.gaze.types import Floats, Vec3

_AROUND = 48


class Mesh(NamedTuple):
    """Triangle mesh: vertices (n, 3) in metres, faces (m, 3) as indices of vertices."""

    vertices: Floats
    faces: NDArray[np.uint32]


def lathe(profile: Sequence[tuple[float, float]], around: int = _AROUND) -> Mesh:
    """Rotate a profile of (radius, height) about z; a repeated point makes a sharp edge."""
    angles = np.arange(around) * (2.0 * pi / around)
    radius, height = np.asarray(profile, float).T
    rings = np.stack(
        (
            radius[:, None] * np.cos(angles),
            radius[:, None] * np.sin(angles),
            np.broadcast_to(height[:, None], (len(radius), around)),
        ),
        axis=-1,
    )
    return Mesh(rings.reshape(-1, 3), quads(len(radius), around, closed=True))


def cap(radius_m: float, half_angle_rad: float, rings: int = 12, around: int = _AROUND) -> Mesh:
    """Return the part of a sphere within an angle of its x axis; pi is the whole sphere."""
    angles = np.linspace(half_angle_rad, 0.0, rings)
    dome = lathe([(radius_m * sin(a), radius_m * cos(a)) for a in angles], around)
    return Mesh(dome.vertices[:, (2, 0, 1)], dome.faces)


def ellipsoid(half_axes_m: Vec3, bulge: float = 1.0, rings: int = 13) -> Mesh:
    """Return an ellipsoid; a bulge below 1 makes it more like a rounded box."""
    angles = np.linspace(-pi / 2, pi / 2, rings)
    ball = lathe([(cos(a), sin(a)) for a in angles], around=2 * rings)
    filled = np.sign(ball.vertices) * np.abs(ball.vertices) ** bulge
    return Mesh(filled * np.asarray(half_axes_m), ball.faces)


def disc(radius_m: float) -> Mesh:
    """Return a flat disc that faces up."""
    return lathe([(radius_m, 0.0), (0.0, 0.0)])


def lid(radius_m: float, sweep_rad: float) -> Mesh:
    """Return a lid: the slice of a sphere, swept about y, from its edge at +x upwards."""
    sweep = np.linspace(0.0, sweep_rad, 24)
    across = np.linspace(pi, 0.0, 32)
    points = np.stack(
        (
            np.cos(sweep)[:, None] * np.sin(across),
            np.broadcast_to(np.cos(across), (24, 32)),
            np.sin(sweep)[:, None] * np.sin(across),
        ),
        axis=-1,
    )
    return Mesh(radius_m * points.reshape(-1, 3), quads(24, 32, closed=False))


def ring(radius_m: float, thickness_m: float) -> Mesh:
    """Return a torus about x."""
    angles = np.linspace(0.0, 2.0 * pi, 17)
    band = lathe([(radius_m + thickness_m * cos(a), thickness_m * sin(a)) for a in angles])
    return Mesh(band.vertices[:, (2, 0, 1)], band.faces)


def grid(points: Floats, *, closed: bool) -> Mesh:
    """Return the surface through points (rows, columns, 3); ``closed`` joins a row's ends."""
    rows, columns = points.shape[:2]
    return Mesh(points.reshape(-1, 3), quads(rows, columns, closed=closed))


def smooth_normals(mesh: Mesh) -> Floats:
    """Return the outward unit normals (n, 3) of a surface at its vertices."""
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    across = np.cross(b - a, c - a)
    total = np.zeros_like(mesh.vertices)
    for corner in range(3):
        np.add.at(total, mesh.faces[:, corner], across)
    return np.asarray(total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12))


def quads(rows: int, columns: int, *, closed: bool) -> NDArray[np.uint32]:
    """Triangulate a grid of points, row by row; ``closed`` joins its ends."""
    row, column = np.mgrid[0 : rows - 1, 0 : columns if closed else columns - 1]
    right = (column + 1) % columns
    a, b = row * columns + column, row * columns + right
    c, d = (row + 1) * columns + right, (row + 1) * columns + column
    triangles = np.stack((a, b, c, a, c, d), axis=-1)
    return triangles.reshape(-1, 3).astype(np.uint32)


Colour = tuple[int, int, int]


class Painted(NamedTuple):
    """Mesh with a colour per vertex (n, 3 or 4) in 0..255, and unit normals (n, 3) or None."""

    mesh: Mesh
    colours: Floats
    normals: Floats | None = None


def paint(mesh: Mesh, colour: Colour) -> Painted:
    """Return a mesh in one colour, smoothly shaded."""
    return Painted(mesh, uniform_colours(mesh, colour), smooth_normals(mesh))


def uniform_colours(mesh: Mesh, colour: Colour) -> Floats:
    """Return the same colour for every vertex."""
    return np.tile(np.array(colour, float), (len(mesh.vertices), 1))


def mix(colours: Floats, colour: Colour, share: Floats) -> Floats:
    """Blend colours (..., 3) towards one colour by fractions (...), clipped to 0..1."""
    part = np.clip(share, 0.0, 1.0)[..., None]
    return np.asarray(colours * (1.0 - part) + np.array(colour, float) * part)


def smooth_step(value: Floats, width: float) -> Floats:
    """Return 0 below and 1 above zero, with a smooth transition."""
    share = np.clip(0.5 + value / (2.0 * width), 0.0, 1.0)
    return np.asarray(share * share * (3.0 - 2.0 * share))


def spot_weight(points: Floats, at: Vec3, size: float) -> Floats:
    """Return weights of points (..., 3): 1 at a place and less around it."""
    away = ((points - np.array(at)) ** 2).sum(axis=-1)
    return np.asarray(np.exp(-away / (size * size)))


def mirror_mesh(one: Painted) -> Painted:
    """Return the mesh mirrored at y = 0."""
    other = np.array((1.0, -1.0, 1.0))
    mesh = Mesh(one.mesh.vertices * other, one.mesh.faces[:, ::-1])
    return Painted(mesh, one.colours, None if one.normals is None else one.normals * other)


def move_mesh(one: Painted, by: Vec3, scale: float = 1.0) -> Painted:
    """Return the mesh scaled about the origin and then moved."""
    return one._replace(mesh=Mesh(one.mesh.vertices * scale + np.array(by), one.mesh.faces))


def merge_meshes(parts: Sequence[Painted]) -> Painted:
    """Merge several meshes; every part must have normals."""
    first = np.cumsum([0, *(len(part.mesh.vertices) for part in parts)])
    faces = [part.mesh.faces + start for part, start in zip(parts, first, strict=False)]
    mesh = Mesh(
        np.concatenate([part.mesh.vertices for part in parts]),
        np.concatenate(faces).astype(np.uint32),
    )
    out = [part.normals for part in parts if part.normals is not None]
    return Painted(mesh, np.concatenate([part.colours for part in parts]), np.concatenate(out))
