"""Triangle meshes with colours: the stored shapes of heads and people, and their textures.

Metres. A mesh has vertices (n, 3) and faces (m, 3), counter-clockwise seen from outside. Colours of
vertices are 0..255 in sRGB: red, green, blue, and optionally opacity.

*shapes.npz* has four arrays for each shape: NAME/vertices, NAME/faces, NAME/colours, NAME/normals.
Parts of the rig's head are in distances between the eyes; eye, lids and ear have the radius 1, the
neck radius and length 1, the bust height 1. People, gloves and shoes are in metres, hands have the
radius 1. Segments of bodies are those of an adult of 1.72 m, in metres; shirts and necks are grey.
The faces of a shape are pairs that form quadrangles.

NAME/shell describes a thin shell of printed PLA or PETG with usual air (1050 kg/m3),
scaled to eyes 1 m apart; lids, eyes and the rings that carry eyes (15 % of their mass) to a radius
of 1 m: mass, centre, and xx, yy, zz, xy, xz, yz of the tensor. Skull and eyes are 1.6 mm thick,
lids 1.2, others 2.
"""

from collections.abc import Sequence
from functools import cache
from math import ceil, sqrt
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.gaze.types import Floats, Vec3

_SHAPES = Path(__file__).with_name("shapes.npz")


class Mesh(NamedTuple):
    """Triangle mesh: vertices (n, 3) in metres, faces (m, 3) as indices of vertices."""

    vertices: Floats
    faces: NDArray[np.uint32]


Colour = tuple[int, int, int]


class Painted(NamedTuple):
    """Mesh with a colour per vertex (n, 3 or 4) in 0..255, and unit normals (n, 3)."""

    mesh: Mesh
    colours: Floats
    normals: Floats


@cache
def stored_shape(name: str) -> Painted:
    """Return a shape of the file *shapes.npz*; do not change its arrays."""
    with np.load(_SHAPES) as arrays:
        vertices, colours, normals = (
            arrays[f"{name}/{key}"].astype(float) for key in ("vertices", "colours", "normals")
        )
        faces = arrays[f"{name}/faces"].astype(np.uint32)
    return Painted(Mesh(vertices, faces), colours, normals)


@cache
def stored_shell(name: str) -> tuple[float, ...]:
    """Return the inertia of a thin shell of the file *shapes.npz*."""
    with np.load(_SHAPES) as arrays:
        return tuple(arrays[f"{name}/shell"].tolist())


def smooth_normals(mesh: Mesh) -> Floats:
    """Return the outward unit normals (n, 3) of a surface at its vertices."""
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    across = np.cross(b - a, c - a)
    total = np.zeros_like(mesh.vertices)
    for corner in range(3):
        np.add.at(total, mesh.faces[:, corner], across)
    return np.asarray(total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12))


def paint(mesh: Mesh, colour: Colour) -> Painted:
    """Return a mesh in one colour, smoothly shaded."""
    colours = np.tile(np.array(colour, float), (len(mesh.vertices), 1))
    return Painted(mesh, colours, smooth_normals(mesh))


def move_mesh(shape: Painted, by: Vec3 = (0.0, 0.0, 0.0), scale: float | Vec3 = 1.0) -> Painted:
    """Return a mesh, scaled about the origin and then moved.

    Args:
        shape: the mesh.
        by: the way.
        scale: one factor, or one for each axis; a negative one mirrors the mesh.
    """
    (vertices, faces), colours, normals = shape
    factors = np.broadcast_to(np.asarray(scale, float), 3)
    out = normals / factors
    out /= np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-12)
    if factors.prod() < 0.0:
        faces = faces[:, ::-1]
    return Painted(Mesh(vertices * factors + np.array(by), faces), colours, out)


def merge_meshes(parts: Sequence[Painted]) -> Painted:
    """Merge several meshes."""
    first = np.cumsum([0, *(len(part.mesh.vertices) for part in parts)])
    faces = [part.mesh.faces + start for part, start in zip(parts, first, strict=False)]
    mesh = Mesh(
        np.concatenate([part.mesh.vertices for part in parts]),
        np.concatenate(faces).astype(np.uint32),
    )
    colours, normals = (np.concatenate([part[i] for part in parts]) for i in (1, 2))
    return Painted(mesh, colours, normals)


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
