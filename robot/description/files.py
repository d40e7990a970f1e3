"""The files of a description that ``gazerig describe`` writes, by their paths in its folder."""

from gazerig.robot.description.links import Description
from gazerig.robot.description.mjcf import mjcf
from gazerig.robot.description.parts import FLOOR_M
from gazerig.robot.description.urdf import urdf

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


def scene_files(description: Description) -> dict[str, bytes]:
    """Return the rig as a MuJoCo model, a scene with it on a table, and their meshes, by path."""
    text, assets = mjcf(description, folder=MESHES)
    scene = _SCENE.format(name=description.name, floor=FLOOR_M)
    return {
        f"{description.name}.xml": text.encode(),
        "scene.xml": scene.encode(),
        **{f"{MESHES}/{file}": data for file, data in assets.items()},
    }


def description_files(description: Description) -> dict[str, bytes]:
    """Return all files by their paths in the output folder: MJCF, URDF and glTF."""
    from gazerig.robot.description.gltf import gltf  # takes .5 s of CPU time

    text, assets = urdf(description, MESHES)
    return {
        **scene_files(description),
        f"{description.name}.urdf": text.encode(),
        **{f"{MESHES}/{file}": data for file, data in assets.items()},
        f"{description.name}.glb": gltf(description),
    }
