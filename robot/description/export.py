"""A description as MJCF and URDF, with the files that they reference. Pure.

MJCF, the format of MuJoCo, is a complete model, and can be attached to a world (``spec.attach``).
Its only body in the world is the rig's base. Its parts collide with the world, not with each other.
URDF is read by ROS, Foxglove and most simulators; it has no shapes for collisions, and needs no
package.
"""

import xml.etree.ElementTree as ET
from collections.abc import Iterable
from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np

from gazerig.gaze.angles import angles_of, compose, turn_about
from gazerig.gaze.types import Floats, Mat3, Vec3
from gazerig.robot.description.links import FLOOR_M, Description, Link, Visual
from gazerig.robot.description.mesh import add_texture
from gazerig.robot.model.frames import quaternion


def mesh_files(visual: Visual) -> dict[str, bytes]:
    """Return the .obj, .mtl and .png files of a look by their names; lengths in metres."""
    name = visual.name
    text, image = _written(visual.shape, visual.scale)
    return {
        f"{name}.obj": f"mtllib {name}.mtl\no {name}\nusemtl {name}\n{text}".encode(),
        f"{name}.mtl": (
            f"newmtl {name}\nKa 1 1 1\nKd 1 1 1\nKs 0.1 0.1 0.1\nNs 20\nillum 2\n"
            f"map_Kd {name}.png\n"
        ).encode(),
        f"{name}.png": image,
    }


# A world is built once for its physics and once for its images.
@lru_cache(maxsize=64)
def _written(shape: str, scale: float | tuple[float, float, float]) -> tuple[str, bytes]:
    """Return the points and faces of a shape as text, and its colours as a PNG."""
    painted = Visual("", shape, scale=scale).painted()
    (vertices, faces), _, normals = painted
    mesh = add_texture(painted)
    # In this format an image begins at its lower left corner; triangles share points and normals.
    points = (
        _rows("v %.6f %.6f %.6f\n", vertices)
        + _rows("vt %.5f %.5f\n", mesh.uv * (1.0, -1.0) + (0.0, 1.0))
        + _rows("vn %.3f %.3f %.3f\n", normals)
    )
    table = np.dstack((faces, mesh.faces, faces)) + 1
    _, image = cv2.imencode(".png", cv2.cvtColor(mesh.image, cv2.COLOR_RGB2BGR))
    return points + _rows("f %d/%d/%d %d/%d/%d %d/%d/%d\n", table.reshape(-1, 9)), bytes(image)


def _rows(line: str, values: Floats | np.ndarray) -> str:
    """Return a line for each row; formatting all together takes a third of the time."""
    return (line * len(values)) % tuple(values.ravel().tolist())


Text = str | float | Iterable[float] | None


def element(parent: ET.Element, tag: str, **attributes: Text) -> ET.Element:
    """Add an element; numbers are the shortest text that is exact, None adds no attribute."""
    texts = {key: _text(one) for key, one in attributes.items() if one is not None}
    return ET.SubElement(parent, tag, texts)


def _text(value: str | float | Iterable[float]) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, Iterable):
        return " ".join(map(_text, value))
    return repr(float(value) + 0.0).removesuffix(".0")  # no -0.0


_LOOKS_GROUP, _COLLISIONS_GROUP = "2", "3"
"""Groups of geoms as in MuJoCo's own models: the viewer initially hides the second."""
_STEP_S = 0.001
"""Time step, that of the servos' control loops; their gains are too high for larger ones."""


class Model(NamedTuple):
    """Text of a model, and the content of its files by name."""

    xml: str
    assets: dict[str, bytes]


def mjcf(description: Description, folder: str = "", *, looks: bool = True) -> Model:
    """Return a description as MJCF; the lids are open at first, all other joints at 0.

    Args:
        description: description of the rig.
        folder: folder of the meshes and textures, relative to the text.
        looks: include visual shapes; without them, the same mechanism needs no files.
    """
    root = ET.Element("mujoco", model=description.name)
    element(
        root, "compiler", angle="radian", autolimits="true",
        meshdir=folder or None, texturedir=folder or None,
    )  # fmt: skip
    element(root, "option", timestep=_STEP_S, integrator="implicitfast")
    assets = element(root, "asset")
    files: dict[str, bytes] = {}
    bodies = {"": element(root, "worldbody")}
    for link in description.links:
        body = bodies[link.name] = _body(bodies[link.parent or ""], link)
        for visual in link.visuals if looks else ():
            name = visual.name
            own = mesh_files(visual)
            files |= {file: data for file, data in own.items() if not file.endswith(".mtl")}
            element(assets, "texture", name=name, type="2d", file=f"{name}.png")
            element(assets, "material", name=name, texture=name)
            # A surface with holes has no volume; the body specifies its mass.
            element(assets, "mesh", name=name, file=f"{name}.obj", inertia="shell")
            element(
                body, "geom", name=name, type="mesh", mesh=name, material=name, contype="0",
                conaffinity="0", group=_LOOKS_GROUP, mass="0", pos=visual.p_m, quat=quaternion(visual.R),
            )  # fmt: skip
    _add_servos(root, description)
    ET.indent(root)
    return Model(ET.tostring(root, encoding="unicode") + "\n", files)


