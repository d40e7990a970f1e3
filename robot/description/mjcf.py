"""A description as MJCF, the format of MuJoCo: text, and the files that it references. Pure.

The text is a complete model, and can be attached to a world (``spec.attach``). Its only body in the
world is the rig's base. Lids collide with lids, other parts with everything but lids.
"""

import xml.etree.ElementTree as ET
from math import atan, degrees, isfinite, tan
from typing import NamedTuple

from gazerig.gaze.angles import compose, turn_about
from gazerig.robot.description.links import IDENTITY, CollisionShape, Description, Link
from gazerig.robot.description.mesh_files import mesh_files, numbers
from gazerig.robot.model.frames import quaternion

_LAYERS = {"body": "1", "lid": "2"}
_MATERIALS = {
    "skin": {"specular": "0.15", "shininess": "0.2"},
    "plastic": {"specular": "0.4", "shininess": "0.5"},
    "cloth": {"specular": "0", "shininess": "0"},
    "eye": {"specular": "0.9", "shininess": "0.95"},
    "dark": {"specular": "0", "shininess": "0"},
}
_LOOKS_GROUP, _COLLISIONS_GROUP = "2", "3"
"""Groups of geoms as in MuJoCo's own models: the viewer initially hides the second."""


class Mjcf(NamedTuple):
    """Text of a model, and the content of its files by name."""

    xml: str
    assets: dict[str, bytes]


def mjcf(
    description: Description,
    folder: str = "",
    *,
    looks: bool = True,
    awake: bool = False,
) -> Mjcf:
    """Return a description as MJCF.

    Args:
        description: description of the rig.
        folder: folder of the meshes and textures, relative to the text.
        looks: include visual shapes; without them, the same mechanism needs no files.
        awake: the lids are open at first; otherwise all joints are at 0.
    """
    if not looks:
        description = description.without_looks()
    root = ET.Element("mujoco", model=description.name)
    compiler = ET.SubElement(root, "compiler", angle="radian", autolimits="true")
    ET.SubElement(root, "option", timestep=numbers((_STEP_S,)), integrator="implicitfast")
    if folder:
        compiler.set("meshdir", folder)
        compiler.set("texturedir", folder)
    assets: dict[str, bytes] = {}
    _add_assets(ET.SubElement(root, "asset"), description, assets)
    bodies = {"": ET.SubElement(root, "worldbody")}
    for link in description.links:
        body = ET.SubElement(bodies[link.parent or ""], "body", name=link.name)
        bodies[link.name] = body
        _fill(body, link, awake)
        if link.name == description.camera.optical:
            # MuJoCo's camera looks along -z with y up; the optical frame looks along z with y down.
            camera = description.camera
            share = camera.height_px / camera.width_px
            field_y = 2.0 * atan(tan(0.5 * camera.horizontal_field_rad) * share)
            ET.SubElement(
                body, "camera", name="camera", fovy=numbers((degrees(field_y),)),
                xyaxes="1 0 0 0 -1 0", resolution=f"{camera.width_px} {camera.height_px}",
            )  # fmt: skip
    contacts = ET.SubElement(root, "contact")
    for one, other in description.may_touch:
        ET.SubElement(contacts, "exclude", body1=one, body2=other)
    _add_linkages(ET.SubElement(root, "equality"), description)
    _add_servos(root, description)
    ET.indent(root)
    return Mjcf(ET.tostring(root, encoding="unicode") + "\n", assets)


def _add_assets(parent: ET.Element, description: Description, assets: dict[str, bytes]) -> None:
    for visual in (one for link in description.links for one in link.visuals):
        name = visual.name
        files = mesh_files(name, visual.painted)
        assets |= {file: data for file, data in files.items() if not file.endswith(".mtl")}
        ET.SubElement(parent, "texture", name=name, type="2d", file=f"{name}.png")
        material = {"name": name, "texture": name} | _MATERIALS[visual.finish]
        ET.SubElement(parent, "material", material)
        # A surface with holes has no volume; the body specifies its mass.
        ET.SubElement(parent, "mesh", name=name, file=f"{name}.obj", inertia="shell")


def _fill(body: ET.Element, link: Link, awake: bool) -> None:
    """Write the contents of a body, its joint first."""
    at_rad, R = 0.0, link.R
    if awake and link.joint is not None and link.joint.awake_rad:
        at_rad = link.joint.awake_rad
        R = compose(R, turn_about(link.joint.axis, at_rad))
    _place(body, link.p_m, R)
    if link.inertia is not None:
        inertia = link.inertia
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = inertia.tensor_kg_m2
        ET.SubElement(
            body, "inertial", pos=numbers(inertia.com_m), mass=numbers((inertia.mass_kg,)),
            fullinertia=numbers((xx, yy, zz, xy, xz, yz)),
        )  # fmt: skip
    if link.joint is not None:
        joint = link.joint
        element = ET.SubElement(
            body, "joint", name=joint.name, type="hinge", axis=numbers(joint.axis),
            range=numbers((joint.low_rad, joint.high_rad)),
        )  # fmt: skip
        if joint.drive is not None:
            element.set("armature", numbers((joint.drive.armature_kg_m2,)))
            element.set("damping", numbers((joint.drive.damping_nm_s,)))
            element.set("frictionloss", numbers((joint.drive.friction_nm,)))
            # Stiff, so that a load below the friction does not creep.
            element.set("solreffriction", "0.002 1")
            element.set("solimpfriction", "0.9999 0.9999 0.001 0.5 2")
        if at_rad:
            element.set("ref", numbers((at_rad,)))
    for shape in link.collisions:
        _add_shape(body, shape)
    for visual in link.visuals:
        geom = ET.SubElement(
            body, "geom", name=visual.name, type="mesh", mesh=visual.name,
            material=visual.name, contype="0", conaffinity="0", group=_LOOKS_GROUP,
            mass="0",
        )  # fmt: skip
        _place(geom, visual.p_m, visual.R)


