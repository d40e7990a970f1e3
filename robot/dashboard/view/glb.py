"""Shapes with vertex colours and a surface finish, as binary glTF for browsers.

All shapes but the eyes are lit here, once, by the lights of the scene, so that a browser without a
graphics card does not have to light every pixel of every frame.
"""

from math import pi
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import viser
from PIL import Image

from gazerig.gaze.types import Floats, Vec3
from gazerig.robot.description.mesh import (
    Colour,
    Mesh,
    Painted,
    TexturedMesh,
    stored_shape,
)


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

    @property
    def is_browser_lit(self) -> bool:
        """Return whether the browser lights every pixel."""
        return self.roughness < 1.0


_SAMPLER = {"magFilter": 9729, "minFilter": 9985, "wrapS": 10497, "wrapT": 10497}
"""Textures are repeated and smoothed between pixels, not between sizes: without a graphics card
that would cost more than the rest of the room."""
SKIN = Finish(0.06, 9.0)
CLOTH = Finish()
PLASTIC = Finish(0.22, 26.0)
EYE = Finish(roughness=0.17)
FLAT = Finish(is_lit=False)
FINISHES = {
    "skin": SKIN, "plastic": PLASTIC, "cloth": CLOTH, "eye": EYE, "dark": FLAT, "flat": FLAT,
}  # fmt: skip
"""Finishes by the names that descriptions and worlds use."""


def textured_glb(shape: TexturedMesh, finish: Finish) -> bytes:
    """Return a mesh with a texture as a binary glTF file, lit here."""
    light = np.ones((len(shape.vertices), 3))
    if finish.is_lit:
        light = shade_colours(light, shape.normals, finish)
    gain = float(light.max())
    # In glTF the first row of an image is its top, and v grows downwards; trimesh inverts v.
    uv = shape.uv * (1.0, -1.0) + (0.0, 1.0)
    opaque = np.column_stack((light / gain, np.ones(len(light))))
    mesh = Mesh(shape.vertices, shape.faces)
    return _glb(mesh, opaque, None, _material(finish, gain), uv, shape.image)


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
    if finish.is_lit and not finish.is_browser_lit:
        rgba[:, :3] = shade_colours(
            rgba[:, :3], normals if pose is None else normals @ pose.T, finish
        )
        gain = float(rgba[:, :3].max())
        rgba[:, :3] /= gain
    material = _material(finish, gain)
    if colours.shape[1] == 4:
        material["alphaMode"] = "BLEND"
    return _glb(mesh, rgba, normals if finish.is_browser_lit else None, material)


def _material(finish: Finish, gain: float) -> dict[str, Any]:
    """Return a material in the format of glTF; gain: factor of its colours."""
    return {
        "pbrMetallicRoughness": {
            "metallicFactor": 0.0,
            "roughnessFactor": finish.roughness,
            "baseColorFactor": [gain, gain, gain, 1.0],
        },
        "doubleSided": False,
        "extensions": {} if finish.is_browser_lit else {"KHR_materials_unlit": {}},
    }


def _glb(
    mesh: Mesh,
    rgba: Floats,
    normals: Floats | None,
    material: dict[str, Any],
    uv: Floats | None = None,
    image: npt.NDArray[np.uint8] | None = None,
) -> bytes:
    """Return a mesh as a binary glTF file.

    Args:
        mesh: the mesh.
        rgba: colours (n, 4) of the vertices, 0..1, by which the texture is multiplied.
        normals: normals (n, 3) of the vertices, for surfaces that the browser lights.
        material: its material.
        uv: places (n, 2) of the vertices in the texture, as trimesh counts them.
        image: the texture.
    """
    import trimesh  # half a second of a processor, which a page without a view does not need
    from trimesh.exchange.gltf import export_glb

    colours = np.rint(255.0 * rgba).astype(np.uint8)
    look: Any = trimesh.visual.ColorVisuals(vertex_colors=colours)
    if image is not None:
        texture: Any = trimesh.visual.material.PBRMaterial(  # type: ignore[no-untyped-call]
            baseColorTexture=Image.fromarray(image)
        )
        look = trimesh.visual.TextureVisuals(uv, texture)  # type: ignore[no-untyped-call]
        look.vertex_attributes["color"] = colours
    shape = trimesh.Trimesh(
        mesh.vertices, mesh.faces, vertex_normals=normals, visual=look, process=False
    )

    def finish(tree: dict[str, Any]) -> None:
        surface = material["pbrMetallicRoughness"]
        for made in tree.get("materials", ()):
            surface = {
                **surface,
                "baseColorTexture": made["pbrMetallicRoughness"]["baseColorTexture"],
            }
        tree["materials"] = [{**material, "pbrMetallicRoughness": surface}]
        tree["meshes"][0]["primitives"][0]["material"] = 0
        tree["extensionsUsed"] = sorted(material["extensions"])
        if image is not None:
            tree["samplers"] = [_SAMPLER]
            tree["textures"][0]["sampler"] = 0

    data: Any = export_glb(  # type: ignore[no-untyped-call]
        shape, include_normals=normals is not None, tree_postprocessor=finish
    )
    return bytes(data)


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
