"""The geoms of a compiled MuJoCo model as coloured meshes in their initial poses."""

from collections.abc import Callable, Collection, Iterator
from math import cos, radians, sin
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from gazerig.features.world.body_shape import loft_surface
from gazerig.gaze.types import Floats
from gazerig.robot.dashboard.feed.world_shapes import WorldPart
from gazerig.robot.description.mesh import (
    Mesh,
    Painted,
    smooth_normals,
    stored_shape,
)
from gazerig.robot.description.texture import TexturedMesh

_SHOWN_GROUPS = 3
"""Groups of geoms below this are shown, as in MuJoCo's own viewer."""
_FAR_M = 10.0
"""Half the size of an infinite plane."""
_ROUND = 24
_NO_COLOUR = (0.5, 0.5, 0.5, 1.0)
"""MuJoCo's colour of a geom without a colour; the colour of its material is then used."""
_WALL_THICK_M, _WALL_WIDE_M = 0.06, 0.9
"""Limits of thickness and width of a wall. Only the side that faces the room is shown, so that the
room is visible from outside."""
_ROOM_M = np.array((1.0, 0.0, 0.0))
"""A point in the room."""


class _Surface(NamedTuple):
    """Triangles in the frame of a geom: normals and places in a texture at every vertex."""

    mesh: Mesh
    normals: Floats
    uv: Floats


def fixed_parts(model: Any, moving: Collection[str]) -> Iterator[WorldPart]:
    """Yield every static part of a model, in place.

    Args:
        model: mujoco.MjModel
        moving: bodies that are shown elsewhere
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    for geom in range(model.ngeom):
        body = model.body(model.geom_bodyid[geom])
        if body.name in moving or (made := _surface(model, geom)) is None:
            continue
        pose = data.geom_xpos[geom].copy(), data.geom_xmat[geom].reshape(3, 3).copy()
        surface = _move_surface(made, *pose)
        if _is_wall(model, geom):
            # Only the faces that are visible from the room.
            (vertices, faces), normals, _ = surface
            first = faces[:, 0]
            seen = ((_ROOM_M - vertices[first]) * normals[first]).sum(axis=1) > 0.0
            surface = surface._replace(mesh=Mesh(vertices, faces[seen]))
        yield WorldPart(f"geom{geom}", _paint_surface(model, geom, surface), "cloth")


def _surface(model: Any, geom: int) -> _Surface | None:
    """Return the surface of a geom in its own frame, None for a hidden geom."""
    make = _SURFACES.get(int(model.geom_type[geom]))
    if make is None or model.geom_group[geom] >= _SHOWN_GROUPS or _rgba(model, geom)[3] == 0.0:
        return None
    return make(model, geom)


def _rgba(model: Any, geom: int) -> Floats:
    material = int(model.geom_matid[geom])
    own: Floats = model.geom_rgba[geom].astype(float)
    if material < 0 or not np.allclose(own, _NO_COLOUR):
        return own
    return np.asarray(model.mat_rgba[material], float)


def _paint_surface(model: Any, geom: int, surface: _Surface) -> Painted | TexturedMesh:
    picture, rgba = _texture_image(model, geom), _rgba(model, geom)
    if picture is None:
        colours = np.tile(255.0 * rgba[:3], (len(surface.mesh.vertices), 1))
        return Painted(surface.mesh, colours, surface.normals)
    tinted = np.rint(np.clip(picture * rgba[:3], 0.0, 255.0)).astype(np.uint8)
    return TexturedMesh(
        surface.mesh.vertices, surface.normals, surface.uv, surface.mesh.faces, tinted
    )


def _texture_image(model: Any, geom: int) -> NDArray[np.uint8] | None:
    """Return the picture of a geom's material, None without one."""
    material = int(model.geom_matid[geom])
    role = int(mujoco.mjtTextureRole.mjTEXROLE_RGB)
    texture = int(model.mat_texid[material][role]) if material >= 0 else -1
    if texture < 0 or model.tex_type[texture] != mujoco.mjtTexture.mjTEXTURE_2D:
        return None
    rows, columns, channels = (
        int(of[texture]) for of in (model.tex_height, model.tex_width, model.tex_nchannel)
    )
    if channels < 3:
        return None
    start = int(model.tex_adr[texture])
    image: NDArray[np.uint8] = model.tex_data[start : start + rows * columns * channels]
    return image.reshape(rows, columns, channels)[:, :, :3]


def _move_surface(surface: _Surface, p_m: Floats, R: Floats) -> _Surface:
    mesh = surface.mesh._replace(vertices=surface.mesh.vertices @ R.T + p_m)
    return surface._replace(mesh=mesh, normals=surface.normals @ R.T)


def _is_wall(model: Any, geom: int) -> bool:
    if model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_BOX:
        return False
    thin, middle, _ = np.sort(2.0 * model.geom_size[geom])
    return bool(thin <= _WALL_THICK_M and middle >= _WALL_WIDE_M)


