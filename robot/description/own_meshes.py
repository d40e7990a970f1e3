"""Meshes of the user that replace the stored shape of a link."""

from math import cos, radians
from pathlib import Path
from typing import Any

import numpy as np

from gazerig.drivers.errors import SetupError
from gazerig.gaze.angles import rotation, scale
from gazerig.robot.description.links import OwnMesh, Visual
from gazerig.robot.description.mesh import Mesh, Painted
from gazerig.robot.description.mesh_params import MeshParams

FORMATS = (".stl", ".obj", ".ply", ".off", ".glb", ".gltf")
_PLAIN = 190, 194, 202
"""Colour of a file without colours."""
_MOST_FACES = 150_000
_EDGE_RAD = radians(35.0)
"""Largest angle between a smooth corner's faces and their mean; other corners are sharp."""


def own_visual(link: str, params: MeshParams) -> Visual:
    """Return the look of a link from its mesh file.

    Raises:
        SetupError: the file does not exist, or it does not contain a mesh.
    """
    yaw, pitch, roll = map(radians, params.rotation_deg)
    place = scale(params.position_mm, 1e-3)
    R = rotation((yaw, pitch, roll))
    return Visual(f"{link}_own", OwnMesh(read_mesh(params)), "plastic", place, R)


def read_mesh(params: MeshParams) -> Painted:
    """Return a mesh with its colours, in metres, z up.

    Raises:
        SetupError: the file does not exist, or it does not contain a mesh.
    """
    import trimesh  # its import is slow, and few rigs need it

    path = Path(params.file).expanduser()
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        raise SetupError(f"{path.name}: no {', '.join(FORMATS)} file; export it as one of these")
    if not path.is_file():
        raise SetupError(f"{path}: no such file; correct the path")
    try:
        mesh: Any = trimesh.load_scene(path).to_mesh()
    except Exception as error:  # the readers of many formats raise various exceptions
        reason = " ".join(str(error).split()) or type(error).__name__
        raise SetupError(f"{path}: cannot be read ({reason[:120]}); export it again") from None
    if not 0 < len(mesh.faces) <= _MOST_FACES:
        raise SetupError(f"{path}: {len(mesh.faces)} triangles; export 1 to {_MOST_FACES}")
    # Every corner of every triangle becomes a separate point, which sharp edges require.
    faces = np.asarray(mesh.faces)
    vertices = np.asarray(mesh.vertices, float)[faces].reshape(-1, 3) * params.metres_per_unit
    smooth = np.asarray(mesh.vertex_normals, float)[faces].reshape(-1, 3)
    flat = np.repeat(np.asarray(mesh.face_normals, float), 3, axis=0)
    near = (smooth * flat).sum(axis=1, keepdims=True) > cos(_EDGE_RAD)
    normals = np.where(near, smooth, flat)
    look: Any = mesh.visual.to_color() if mesh.visual.kind == "texture" else mesh.visual
    colours = np.broadcast_to(np.array(_PLAIN, float), vertices.shape)
    if look.kind is not None:
        colours = np.asarray(look.vertex_colors, float)[faces, :3].reshape(-1, 3)
    if suffix in (".glb", ".gltf"):  # y is up
        turn = np.array(((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)))
        vertices, normals = vertices @ turn, normals @ turn
    corners = np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3)
    return Painted(Mesh(vertices, corners), colours, normals)
