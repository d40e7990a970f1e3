"""Shapes with vertex colours and a surface finish, as binary glTF for browsers.

All shapes but the eyes are lit here, once, by the lights of the scene, so that a browser without a
graphics card does not have to light every pixel of every frame.
"""

import json
import struct
from math import pi
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
import viser
from PIL import Image

from gazerig.gaze.types import Floats, Vec3
from gazerig.robot.description.mesh import (
    Colour,
    Mesh,
    Painted,
    stored_shape,
)
from gazerig.robot.description.texture import TexturedMesh


class Light(NamedTuple):
    """Light: its direction, colour and intensity."""

    position: Vec3
    colour: Colour
    intensity: float


SKY, GROUND, SKY_INTENSITY = (255, 250, 244), (186, 170, 166), 2.1
"""Ambient light: colours from above and from below."""
# The key light comes from above and the head's left, like a window; a fill light comes from the
# right, and a third light from behind.
LIGHTS = (
    Light((0.9, 0.75, 1.25), (255, 244, 228), 2.6),
    Light((0.8, -1.2, 0.25), (214, 228, 255), 0.9),
    Light((-1.2, -0.5, 1.0), (235, 242, 255), 1.4),
)
_TO_EYE = np.array((0.88, -0.47, 0.07))
"""First viewpoint of the scene, for which highlights are computed."""


class Finish(NamedTuple):
    """Reflection of a surface.

    shine: brightness of the highlight of a light; tight: exponent; a larger one makes it smaller
    roughness: below 1 the browser lights every pixel, and a lower value gives smaller
        highlights; 1: lit here
    is_lit: False shows the colours unlit
    """

    shine: float = 0.0
    tight: float = 12.0
    roughness: float = 1.0
    is_lit: bool = True


_SAMPLER = {"magFilter": 9729, "minFilter": 9985, "wrapS": 10497, "wrapT": 10497}
"""Textures are repeated and smoothed between pixels, not between sizes: without a graphics card
that would cost more than the rest of the room."""
SKIN = Finish(0.06, 9.0)
CLOTH = Finish()
PLASTIC = Finish(0.22, 26.0)
EYE = Finish(roughness=0.17)
FLAT = Finish(is_lit=False)


def textured_glb(shape: TexturedMesh, finish: Finish) -> bytes:
    """Return a mesh with a texture as a binary glTF file, lit here."""
    # Imported only to show a world: it takes half a second of a processor.
    import trimesh
    from trimesh.exchange.gltf import export_glb

    light = np.ones((len(shape.vertices), 3))
    if finish.is_lit:
        light = shade_colours(light, shape.normals, finish)
    gain = float(light.max())
    colours = np.ones((len(light), 4))
    colours[:, :3] = light / gain
    # In glTF the first row of an image is its top, and v grows downwards; trimesh inverts v.
    visual: Any = trimesh.visual.TextureVisuals(  # type: ignore[no-untyped-call]
        uv=shape.uv * (1.0, -1.0) + (0.0, 1.0),
        material=trimesh.visual.material.PBRMaterial(  # type: ignore[no-untyped-call]
            baseColorTexture=Image.fromarray(shape.image),
            baseColorFactor=(1.0, 1.0, 1.0, 1.0),
            metallicFactor=0.0,
            roughnessFactor=1.0,
        ),
    )
    visual.vertex_attributes["color"] = np.rint(255.0 * colours).astype(np.uint8)
    mesh = trimesh.Trimesh(shape.vertices, shape.faces, visual=visual, process=False)

    def unlit(tree: dict[str, Any]) -> None:
        tree["extensionsUsed"] = sorted({*tree.get("extensionsUsed", ()), "KHR_materials_unlit"})
        for material in tree["materials"]:
            material["extensions"] = {"KHR_materials_unlit": {}}
            material["pbrMetallicRoughness"]["baseColorFactor"] = [gain, gain, gain, 1.0]
        tree["samplers"] = [_SAMPLER]
        for texture in tree["textures"]:
            texture["sampler"] = 0

    data: Any = export_glb(mesh, include_normals=False, tree_postprocessor=unlit)  # type: ignore[no-untyped-call]
    return bytes(data)


def painted_glb(painted: Painted, finish: Finish, pose: Floats | None = None) -> bytes:
    """Return a painted mesh as a binary glTF file.

    Args:
        painted: the mesh; colours with four components are translucent.
        finish: its reflection of light.
        pose: rotation (3, 3) of the mesh in the scene when it is lit; None: no rotation.
    """
    mesh, colours, normals = painted
    rgba = np.ones((len(mesh.vertices), 4))
    rgba[:, : colours.shape[1]] = np.clip(colours / 255.0, 0.0, 1.0)
    rgba[:, :3] = _to_linear(rgba[:, :3])
    gain = 1.0
    by_browser = finish.roughness < 1.0
    if finish.is_lit and not by_browser:
        rgba[:, :3] = shade_colours(
            rgba[:, :3], normals if pose is None else normals @ pose.T, finish
        )
        gain = float(rgba[:, :3].max())
        rgba[:, :3] /= gain
    material: dict[str, Any] = {
        "pbrMetallicRoughness": {
            "metallicFactor": 0.0,
            "roughnessFactor": finish.roughness,
            "baseColorFactor": [gain, gain, gain, 1.0],
        },
        "doubleSided": False,
        "extensions": {} if by_browser else {"KHR_materials_unlit": {}},
    }
    if colours.shape[1] == 4:
        material["alphaMode"] = "BLEND"
    bytes_rgba = np.rint(255.0 * rgba).astype(np.uint8)
    return glb_file(mesh, bytes_rgba, normals if by_browser else None, material)