def _project_texture(model: Any, geom: int, vertices: Floats, half: Floats) -> Floats:
    """Return texture coordinates of vertices for a picture projected along the geom's z axis."""
    material = int(model.geom_matid[geom])
    repeat = np.ones(2) if material < 0 else model.mat_texrepeat[material].astype(float)
    if material >= 0 and not model.mat_texuniform[material]:
        repeat = repeat / np.maximum(half[:2], 1e-9)
    return vertices[:, :2] * repeat * (0.5, -0.5) - 0.5


def _smooth(model: Any, geom: int, mesh: Mesh) -> _Surface:
    half = np.ptp(mesh.vertices, axis=0) / 2.0
    return _Surface(mesh, smooth_normals(mesh), _project_texture(model, geom, mesh.vertices, half))


def _box(model: Any, geom: int) -> _Surface:
    half = model.geom_size[geom].astype(float)
    vertices, normals = [], []
    for axis in range(3):
        for side in (1.0, -1.0):
            out = np.zeros(3)
            out[axis] = side
            right = np.roll(np.abs(out), 1)
            up = np.cross(out, right)
            vertices += [out - right - up, out + right - up, out + right + up, out - right + up]
            normals += [out] * 4
    corners = np.array(vertices) * half
    quad = np.array(((0, 1, 2), (0, 2, 3)))
    faces = (4 * np.arange(6)[:, None, None] + quad).reshape(-1, 3).astype(np.uint32)
    return _Surface(
        Mesh(corners, faces), np.array(normals), _project_texture(model, geom, corners, half)
    )


def _plane(model: Any, geom: int) -> _Surface:
    half = np.where(model.geom_size[geom] > 0.0, model.geom_size[geom], _FAR_M)
    corners = np.array(((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0))) * (half[0], half[1], 1.0)
    mesh = Mesh(corners, np.array(((0, 1, 2), (0, 2, 3)), np.uint32))
    normals = np.tile((0.0, 0.0, 1.0), (4, 1))
    return _Surface(mesh, normals, _project_texture(model, geom, corners, half))


def _cylinder(model: Any, geom: int) -> _Surface:
    radius, half = model.geom_size[geom][:2].tolist()
    # Repeated rows make sharp edges.
    rows = [(z, 0.0, radius, radius) for z in (-half, -half, half, half)]
    return _smooth(model, geom, loft_surface(rows, _ROUND))


def _capsule(model: Any, geom: int) -> _Surface:
    radius, half = model.geom_size[geom][:2].tolist()
    rows = []
    for end, angles in ((-half, range(-90, 1, 15)), (half, range(0, 91, 15))):
        for a in map(radians, angles):
            rows.append((end + radius * sin(a), 0.0, radius * cos(a), radius * cos(a)))
    return _smooth(model, geom, loft_surface(rows, _ROUND // 2))


def _ball(model: Any, geom: int) -> _Surface:
    half = model.geom_size[geom]
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_SPHERE:
        half = half[:1]
    ball = stored_shape("ball").mesh
    return _smooth(model, geom, Mesh(ball.vertices * half, ball.faces))


def _mesh(model: Any, geom: int) -> _Surface:
    """Return a mesh with three vertices of its own for every triangle."""
    number = int(model.geom_dataid[geom])

    def of(values: Any, starts: Any, rows: Any, indices: Any) -> Floats:
        count = int(model.mesh_facenum[number])
        first = int(model.mesh_faceadr[number])
        begin = int(starts[number])
        table = values[begin : begin + int(rows[number])]
        return np.asarray(table[indices[first : first + count].reshape(-1)], float)

    vertices = of(model.mesh_vert, model.mesh_vertadr, model.mesh_vertnum, model.mesh_face)
    normals = of(
        model.mesh_normal, model.mesh_normaladr, model.mesh_normalnum, model.mesh_facenormal
    )
    mesh = Mesh(vertices, np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3))
    if model.mesh_texcoordadr[number] < 0:
        half = np.ptp(vertices, axis=0) / 2.0
        return _Surface(mesh, normals, _project_texture(model, geom, vertices, half))
    uv = of(
        model.mesh_texcoord, model.mesh_texcoordadr, model.mesh_texcoordnum, model.mesh_facetexcoord
    )
    return _Surface(mesh, normals, uv)


_SURFACES: dict[int, Callable[[Any, int], _Surface]] = {
    int(mujoco.mjtGeom.mjGEOM_PLANE): _plane,
    int(mujoco.mjtGeom.mjGEOM_SPHERE): _ball,
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): _ball,
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): _capsule,
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): _cylinder,
    int(mujoco.mjtGeom.mjGEOM_BOX): _box,
    int(mujoco.mjtGeom.mjGEOM_MESH): _mesh,
}