def _body(parent: ET.Element, link: Link) -> ET.Element:
    """Add a link without its looks."""
    joint, R, at_rad = link.joint, link.R, 0.0
    if joint is not None:
        at_rad = joint.awake_rad
        R = compose(R, turn_about(joint.axis, at_rad))
    body = element(parent, "body", name=link.name, pos=link.p_m, quat=quaternion(R))
    if link.inertia is not None:
        kg, com_m, ((xx, xy, xz), (_, yy, yz), (_, _, zz)) = link.inertia
        element(body, "inertial", pos=com_m, mass=kg, fullinertia=(xx, yy, zz, xy, xz, yz))
    if joint is not None:
        element(
            body, "joint", name=joint.name, type="hinge", axis=joint.axis,
            range=(joint.low_rad, joint.high_rad), ref=at_rad or None,
        )  # fmt: skip
    for shape in link.collisions:
        element(
            body, "geom", type="ellipsoid", size=shape.half_m, contype="1", conaffinity="0",
            group=_COLLISIONS_GROUP, rgba="0.8 0.4 0.2 0.4", mass="0", pos=shape.p_m,
        )  # fmt: skip
    return body


def _add_servos(root: ET.Element, description: Description) -> None:
    """Add a motor to each joint, and the linkages that turn two joints together."""
    linkages, actuators = element(root, "equality"), element(root, "actuator")
    for joint in description.joints:
        name, most = joint.name, joint.max_torque_nm
        if joint.follows:
            # The largest stiffness that is stable with steps of 1 ms.
            element(
                linkages, "joint", joint1=name, joint2=joint.follows, solref="0.002 1",
                polycoef="0 1 0 0 0",
            )  # fmt: skip
        else:
            element(actuators, "motor", name=name, joint=name, ctrlrange=(-most, most))


def urdf(description: Description, folder: str = "meshes", *, looks: bool = True) -> Model:
    """Return a description as URDF.

    Args:
        description: description of the rig.
        folder: folder of the meshes, relative to the text.
        looks: include visual shapes.
    """
    root = ET.Element("robot", name=description.name)
    # For MuJoCo, which otherwise drops visual shapes and looks for meshes in the text's folder.
    element(
        element(root, "mujoco"), "compiler", meshdir=folder, discardvisual="false",
        fusestatic="false", strippath="true",
    )  # fmt: skip
    assets: dict[str, bytes] = {}
    for link in description.links:
        body = element(root, "link", name=link.name)
        if link.inertia is not None:
            inertial = element(body, "inertial")
            element(inertial, "origin", xyz=link.inertia.com_m)
            element(inertial, "mass", value=link.inertia.mass_kg)
            (xx, xy, xz), (_, yy, yz), (_, _, zz) = link.inertia.tensor_kg_m2
            element(inertial, "inertia", ixx=xx, ixy=xy, ixz=xz, iyy=yy, iyz=yz, izz=zz)
        for visual in link.visuals if looks else ():
            part = element(body, "visual", name=visual.name)
            _place(part, visual.p_m, visual.R)
            element(element(part, "geometry"), "mesh", filename=f"{folder}/{visual.name}.obj")
            assets |= mesh_files(visual)
        if link.parent is not None:
            _add_joint(root, link, link.parent)
    ET.indent(root)
    text = ET.tostring(root, encoding="unicode")
    return Model(f'<?xml version="1.0"?>\n{text}\n', assets)


def _place(parent: ET.Element, p_m: Vec3, R: Mat3) -> None:
    """Add a pose; its angles turn about fixed x, y and z axes, in this order."""
    yaw, pitch, roll = angles_of(R)
    element(parent, "origin", xyz=p_m, rpy=(roll, -pitch, yaw))


def _add_joint(root: ET.Element, link: Link, parent: str) -> None:
    joint = link.joint
    name, kind = (f"{link.name}_fixed", "fixed") if joint is None else (joint.name, "revolute")
    hinge = element(root, "joint", name=name, type=kind)
    element(hinge, "parent", link=parent)
    element(hinge, "child", link=link.name)
    _place(hinge, link.p_m, link.R)
    if joint is None:
        return
    element(hinge, "axis", xyz=joint.axis)
    element(
        hinge, "limit", lower=joint.low_rad, upper=joint.high_rad,
        effort=joint.max_torque_nm, velocity=joint.max_speed_rad_s,
    )  # fmt: skip
    if joint.follows:
        element(hinge, "mimic", joint=joint.follows, multiplier="1", offset="0")


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
