"""The geoms of a compiled MuJoCo model as coloured meshes in their initial poses."""

from collections.abc import Collection, Iterator
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray
from trimesh import Trimesh, creation
from trimesh.graph import smooth_shade

from gazerig.gaze.types import Floats
from gazerig.robot.dashboard.feed.world_shapes import WorldPart
from gazerig.robot.description.mesh import Mesh, Painted, TexturedMesh

_SHOWN_GROUPS = 3
"""Groups of geoms below this are shown, as in MuJoCo's own viewer."""
_FAR_M = 10.0
"""Half the size of an infinite plane."""
_ROUND, _SMOOTH_RAD = 24, 0.6
"""Sides of a cylinder, and largest angle between faces that are shaded as one."""
_NO_COLOUR = (0.5, 0.5, 0.5, 1.0)
"""MuJoCo's colour of a geom without a colour; the colour of its material is then used."""
_WALL_THICK_M, _WALL_WIDE_M = 0.06, 0.9
"""Limits of thickness and width of a wall. Only the side that faces the room is shown, so that the
room is visible from outside."""
_ROOM_M = np.array((1.0, 0.0, 0.0))
"""A point in the room."""


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
        is_shown = model.geom_group[geom] < _SHOWN_GROUPS and _rgba(model, geom)[3] > 0.0
        if body.name in moving or not is_shown or (mesh := _mesh(model, geom)) is None:
            continue
        uv = _project_texture(model, geom, mesh)
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = data.geom_xmat[geom].reshape(3, 3), data.geom_xpos[geom]
        mesh.apply_transform(pose)
        if _is_wall(model, geom):  # only the faces that are visible from the room
            seen = ((_ROOM_M - mesh.triangles[:, 0]) * mesh.face_normals).sum(axis=1) > 0.0
            mesh.update_faces(seen)
        yield WorldPart(f"geom{geom}", _paint(model, geom, mesh, uv), "cloth")


def _rgba(model: Any, geom: int) -> Floats:
    material = int(model.geom_matid[geom])
    own: Floats = model.geom_rgba[geom].astype(float)
    if material < 0 or not np.allclose(own, _NO_COLOUR):
        return own
    return np.asarray(model.mat_rgba[material], float)


def _paint(model: Any, geom: int, mesh: Trimesh, uv: Floats) -> Painted | TexturedMesh:
    picture, rgba = _texture_image(model, geom), _rgba(model, geom)
    vertices, faces = np.asarray(mesh.vertices), mesh.faces.astype(np.uint32)
    normals = np.asarray(mesh.vertex_normals)
    if picture is None:
        colours = np.tile(255.0 * rgba[:3], (len(vertices), 1))
        return Painted(Mesh(vertices, faces), colours, normals)
    tinted = np.rint(np.clip(picture * rgba[:3], 0.0, 255.0)).astype(np.uint8)
    return TexturedMesh(vertices, normals, uv, faces, tinted)


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


def _is_wall(model: Any, geom: int) -> bool:
    if model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_BOX:
        return False
    thin, middle, _ = np.sort(2.0 * model.geom_size[geom])
    return bool(thin <= _WALL_THICK_M and middle >= _WALL_WIDE_M)


def _project_texture(model: Any, geom: int, mesh: Trimesh) -> Floats:
    """Return texture coordinates of vertices for a picture projected along the geom's z axis."""
    material, half = int(model.geom_matid[geom]), 0.5 * np.ptp(mesh.vertices, axis=0)
    repeat = np.ones(2) if material < 0 else model.mat_texrepeat[material].astype(float)
    if material >= 0 and not model.mat_texuniform[material]:
        repeat = repeat / np.maximum(half[:2], 1e-9)
    return np.asarray(mesh.vertices[:, :2] * repeat * (0.5, -0.5) - 0.5)


def _mesh(model: Any, geom: int) -> Trimesh | None:
    """Return the surface of a geom in its own frame, with normals, None for other kinds."""
    kinds, size = mujoco.mjtGeom, model.geom_size[geom].astype(float)
    match kinds(int(model.geom_type[geom])):
        case kinds.mjGEOM_PLANE:
            across = 2.0 * np.where(size[:2] > 0.0, size[:2], _FAR_M)
            mesh = creation.box(extents=(*across, 1e-3))
        case kinds.mjGEOM_BOX:
            mesh = creation.box(extents=2.0 * size)
        case kinds.mjGEOM_CYLINDER:
            mesh = creation.cylinder(radius=size[0], height=2.0 * size[1], sections=_ROUND)
        case kinds.mjGEOM_CAPSULE:
            mesh = creation.capsule(radius=size[0], height=2.0 * size[1], count=(8, _ROUND // 2))
        case kinds.mjGEOM_SPHERE:
            mesh = creation.icosphere(radius=size[0])
        case kinds.mjGEOM_ELLIPSOID:
            mesh = creation.icosphere()
            mesh.apply_scale(size)
        case kinds.mjGEOM_MESH:
            one = model.mesh(int(model.geom_dataid[geom]))
            vertices = model.mesh_vert[one.vertadr[0] :][: one.vertnum[0]]
            mesh = Trimesh(vertices, model.mesh_face[one.faceadr[0] :][: one.facenum[0]])
        case _:
            return None
    shaded: Trimesh = smooth_shade(mesh, angle=_SMOOTH_RAD)
    return shaded