def _place(element: ET.Element, p_m: tuple[float, ...], R: object) -> None:
    if any(p_m):
        element.set("pos", numbers(p_m))
    if R != IDENTITY:
        element.set("quat", numbers(quaternion(R)))  # type: ignore[arg-type]


def _add_shape(body: ET.Element, shape: CollisionShape) -> None:
    layer = _LAYERS[shape.layer]
    used = {"sphere": 1, "capsule": 2}.get(shape.kind, 3)
    geom = ET.SubElement(
        body, "geom", type=shape.kind, size=numbers(shape.half_m[:used]), contype=layer,
        conaffinity=layer, group=_COLLISIONS_GROUP, rgba="0.8 0.4 0.2 0.4", mass="0",
    )  # fmt: skip
    _place(geom, shape.p_m, shape.R)


def _add_linkages(parent: ET.Element, description: Description) -> None:
    for joint in description.joints:
        if joint.follows is not None:
            # The largest stiffness that is stable with steps of 1 ms.
            ET.SubElement(
                parent, "joint", joint1=joint.name,
                joint2=joint.follows.joint, solref="0.002 1",
                polycoef=numbers((0.0, joint.follows.ratio, 0.0, 0.0, 0.0)),
            )  # fmt: skip


_STEP_S = 0.001
"""Time step, that of the servos' control loops; their gains are too high for larger ones."""
_LAG_S = 1e-4
"""Time constant of the torque of a servo with a limited change: much less than a time step."""
_TINY = 1e-6
"""Its motor constant and resistance: so small that they induce no voltage, as that of the real
motor would limit the change of the current, where the servo limits that of the duty."""


def _add_servos(root: ET.Element, description: Description) -> None:
    """Add a servo to each joint, or a motor if the data of its servo are unknown.

    The two gains of a servo act on a tendon that turns with its joint and limits the torque of
    both together; a servo with a limited change of torque is a dcmotor with both gains. The induced
    voltage brakes the joint in addition.
    """
    tendons, actuators = ET.SubElement(root, "tendon"), ET.SubElement(root, "actuator")
    speeds: list[dict[str, str]] = []
    brakes: list[dict[str, str]] = []
    for joint in description.joints:
        name, drive = joint.name, joint.drive
        if joint.follows is not None:
            continue
        if drive is None:
            torque = numbers((-joint.max_torque_nm, joint.max_torque_nm))
            ET.SubElement(actuators, "motor", name=name, joint=name, ctrlrange=torque)
            continue
        brakes.append({
            "name": f"{name}.back_emf", "joint": name, "gainprm": "0", "biastype": "affine",
            "biasprm": f"0 0 {numbers((-drive.back_emf_nm_s,))}",
        })  # fmt: skip
        speed = joint.max_speed_rad_s
        if isfinite(drive.slew_nm_s):
            # A dcmotor has one range for both of its goals.
            most = max(speed, -joint.low_rad, joint.high_rad)
            # In a time step MuJoCo changes the current by its rate times the time constant.
            rate = drive.slew_nm_s * _STEP_S / _LAG_S / _TINY
            gains = (drive.kp_nm_rad, 0.0, drive.kv_nm_s, 0.0, 0.0, drive.force_nm)
            ET.SubElement(
                actuators, "dcmotor", name=name, joint=name, input="pos vel",
                ctrlrange=numbers((-most, most)),
                motorconst=numbers((_TINY, _TINY)), resistance=numbers((_TINY,)),
                inductance=numbers((0.0, _LAG_S)), saturation=numbers((0.0, 0.0, rate)),
                controller=numbers(gains),
            )  # fmt: skip
            continue
        force = numbers((-drive.force_nm, drive.force_nm))
        shaft = ET.SubElement(tendons, "fixed", name=name, actuatorfrcrange=force)
        ET.SubElement(shaft, "joint", joint=name, coef="1")
        ET.SubElement(
            actuators, "position", name=name, tendon=name, kp=numbers((drive.kp_nm_rad,)),
            ctrlrange=numbers((joint.low_rad, joint.high_rad)),
        )  # fmt: skip
        kv = numbers((drive.kv_nm_s,))
        speeds.append({
            "name": f"{name}.speed", "tendon": name, "gainprm": kv, "biastype": "affine",
            "biasprm": f"0 0 -{kv}", "ctrlrange": numbers((-speed, speed)),
            "dyntype": "filterexact", "dynprm": numbers((drive.smoothing_s,)), "actearly": "true",
        })  # fmt: skip
    for one in (*speeds, *brakes):
        ET.SubElement(actuators, "general", one)
