"""A description as binary glTF: a tree of nodes with meshes, for browsers and modelling programs.

The node of a link that a joint turns has the name of the joint. y is up, as glTF requires, below a
root that turns z up.
"""

from typing import Any

import numpy as np
import trimesh
from PIL import Image
from trimesh.exchange.gltf import export_glb
from trimesh.visual.material import PBRMaterial

from gazerig.gaze.angles import compose, turn_about
from gazerig.gaze.types import Floats, Mat3, Vec3
from gazerig.robot.description.links import ORIGIN, Description, Visual
from gazerig.robot.description.mesh import add_texture
from gazerig.robot.model.frames import quaternion

_Y_UP: Mat3 = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))
_ROOT = "world"
_ROUGHNESS = 0.7
"""0 is a mirror; pictures of the page have one for each material."""


def gltf(description: Description) -> bytes:
    """Return a description as a binary glTF file, with its lids open and all other joints at 0."""
    scene: Any = trimesh.Scene(base_frame=_ROOT)
    names = {link.name: link.joint.name if link.joint else link.name for link in description.links}
    joints: dict[str, dict[str, Any]] = {}
    for link in description.links:
        parent = names[link.parent] if link.parent else _ROOT
        R, p = (link.R, link.p_m) if link.parent else (_Y_UP, ORIGIN)
        node = names[link.name]
        if link.joint is not None:
            R = compose(R, turn_about(link.joint.axis, link.joint.awake_rad))
            w, x, y, z = quaternion(R)
            joints[node] = {"rotation": [x, y, z, w], "translation": list(p)}
        scene.graph.update(frame_from=parent, frame_to=node, matrix=_matrix(R, p))
        for visual in link.visuals:
            scene.add_geometry(
                _mesh(visual),
                node_name=f"{visual.name}_mesh",
                geom_name=visual.name,
                parent_node_name=node,
                transform=_matrix(visual.R, visual.p_m),
            )

    def complete(tree: dict[str, Any]) -> None:
        for node in tree["nodes"]:
            if node["name"] in joints:
                # Only a node without a matrix can be animated (glTF 2.0, 3.5.3).
                node.pop("matrix", None)
                node.update(joints[node["name"]])

    exported: Any = export_glb(  # type: ignore[no-untyped-call]
        scene, include_normals=True, tree_postprocessor=complete
    )
    return bytes(exported)


def _mesh(visual: Visual) -> Any:
    mesh = add_texture(visual.painted())
    material = PBRMaterial(  # type: ignore[no-untyped-call]
        name=visual.name,
        baseColorTexture=Image.fromarray(mesh.image),
        metallicFactor=0.0,
        roughnessFactor=_ROUGHNESS,
    )
    # trimesh counts v from below.
    uv = mesh.uv * (1.0, -1.0) + (0.0, 1.0)
    look = trimesh.visual.TextureVisuals(uv=uv, material=material)  # type: ignore[no-untyped-call]
    return trimesh.Trimesh(
        mesh.vertices, mesh.faces, vertex_normals=mesh.normals, visual=look, process=False
    )


def _matrix(R: Mat3, p: Vec3) -> Floats:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = R, p
    return matrix
