"""A description as MJCF, the format of MuJoCo: text, and the files that it references. Pure.

The text is a complete model, and can be attached to a world (``spec.attach``). Its only body in the
world is the rig's base. Its parts collide with the world, not with each other.
"""

import xml.etree.ElementTree as ET
from math import atan, degrees, tan
from typing import NamedTuple

from gazerig.gaze.angles import compose, turn_about
from gazerig.robot.description.links import OPTICAL_FRAME, ROUGHNESS, Description, Link
from gazerig.robot.description.mesh_files import element, mesh_files
from gazerig.robot.model.frames import quaternion

_LOOKS_GROUP, _COLLISIONS_GROUP = "2", "3"
"""Groups of geoms as in MuJoCo's own models: the viewer initially hides the second."""
_STEP_S = 0.001
"""Time step, that of the servos' control loops; their gains are too high for larger ones."""


class Mjcf(NamedTuple):
    """Text of a model, and the content of its files by name."""

    xml: str
    assets: dict[str, bytes]


def mjcf(
    description: Description,
    folder: str = "",
    *,
    looks: bool = True,
) -> Mjcf:
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
            name, gloss = visual.name, 1.0 - ROUGHNESS[visual.finish]
            own = mesh_files(visual)
            files |= {file: data for file, data in own.items() if not file.endswith(".mtl")}
            element(assets, "texture", name=name, type="2d", file=f"{name}.png")
            element(assets, "material", name=name, texture=name, specular=gloss, shininess=gloss)
            # A surface with holes has no volume; the body specifies its mass.
            element(assets, "mesh", name=name, file=f"{name}.obj", inertia="shell")
            element(
                body, "geom", name=name, type="mesh", mesh=name, material=name, contype="0",
                conaffinity="0", group=_LOOKS_GROUP, mass="0", pos=visual.p_m, quat=quaternion(visual.R),
            )  # fmt: skip
    # MuJoCo's camera looks along -z with y up; the optical frame looks along z with y down.
    camera = description.camera
    field_y = 2.0 * atan(
        tan(0.5 * camera.horizontal_field_rad) * camera.height_px / camera.width_px
    )
    element(
        bodies[OPTICAL_FRAME], "camera", name="camera", fovy=degrees(field_y),
        xyaxes="1 0 0 0 -1 0", resolution=(camera.width_px, camera.height_px),
    )  # fmt: skip
    _add_servos(root, description)
    ET.indent(root)
    return Mjcf(ET.tostring(root, encoding="unicode") + "\n", files)


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
