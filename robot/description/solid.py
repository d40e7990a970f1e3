"""Smooth solids as signed distance fields, and their surfaces as grids of points.

A distance field is a function from points (n, 3) to distances (n,), negative inside. Lengths in any
unit. A surface is found along rays from a centre, as the outermost crossing in each direction.
"""

from collections.abc import Callable
from math import pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.gaze.types import Floats, Vec3
from gazerig.robot.description.mesh import Mesh, Painted

Field = Callable[[Floats], Floats]

_STEPS, _HALVINGS = 26, 9
_GRADIENT_STEP = 0.012
_AT_ONCE = 800
"""Largest number of points in one evaluation of a field."""


def ellipsoid(middle: Vec3, half_axes: Vec3) -> Field:
    """Return the field of an ellipsoid; the distance is approximate away from its surface."""
    half = np.array(half_axes)

    def field(points: Floats) -> Floats:
        scaled = (points - middle) / half
        near, steep = _lengths(scaled), _lengths(scaled / half)
        return np.asarray(near * (near - 1.0) / np.maximum(steep, 1e-9))

    return field


def capsule(start: Vec3, end: Vec3, start_radius: float, end_radius: float) -> Field:
    """Return the field of a rod with round ends whose radius changes along it."""
    a, way = np.array(start), np.subtract(end, start)

    def field(points: Floats) -> Floats:
        share = np.clip((points - a) @ way / (way @ way), 0.0, 1.0)
        away = points - a - share[:, None] * way
        radius = start_radius + share * (end_radius - start_radius)
        return np.asarray(_lengths(away) - radius)

    return field


def _lengths(vectors: Floats) -> Floats:
    """Return the lengths (n,) of vectors (n, 3), in a fifth of the time of numpy.linalg.norm."""
    x, y, z = (vectors * vectors).T
    return np.asarray(np.sqrt(x + y + z))


def union(one: Floats, other: Floats, round_by: float) -> Floats:
    """Return the union of two fields, with a rounded seam."""
    blend = np.maximum(round_by - np.abs(one - other), 0.0) / round_by
    return np.asarray(np.minimum(one, other) - 0.25 * round_by * blend * blend)


def carve(solid: Floats, tool: Floats, round_by: float) -> Floats:
    """Return the field of a solid minus a tool, with a rounded edge."""
    return np.asarray(-union(-solid, tool, round_by))


def crossings(field: Field, centre: Vec3, directions: Floats, farthest: float) -> Floats:
    """Return the outermost points (n, 3) of a solid along unit vectors (n, 3) from its centre."""
    outside, inside = _bracket_crossings(field, centre, directions, farthest)
    for _ in range(_HALVINGS):
        middle = 0.5 * (outside + inside)
        within = field(directions * middle[:, None] + centre) < 0.0
        inside, outside = np.where(within, middle, inside), np.where(within, outside, middle)
    return np.asarray(directions * (0.5 * (outside + inside))[:, None] + centre)


