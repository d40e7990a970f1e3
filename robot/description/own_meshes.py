"""Meshes of the user that replace the generated shape of a link.

Supported files are STL, OBJ, PLY, OFF, GLB and glTF.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from math import cos, radians
from pathlib import Path
from typing import Any

import numpy as np

from gazerig.gaze.angles import rotation
from gazerig.robot.description.links import Description, Visual
from gazerig.robot.description.mesh import Mesh, Painted
from gazerig.robot.description.mesh_params import MeshParams


@dataclass(frozen=True, eq=False)
class OwnMesh:
    """User's mesh for a link: the rig's settings, and the content of the mesh file.

    painted: the mesh, in metres
    """

    link: str
    params: MeshParams
    painted: Painted


def with_own_meshes(description: Description, meshes: Sequence[OwnMesh]) -> Description:
    """Return a description in which some links have the user's meshes as visual shapes.

    Masses and collision shapes still follow from the rig's dimensions.
    """
    own = {mesh.link: (_visual(mesh),) for mesh in meshes}
    return description._replace(
        links=tuple(
            link._replace(visuals=own.get(link.name, link.visuals)) for link in description.links
        )
    )


def _visual(mesh: OwnMesh) -> Visual:
    x, y, z = mesh.params.position_mm
    yaw, pitch, roll = map(radians, mesh.params.rotation_deg)
    place = (x / 1e3, y / 1e3, z / 1e3)
    name = f"{mesh.link}_own"
    return Visual(name, mesh.painted, "plastic", place, rotation((yaw, pitch, roll)))


def unknown_links(description: Description, named: Iterable[str]) -> dict[str, str]:
    """Return a message for each name that is not the name of a link."""
    known = [link.name for link in description.links]
    found = {}
    for name in named:
        if name not in known:
            near = get_close_matches(name, known, 1)
            guess = f"did you mean {near[0]}? " if near else ""
            found[name] = f"no link of that name; {guess}there is {', '.join(known)}"
    return found


FORMATS = (".stl", ".obj", ".ply", ".off", ".glb", ".gltf")
_PLAIN = 190, 194, 202
"""Colour of a file without colours."""
_Y_UP = (".glb", ".gltf")
_MOST_BYTES, _MOST_FACES = 100_000_000, 150_000
_EDGE_RAD = radians(35.0)
"""Largest angle between a smooth corner's faces and their mean; other corners are sharp."""


class MeshUnusable(ValueError):
    """Unusable mesh file; the message has the reason and a remedy."""


def read_mesh(params: MeshParams) -> Painted:
    """Return a mesh with its colours, in metres, z up.

    Raises:
        MeshUnusable: the file does not exist, or it does not contain a mesh.
    """
    path = Path(params.file).expanduser()
    if path.suffix.lower() not in FORMATS:
        raise MeshUnusable(f"{path.name}: no {', '.join(FORMATS)} file; export it as one of these")
    try:
        size = path.stat().st_size
    except OSError as error:
        raise MeshUnusable(f"{path}: {error.strerror or error}; correct the path") from None
    if size > _MOST_BYTES:
        raise MeshUnusable(
            f"{path}: {size / 1e6:.0f} MB, more than {_MOST_BYTES / 1e6:.0f}; reduce its triangles"
        )
    mesh = _load_mesh(path)
    if not 0 < len(mesh.faces) <= _MOST_FACES:
        cure = f"reduce them to {_MOST_FACES}" if len(mesh.faces) else "it needs a closed surface"
        raise MeshUnusable(f"{path}: {len(mesh.faces)} triangles; {cure}")
    if not np.isfinite(mesh.vertices).all():
        raise MeshUnusable(f"{path}: points that are no numbers; export it again")
    y_up = path.suffix.lower() in _Y_UP
    # Every corner of every triangle becomes a separate point, which sharp edges require.
    look: Any = mesh.visual
    if look.kind == "texture":
        look = look.to_color()
    faces = np.asarray(mesh.faces)
    vertices = np.asarray(mesh.vertices, float)[faces] * params.metres_per_unit
    smooth = np.asarray(mesh.vertex_normals, float)[faces]
    flat = np.repeat(np.asarray(mesh.face_normals, float)[:, None], 3, axis=1)
    near = (smooth * flat).sum(axis=2, keepdims=True) > cos(_EDGE_RAD)
    normals = np.where(near, smooth, flat)
    if look.kind is None:
        colours = np.broadcast_to(np.array(_PLAIN, float), vertices.shape)
    else:
        colours = np.asarray(look.vertex_colors, float)[:, :3][faces]
    if y_up:
        turn = np.array(((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)))
        vertices, normals = vertices @ turn, normals @ turn
    corners = np.arange(3 * len(faces), dtype=np.uint32).reshape(-1, 3)
    return Painted(
        Mesh(vertices.reshape(-1, 3), corners), colours.reshape(-1, 3), normals.reshape(-1, 3)
    )


def _load_mesh(path: Path) -> Any:
    """Load all meshes of a file as one mesh of trimesh."""
    import trimesh  # its import is slow, and few rigs need it

    try:
        scene: Any = trimesh.load_scene(path)
        return scene.to_mesh()
    except Exception as error:  # the readers of many formats raise various exceptions
        reason = " ".join(str(error).split()) or type(error).__name__
        raise MeshUnusable(f"{path}: cannot be read ({reason[:120]}); export it again") from None
