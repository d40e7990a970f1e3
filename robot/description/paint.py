"""Meshes with a colour at every vertex, and how colours are laid over each other.

Colours are 0..255 as on a screen: red, green, blue, and where given how opaque.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gazerig.gaze.types import Floats, Vec3
from gazerig.robot.description.mesh import Mesh, smooth_normals

Colour = tuple[int, int, int]


class Painted(NamedTuple):
    """A mesh with a colour a vertex (n, 3 or 4) in 0..255, and unit normals (n, 3) or None."""

    mesh: Mesh
    colours: Floats
    normals: Floats | None = None


def painted(mesh: Mesh, colour: Colour) -> Painted:
    """Return a mesh in one colour, smoothly shaded."""
    return Painted(mesh, plain(mesh, colour), smooth_normals(mesh))


def plain(mesh: Mesh, colour: Colour) -> Floats:
    """Return one colour for every vertex."""
    return np.tile(np.array(colour, float), (len(mesh.vertices), 1))


def mix(colours: Floats, colour: Colour, share: Floats) -> Floats:
    """Blend colours (..., 3) towards one by a share (...), clipped to 0..1."""
    part = np.clip(share, 0.0, 1.0)[..., None]
    return np.asarray(colours * (1.0 - part) + np.array(colour, float) * part)


def step(value: Floats, width: float) -> Floats:
    """Return 0 below and 1 above zero, with a smooth transition."""
    share = np.clip(0.5 + value / (2.0 * width), 0.0, 1.0)
    return np.asarray(share * share * (3.0 - 2.0 * share))


def spot(points: Floats, at: Vec3, size: float) -> Floats:
    """Return 1 at a place and less around it, for points (..., 3)."""
    away = ((points - np.array(at)) ** 2).sum(axis=-1)
    return np.asarray(np.exp(-away / (size * size)))


def mirrored(one: Painted) -> Painted:
    """Return the same on the other side of y = 0."""
    other = np.array((1.0, -1.0, 1.0))
    mesh = Mesh(one.mesh.vertices * other, one.mesh.faces[:, ::-1])
    return Painted(mesh, one.colours, None if one.normals is None else one.normals * other)


def moved(one: Painted, by: Vec3, scale: float = 1.0) -> Painted:
    """Return the same, scaled about the origin and then moved."""
    return one._replace(mesh=Mesh(one.mesh.vertices * scale + np.array(by), one.mesh.faces))


def merged(parts: Sequence[Painted]) -> Painted:
    """Return several as one; every part has normals."""
    first = np.cumsum([0, *(len(part.mesh.vertices) for part in parts)])
    faces = [part.mesh.faces + start for part, start in zip(parts, first, strict=False)]
    mesh = Mesh(
        np.concatenate([part.mesh.vertices for part in parts]),
        np.concatenate(faces).astype(np.uint32),
    )
    out = [part.normals for part in parts if part.normals is not None]
    return Painted(mesh, np.concatenate([part.colours for part in parts]), np.concatenate(out))
