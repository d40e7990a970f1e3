"""The files of a description that ``gazerig describe`` writes, by their paths in its folder."""

import re
from collections.abc import Collection
from typing import Literal

from gazerig.robot.description.links import Description
from gazerig.robot.description.mjcf import mjcf
from gazerig.robot.description.parts import FLOOR_M
from gazerig.robot.description.urdf import urdf

Format = Literal["mjcf", "urdf", "glb"]
FORMATS: tuple[Format, ...] = ("mjcf", "urdf", "glb")

MESHES = "meshes"
_SCENE = """<mujoco model="{name} on a table">
  <include file="{name}.xml"/>
  <visual>
    <headlight ambient="0.35 0.35 0.35" diffuse="0.35 0.35 0.35" specular="0.1 0.1 0.1"/>
    <global offwidth="1280" offheight="960" azimuth="165" elevation="-8"/>
    <map shadowscale="0.4"/>
  </visual>
  <statistic center="0 0 0.1" extent="0.5"/>
  <asset>
    <texture name="sky" type="skybox" builtin="gradient" rgb1="0.75 0.8 0.86"
      rgb2="0.45 0.5 0.58" width="64" height="384"/>
    <material name="table" rgba="0.72 0.62 0.5 1"/>
  </asset>
  <worldbody>
    <light pos="1.0 0.6 0.75" dir="-0.8 -0.48 -0.5" diffuse="0.6 0.57 0.53"/>
    <geom name="table" type="plane" pos="0 0 {floor}" size="1 1 0.05" material="table"/>
  </worldbody>
</mujoco>
"""


def file_name(name: str) -> str:
    """Return a rig's name as a file name."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", name).strip("_") or "rig"


def description_files(
    description: Description, formats: Collection[Format] = FORMATS
) -> dict[str, bytes]:
    """Return the content of all files by their paths in the output folder.

    Args:
        description: description of the rig.
        formats: mjcf: the rig as a MuJoCo model, and a scene with it on a table; urdf; glb.
    """
    name = file_name(description.name)
    named = description._replace(name=name)
    found: dict[str, bytes] = {}
    if "mjcf" in formats:
        text, assets = mjcf(named, folder=MESHES)
        found[f"{name}.xml"] = text.encode()
        found["scene.xml" if name != "scene" else "scene_.xml"] = _SCENE.format(
            name=name, floor=FLOOR_M
        ).encode()
        found |= {f"{MESHES}/{file}": data for file, data in assets.items()}
    if "urdf" in formats:
        text, assets = urdf(named, MESHES)
        found[f"{name}.urdf"] = text.encode()
        found |= {f"{MESHES}/{file}": data for file, data in assets.items()}
    if "glb" in formats:
        from gazerig.robot.description.gltf import gltf  # takes .5 s of CPU time

        found[f"{name}.glb"] = gltf(named)
    return found