def shade_colours(colours: Floats, normals: Floats, finish: Finish) -> Floats:
    """Return the colours of surfaces under the scene's lights.

    Args:
        colours: reflectances (n, 3), 0..1, linear.
        normals: outward normals (n, 3).
        finish: reflection of the surfaces.

    Returns:
        Colours (n, 3); may exceed 1.
    """
    up = 0.5 + 0.5 * normals[:, 2:]
    sky, ground = _to_linear(np.array((SKY, GROUND)) / 255.0)
    around = up * sky + (1.0 - up) * ground
    found = colours * around * (SKY_INTENSITY / pi)
    for light in LIGHTS:
        way = np.array(light.position) / np.linalg.norm(light.position)
        facing = np.clip(normals @ way, 0.0, None)[:, None]
        half = (way + _TO_EYE) / np.linalg.norm(way + _TO_EYE)
        gleam = finish.shine * np.clip(normals @ half, 0.0, 1.0)[:, None] ** finish.tight
        colour = _to_linear(np.array(light.colour) / 255.0)
        found = found + light.intensity * colour * (colours * facing / pi + gleam)
    return np.asarray(found)


def _to_linear(share: Floats) -> Floats:
    """Return colours in linear light, as glTF defines vertex colours."""
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


_UNSIGNED_BYTE: Final = 5121
_UNSIGNED_INT: Final = 5125
_FLOAT: Final = 5126
_TRIANGLES: Final = 4


def glb_file(
    mesh: Mesh, rgba: npt.NDArray[np.uint8], normals: Floats | None, material: dict[str, Any]
) -> bytes:
    """Return a mesh as a binary glTF file.

    Args:
        mesh: the mesh.
        rgba: colours (n, 4) of the vertices.
        normals: normals (n, 3) of the vertices, for surfaces that the browser lights.
        material: material in the format of glTF.
    """
    columns: dict[str, tuple[npt.NDArray[Any], int, str]] = {
        "": (mesh.faces.astype("<u4").reshape(-1, 1), _UNSIGNED_INT, "SCALAR"),
        "POSITION": (mesh.vertices.astype("<f4"), _FLOAT, "VEC3"),
        "COLOR_0": (rgba, _UNSIGNED_BYTE, "VEC4"),
    }
    if normals is not None:
        columns["NORMAL"] = (normals.astype("<f4"), _FLOAT, "VEC3")
    accessors, views, data = list[dict[str, Any]](), list[dict[str, int]](), b""
    for number, (values, kind, shape) in enumerate(columns.values()):
        accessor = {"bufferView": number, "componentType": kind, "count": len(values)}
        bounds = {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        normalized = {"normalized": True} if kind == _UNSIGNED_BYTE else {}
        accessors.append({**accessor, "type": shape, **bounds, **normalized})
        part = values.tobytes()  # every column consists of whole words of four bytes
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(part)})
        data += part
    attributes = {name: number for number, name in enumerate(columns) if name}
    primitive = {"attributes": attributes, "indices": 0, "mode": _TRIANGLES, "material": 0}
    tree: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [primitive]}],
        "materials": [material],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(data)}],
    }
    if used := sorted(material["extensions"]):
        tree["extensionsUsed"] = used
    text = json.dumps(tree, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text
    body += struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def glow_disc(inner: tuple[int, int, int, int]) -> Painted:
    """Return a flat disc of radius 1, facing up, that fades out from its centre."""
    disc = stored_shape("disc")
    radius = np.hypot(*disc.mesh.vertices[:, :2].T)
    alpha = (0.5 + 0.5 * np.cos(pi * radius)) ** 1.3 * inner[3]
    return disc._replace(colours=np.column_stack((np.tile(inner[:3], (len(alpha), 1)), alpha)))


def add_lights(scene: viser.SceneApi) -> None:
    """Add the lights; the scene has no background, so that the page's background is visible."""
    scene.world_axes.visible = False
    scene.configure_environment_map(None)
    scene.configure_default_lights(enabled=False, cast_shadow=False)
    scene.add_light_hemisphere(
        "/light/sky", sky_color=SKY, ground_color=GROUND, intensity=SKY_INTENSITY
    )
    # The light from behind is only for surfaces lit in advance; it does not reach the front of the
    # eyes.
    for number, light in enumerate(LIGHTS[:2]):
        scene.add_light_directional(
            f"/light/{number}",
            color=light.colour,
            intensity=light.intensity,
            position=light.position,
        )
