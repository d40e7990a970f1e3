"""A description as URDF, which ROS, Foxglove and most simulators read: text and its meshes. Pure.

URDF has no ellipsoids: they are scaled meshes of a ball. Meshes are in the same folder with
relative paths, so no package is needed.
"""

import xml.etree.ElementTree as ET
from collections.abc import Collection
from math import atan2, cos, hypot, sin
from typing import NamedTuple

from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.description.links import Description, Link, Visual
from gazerig.robot.description.mesh_files import element, mesh_files

_BALL = Visual("ball_of_radius_1", "ball")


class Urdf(NamedTuple):
    """Text of a description, and the content of its files by name."""

    xml: str
    assets: dict[str, bytes]


def urdf(description: Description, folder: str = "meshes", *, looks: bool = True) -> Urdf:
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
        for shape in link.collisions:
            part = element(body, "collision")
            element(part, "origin", xyz=shape.p_m)
            ball = f"{folder}/{_BALL.name}.obj"
            element(element(part, "geometry"), "mesh", filename=ball, scale=shape.half_m)
            assets |= mesh_files(_BALL)
        if link.parent is not None:
            _add_joint(root, link, link.parent, {joint.name for joint in description.joints})
    ET.indent(root)
    text = ET.tostring(root, encoding="unicode")
    return Urdf(f'<?xml version="1.0"?>\n{text}\n', assets)


def _place(parent: ET.Element, p_m: Vec3, R: Mat3) -> None:
    """Add a pose; its angles turn about fixed x, y and z axes, in this order."""
    (a, b, c), (d, e, f), (g, _, _) = R
    yaw, pitch = atan2(d, a), atan2(-g, hypot(a, d))
    # From the rotation without yaw, so that it is also valid if pitch is a right angle.
    s, k = sin(yaw), cos(yaw)
    element(parent, "origin", xyz=p_m, rpy=(atan2(s * c - k * f, k * e - s * b), pitch, yaw))


def _add_joint(root: ET.Element, link: Link, parent: str, taken: Collection[str]) -> None:
    joint = link.joint
    name, kind = (f"{link.name}_fixed", "fixed") if joint is None else (joint.name, "revolute")
    while joint is None and name in taken:
        name += "_"
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
