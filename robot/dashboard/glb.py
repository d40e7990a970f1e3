"""Shapes with colours by vertex and a surface finish, as binary glTF that browsers draw."""

from functools import partial
from typing import Any, NamedTuple

import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.exchange.gltf import export_glb

from gazerig.gaze.types import Floats
from gazerig.robot.model.paint import Painted

Bytes = NDArray[np.uint8]


class Finish(NamedTuple):
    """How a surface answers light.

    roughness: 0 mirrors, 1 is chalk; gloss: share of a clear coat over it, which shows lights as
    small bright spots; lit: False shows the colours as they are
    """

    roughness: float = 0.65
    gloss: float = 0.0
    gloss_roughness: float = 0.12
    lit: bool = True


SKIN = Finish(0.62)
CLOTH = Finish(0.9)
PLASTIC = Finish(0.45)
EYE = Finish(0.35, 1.0, 0.1)
FLAT = Finish(lit=False)


def glb(painted: Painted, finish: Finish) -> bytes:
    """Return a painted mesh as a binary glTF file; colours with a fourth number are translucent."""
    mesh, colours, normals = painted
    rgba = np.full((len(mesh.vertices), 4), 255.0)
    rgba[:, : colours.shape[1]] = colours
    shape = trimesh.Trimesh(
        mesh.vertices,
        mesh.faces,
        vertex_normals=normals,
        vertex_colors=_linear(rgba),
        process=False,
    )
    see_through = colours.shape[1] == 4
    data: Any = export_glb(  # type: ignore[no-untyped-call]
        shape,
        include_normals=True,
        tree_postprocessor=partial(_finish, finish=finish, see_through=see_through),
    )
    return bytes(data)


def _linear(rgba: Floats) -> Bytes:
    """Return colours as glTF wants those of vertices: in proportion to light, not as on screens."""
    share = np.clip(rgba / 255.0, 0.0, 1.0)
    share[:, :3] = np.where(
        share[:, :3] <= 0.04045, share[:, :3] / 12.92, ((share[:, :3] + 0.055) / 1.055) ** 2.4
    )
    return np.asarray(np.rint(255.0 * share), np.uint8)


def _finish(tree: dict[str, Any], finish: Finish, see_through: bool) -> None:
    """Write the material into a glTF tree: trimesh itself knows no clear coat."""
    material: dict[str, Any] = {
        "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": finish.roughness},
        "doubleSided": True,
    }
    extensions: dict[str, Any] = {}
    if finish.gloss > 0.0:
        extensions["KHR_materials_clearcoat"] = {
            "clearcoatFactor": finish.gloss,
            "clearcoatRoughnessFactor": finish.gloss_roughness,
        }
    if not finish.lit:
        extensions["KHR_materials_unlit"] = {}
    if extensions:
        material["extensions"] = extensions
        tree["extensionsUsed"] = sorted({*tree.get("extensionsUsed", ()), *extensions})
    if see_through:
        material["alphaMode"] = "BLEND"
    tree["materials"] = [material]
    for mesh in tree["meshes"]:
        for primitive in mesh["primitives"]:
            primitive["material"] = 0
