"""A description as URDF, which ROS, Foxglove and most simulators read: text and its meshes. Pure.

URDF has no ellipsoids and capsules. An ellipsoid is a scaled sphere of radius 1, a capsule a
cylinder with a sphere at each end. Meshes are in the same folder with relative paths, so no package
is needed.
"""

import xml.etree.ElementTree as ET
from collections.abc import Collection, Iterator
from typing import NamedTuple

from gazerig.gaze.angles import add, rotate
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.description.links import IDENTITY, ORIGIN, CollisionShape, Description, Link
from gazerig.robot.description.mesh import ellipsoid
from gazerig.robot.description.mesh_files import mesh_files, numbers, plain_obj, roll_pitch_yaw

_BALL = "ball_of_radius_1.obj"


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
    extension = ET.SubElement(root, "mujoco")
    ET.SubElement(
        extension, "compiler", meshdir=folder, discardvisual="false", fusestatic="false",
        strippath="true",
    )  # fmt: skip
    assets: dict[str, bytes] = {}
    for link in description.links if looks else description.without_looks().links:
        element = ET.SubElement(root, "link", name=link.name)
        if link.inertia is not None:
            inertial = ET.SubElement(element, "inertial")
            _place(inertial, link.inertia.com_m, IDENTITY)
            ET.SubElement(inertial, "mass", value=numbers((link.inertia.mass_kg,)))
            (xx, xy, xz), (_, yy, yz), (_, _, zz) = link.inertia.tensor_kg_m2
            moments = {"ixx": xx, "ixy": xy, "ixz": xz, "iyy": yy, "iyz": yz, "izz": zz}
            ET.SubElement(inertial, "inertia", {key: numbers((m,)) for key, m in moments.items()})
        for visual in link.visuals:
            part = ET.SubElement(element, "visual", name=visual.name)
            _place(part, visual.p_m, visual.R)
            geometry = ET.SubElement(part, "geometry")
            ET.SubElement(geometry, "mesh", filename=f"{folder}/{visual.name}.obj")
            assets |= mesh_files(visual.name, visual.painted)
        for shape in link.collisions:
            for kind, sizes, p_m in _pieces(shape):
                part = ET.SubElement(element, "collision")
                _place(part, p_m, shape.R)
                geometry = ET.SubElement(part, "geometry")
                if kind == "mesh":
                    sizes["filename"] = f"{folder}/{_BALL}"
                    assets[_BALL] = plain_obj("ball", ellipsoid((1.0, 1.0, 1.0), rings=11))
                ET.SubElement(geometry, kind, sizes)
        if link.parent is not None:
            _add_joint(root, link, link.parent, {joint.name for joint in description.joints})
    ET.indent(root)
    text = ET.tostring(root, encoding="unicode")
    return Urdf(f'<?xml version="1.0"?>\n{text}\n', assets)


def _place(element: ET.Element, p_m: Vec3, R: Mat3) -> None:
    if p_m != ORIGIN or R != IDENTITY:
        ET.SubElement(element, "origin", xyz=numbers(p_m), rpy=numbers(roll_pitch_yaw(R)))


def _pieces(shape: CollisionShape) -> Iterator[tuple[str, dict[str, str], Vec3]]:
    """Yield the elements of URDF that form a shape: name, sizes and position."""
    a, b, _ = shape.half_m
    if shape.kind == "box":
        yield "box", {"size": numbers(2.0 * half for half in shape.half_m)}, shape.p_m
    elif shape.kind == "sphere":
        yield "sphere", {"radius": numbers((a,))}, shape.p_m
    elif shape.kind == "ellipsoid":
        yield "mesh", {"scale": numbers(shape.half_m)}, shape.p_m
    else:
        yield "cylinder", {"radius": numbers((a,)), "length": numbers((2.0 * b,))}, shape.p_m
        for end in (-b, b):
            place = add(shape.p_m, rotate(shape.R, (0.0, 0.0, end)))
            yield "sphere", {"radius": numbers((a,))}, place


def _add_joint(root: ET.Element, link: Link, parent: str, taken: Collection[str]) -> None:
    joint = link.joint
    name, kind = (f"{link.name}_fixed", "fixed") if joint is None else (joint.name, "revolute")
    while joint is None and name in taken:
        name += "_"
    element = ET.SubElement(root, "joint", name=name, type=kind)
    ET.SubElement(element, "parent", link=parent)
    ET.SubElement(element, "child", link=link.name)
    _place(element, link.p_m, link.R)
    if joint is not None:
        ET.SubElement(element, "axis", xyz=numbers(joint.axis))
        ET.SubElement(
            element, "limit", lower=numbers((joint.low_rad,)), upper=numbers((joint.high_rad,)),
            effort=numbers((joint.max_torque_nm,)), velocity=numbers((joint.max_speed_rad_s,)),
        )  # fmt: skip
        if joint.drive is not None:
            ET.SubElement(
                element, "dynamics", damping=numbers((joint.drive.damping_nm_s,)),
                friction=numbers((joint.drive.friction_nm,)),
            )  # fmt: skip
        if joint.follows is not None:
            leader, ratio = joint.follows
            ET.SubElement(element, "mimic", joint=leader, multiplier=numbers((ratio,)), offset="0")