def _bracket_crossings(
    field: Field, centre: Vec3, directions: Floats, farthest: float
) -> tuple[Floats, Floats]:
    """Return distances from the centre (n,) between which each ray crosses the surface."""
    at = np.linspace(farthest, 0.0, _STEPS)
    outside, inside = np.full(len(directions), farthest), np.zeros(len(directions))
    rays, step = np.arange(len(directions)), 1
    while len(rays) and step < _STEPS:
        # Few rays take many steps together: one point of a field takes as long as hundreds.
        steps = slice(step, step + max(1, _AT_ONCE // len(rays)))
        points = directions[rays, None] * at[steps, None] + centre
        within = field(points.reshape(-1, 3)).reshape(points.shape[:2]) < 0.0
        entered = within.any(axis=1)
        first = step + within[entered].argmax(axis=1)
        outside[rays[entered]], inside[rays[entered]] = at[first - 1], at[first]
        rays, step = rays[~entered], steps.stop
    return outside, inside


def normals(field: Field, points: Floats) -> Floats:
    """Return the outward unit normals (n, 3) of a solid at points on its surface."""
    steps = _GRADIENT_STEP * np.eye(3)
    slope = np.stack([field(points + step) - field(points - step) for step in steps], axis=1)
    return np.asarray(slope / np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-9))


class Surface(NamedTuple):
    """Part of a solid's surface: points and unit normals, both (rows, columns, 3)."""

    points: Floats
    normals: Floats


class Solid(NamedTuple):
    """Solid with one surface point on each ray from its centre; parts behind edges are omitted."""

    field: Field
    centre: Vec3
    farthest: float

    def all_round(
        self, rows: int, columns: int, focus_rad: float = 0.0, spread_rad: float = 0.6
    ) -> Surface:
        """Return the whole surface; rows from bottom to top, columns closed behind.

        See ``ray_grid`` for the arguments.
        """
        rays = ray_grid(rows, columns, focus_rad, spread_rad)
        points = crossings(self.field, self.centre, rays.reshape(-1, 3), self.farthest)
        return self._surface(points.reshape(rays.shape))

    def beyond(self, normal: Vec3, offset: float, rows: int, columns: int, out: float) -> Surface:
        """Return the part of the surface with normal . point > offset; its edge is a smooth line.

        Args:
            normal: normal of the cutting plane, of any length.
            offset: offset of the plane.
            rows: number of rows from the edge to the centre.
            columns: number of columns around.
            out: distance of the part from the surface.
        """
        ahead = np.array(normal) / np.linalg.norm(normal)
        aside = np.array((0.0, 1.0, 0.0))
        around = np.linspace(0.0, 2.0 * pi, columns, endpoint=False)
        radial = np.outer(np.cos(around), aside) + np.outer(np.sin(around), np.cross(ahead, aside))
        low, high = np.zeros(columns), np.full(columns, pi)
        for _ in range(12):
            middle = 0.5 * (low + high)
            within = self._at(middle, ahead, radial) @ np.array(normal) > offset
            low, high = np.where(within, middle, low), np.where(within, high, middle)
        share = np.sin(np.linspace(0.5 * pi, 0.0, rows))
        angles, aside_of = np.outer(share, low).ravel(), np.tile(radial, (rows, 1))
        found = self._surface(self._at(angles, ahead, aside_of).reshape(rows, columns, 3))
        return Surface(found.points + out * found.normals, found.normals)

    def front(self, y: Floats, z: Floats) -> Floats:
        """Return points (n, 3) on its front at sideways positions and heights."""
        beside = np.stack((np.zeros(len(y)), y, z), axis=1)
        ahead = np.full(len(y), self.centre[0] + self.farthest)
        behind = np.full(len(y), self.centre[0])
        for _ in range(16):
            middle = 0.5 * (ahead + behind)
            beside[:, 0] = middle
            inside = self.field(beside) < 0.0
            behind, ahead = np.where(inside, middle, behind), np.where(inside, ahead, middle)
        beside[:, 0] = 0.5 * (ahead + behind)
        return beside

    def _surface(self, points: Floats) -> Surface:
        out = normals(self.field, points.reshape(-1, 3))
        return Surface(points, out.reshape(points.shape))

    def _at(self, angles: Floats, ahead: Floats, radial: Floats) -> Floats:
        """Return surface points at angles (n,) from an axis, each in its direction (n, 3)."""
        rays = np.cos(angles)[:, None] * ahead + np.sin(angles)[:, None] * radial
        return crossings(self.field, self.centre, rays, self.farthest)


def ray_grid(rows: int, columns: int, focus_rad: float, spread_rad: float) -> Floats:
    """Return unit vectors (rows, columns, 3) in all directions, densest ahead (+x).

    Args:
        rows: number of rows from bottom to top.
        columns: number of columns around, from behind through the right (-y), ahead and the left;
            the last one does not repeat the first.
        focus_rad: elevation around which the rows are at least twice as dense.
        spread_rad: half width of that range of elevations.
    """
    fine = np.linspace(-pi / 2, pi / 2, 2001)
    weight = 0.32 + np.exp(-(((fine - focus_rad) / spread_rad) ** 2))
    total = np.concatenate(((0.0,), np.cumsum(0.5 * (weight[1:] + weight[:-1]))))
    up = np.interp(np.linspace(0.0, total[-1], rows), total, fine)
    share = np.linspace(-1.0, 1.0, columns, endpoint=False)
    around = pi * np.sign(share) * (0.30 * np.abs(share) + 0.70 * np.abs(share) ** 2.8)
    level = np.cos(up)[:, None]
    return np.stack(
        (
            level * np.cos(around),
            level * np.sin(around),
            np.broadcast_to(np.sin(up)[:, None], (rows, columns)),
        ),
        axis=-1,
    )


def cut_mesh(one: Painted, outside: Floats) -> tuple[Painted, Painted]:
    """Return the part of a mesh where values at its vertices are below 0, and the rest.

    Triangles with both signs are divided at the line on which the linearly interpolated value is 0;
    both parts contain the new points, with interpolated colours and normals.

    Args:
        one: mesh with normals.
        outside: (n,) value at each vertex.
    """
    within = outside < 0.0
    faces = one.mesh.faces.astype(np.int64)
    count = within[faces].sum(axis=1)
    whole_in, whole_out = faces[count == 3], faces[count == 0]
    # The corner that is alone on its side comes first; the cyclic order of the corners is kept.
    mixed = faces[(count == 1) | (count == 2)]
    alone = np.where(within[mixed].sum(axis=1) == 1, True, False)
    first = np.argmax(within[mixed] == alone[:, None], axis=1)
    a, b, c = (mixed[np.arange(len(mixed)), (first + k) % 3] for k in range(3))
    edges = np.sort(np.concatenate((np.stack((a, b), 1), np.stack((a, c), 1))), axis=1)
    ends, number = np.unique(edges, axis=0, return_inverse=True)
    new = number.reshape(-1) + len(outside)
    ab, ac = new[: len(mixed)], new[len(mixed) :]
    tips = np.stack((a, ab, ac), axis=1)
    stumps = np.stack((ab, b, c, ab, c, ac), axis=1)
    pieces = []
    for side, kept in ((True, whole_in), (False, whole_out)):
        rest = stumps[alone != side].reshape(-1, 3)
        pieces.append(
            _mesh_piece(one, ends, outside, np.concatenate((kept, tips[alone == side], rest)))
        )
    return pieces[0], pieces[1]


def _mesh_piece(
    one: Painted, ends: NDArray[np.int64], outside: Floats, faces: NDArray[np.int64]
) -> Painted:
    """Return some faces of a mesh that has new points between pairs of its vertices."""
    low, high = outside[ends[:, 0]], outside[ends[:, 1]]
    share = (low / (low - high))[:, None]

    def values(old: Floats) -> Floats:
        between = (1.0 - share) * old[ends[:, 0]] + share * old[ends[:, 1]]
        return np.concatenate((old, between))[kept]

    kept, renumbered = np.unique(faces, return_inverse=True)
    assert one.normals is not None
    normals = values(one.normals)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    mesh = Mesh(values(one.mesh.vertices), renumbered.reshape(-1, 3).astype(np.uint32))
    return Painted(mesh, values(one.colours), normals)
