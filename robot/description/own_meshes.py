"""Meshes of the user's own in place of what the program makes for a link."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from math import radians

from gazerig.gaze.angles import rotation
from gazerig.robot.description.links import Description, Visual
from gazerig.robot.description.mesh_params import MeshParams
from gazerig.robot.description.paint import Painted


@dataclass(frozen=True, eq=False)
class OwnMesh:
    """A user's mesh for a link: the rig's settings, and the content of the mesh file.

    painted: in metres
    """

    link: str
    params: MeshParams
    painted: Painted


def with_own_meshes(description: Description, meshes: Sequence[OwnMesh]) -> Description:
    """Return a description in which some links look as the user's meshes.

    Masses and collision shapes stay those of the rig's measures.
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
    """Return for each name that is no link's what is wrong with it."""
    known = [link.name for link in description.links]
    found = {}
    for name in named:
        if name not in known:
            near = get_close_matches(name, known, 1)
            guess = f"did you mean {near[0]}? " if near else ""
            found[name] = f"no link of that name; {guess}there is {', '.join(known)}"
    return found
