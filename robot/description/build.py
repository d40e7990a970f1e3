"""The description of a rig: a tree of links from the dimensions and joints in its YAML. Pure.

The neck turns yaw, pitch, roll about axes through one point.
The head carries eyes that pan and tilt about their centres, lids that turn about an axis through
both eyes' centres, and any other joints of the rig. Angles are those of the rig's joints,
with their signs (robot/model/kinematics.py). Masses and inertias follow from shapes and materials;
lengths in metres, tensors about the centre of mass.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from math import radians
from typing import NamedTuple

import numpy as np

from gazerig.gaze.angles import add, rotation, scale, sub
from gazerig.gaze.types import Floats, Vec3
from gazerig.robot.description.links import (
    CAMERA,
    CHIN,
    FACE_PARTS,
    FLOOR_M,
    LOWER_REST,
    MIDDLE,
    OPTICAL_FRAME,
    ORIGIN,
    SIDES,
    UPPER_REST,
    Description,
    Ellipsoid,
    HeadMeasures,
    Inertia,
    Link,
    LinkJoint,
    Visual,
    ear_look,
    face_look,
    hinge,
    lid_look,
    meeting_rad,
    tube,
)
from gazerig.robot.description.mesh import stored_shell
from gazerig.robot.model.frames import OPTICAL, CameraParams
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.kinematics import LIDS, NECK, GeometryParams, LidEnds
from gazerig.robot.model.types import further_joints
from gazerig.robot.model.weight import MassParams

HEAD_KG, _REFERENCE_M = 0.6, 0.0619
"""Mass of a whole head (skull, servos, eyes, lids) with this distance between the eyes."""
SERVO_KG = 0.023
"""Servo of the size of an XC330 or of models smaller than the STS3215."""
_SERVO_HALF_M: Vec3 = (0.010, 0.013, 0.017)

HEAD = "head"
_CONTENT_HALF: Vec3 = (1.5, 1.1, 0.6)
"""Half axes of a head's contents (servos, frame, counterweight), in distances between the eyes."""


def head_inertia(params: MassParams, measures: HeadMeasures, carried: Sequence[Inertia]) -> Inertia:
    """Return the inertia of the head without the links that it carries, in the head's frame.

    Args:
        params: mass parameters of the rig; the mass of its head includes all carried links.
        measures: dimensions of the head.
        carried: eyes, lids and all other carried links, in the head's frame.
    """
    rest, unit = join_inertias(carried), measures.interocular_m
    whole = params.head.mass_kg
    if whole is None:
        # The shell grows with its surface, the mechanism does not.
        made = HEAD_KG * (0.5 + 0.5 * (unit / _REFERENCE_M) ** 2)
        whole = max(made, 2.0 * rest.mass_kg)
    kg, com = whole - rest.mass_kg, None
    if params.head.com_mm is not None:
        com = _from_pivot(params.head.com_mm, measures)
        com = add(com, scale(sub(com, rest.com_m), rest.mass_kg / kg))
    own = filled(shell("skull", unit), kg, unit, measures.scaled(MIDDLE), com)
    weights = [
        Inertia(one.mass_kg, _from_pivot(one.position_mm, measures), np.zeros((3, 3)))
        for one in params.counterweights.values()
    ]
    return join_inertias((own, *weights))


def carried_links(links: Iterable[Link]) -> list[Inertia]:
    """Return the inertias of links that the head carries, in its frame, all joints at 0."""
    at: dict[str | None, Vec3] = {HEAD: ORIGIN}
    found = []
    for link in links:
        p = at[link.name] = add(at.get(link.parent, ORIGIN), link.p_m)
        if link.inertia is not None:
            found.append(link.inertia._replace(com_m=add(p, link.inertia.com_m)))
    return found


def _from_pivot(position_mm: Vec3, measures: HeadMeasures) -> Vec3:
    return add(scale(position_mm, 1e-3), measures.pivot_m)


def servo(times: float = 1.0) -> Inertia:
    """Return a servo with its bracket, as a box at the centre of its link."""
    mass = times * (SERVO_KG + 0.012)
    x, y, z = (half * half / 3.0 for half in _SERVO_HALF_M)
    return Inertia(mass, (0.0, 0.0, 0.0), np.diag((mass * (y + z), mass * (x + z), mass * (x + y))))


def shell(name: str, unit_m: float) -> Inertia:
    """Return a thin shell of constant thickness in the frame of its shape.

    Args:
        name: name of the shell.
        unit_m: the distance between the eyes, or the radius of a lid or an ear.
    """
    mass, x, y, z, xx, yy, zz, xy, xz, yz = stored_shell(name)
    tensor = np.array(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))) * unit_m**4
    return Inertia(mass * unit_m**2, scale((x, y, z), unit_m), tensor)


def shell_of(look: Visual) -> Inertia:
    """Return the mass of a thin part in the frame of its link."""
    factors = np.broadcast_to(look.scale, 3)
    R = np.array(look.R) * np.sign(factors)
    return in_parent_frame(shell(str(look.shape), abs(float(factors[0]))), R, look.p_m)


def filled(
    shell: Inertia, mass_kg: float, unit_m: float, middle_m: Vec3, com_m: Vec3 | None = None
) -> Inertia:
    """Return a shell with its contents: a homogeneous ellipsoid of servos, frame and ballast.

    Args:
        shell: the skull.
        mass_kg: total mass.
        unit_m: distance between the eyes, which scales the contents.
        middle_m: centre of the contents.
        com_m: total centre of mass, which determines the contents' position; None: middle_m does.
    """
    rest = mass_kg - shell.mass_kg
    if rest <= 0.05 * mass_kg:  # a very large head has a thinner shell
        tensor = shell.tensor_kg_m2 * (mass_kg / shell.mass_kg)
        return Inertia(mass_kg, shell.com_m if com_m is None else com_m, tensor)
    middle = middle_m
    if com_m is not None:
        moment = mass_kg * np.array(com_m) - shell.mass_kg * np.array(shell.com_m)
        middle = _vector(moment / rest)
    x, y, z = ((half * unit_m) ** 2 / 5.0 for half in _CONTENT_HALF)
    tensor = np.diag((rest * (y + z), rest * (x + z), rest * (x + y)))
    return join_inertias((shell, Inertia(rest, middle, tensor)))


def join_inertias(parts: Iterable[Inertia]) -> Inertia:
    """Join several bodies in the same frame to one."""
    bodies = tuple(parts)
    mass = sum(body.mass_kg for body in bodies)
    com = sum((body.mass_kg * np.array(body.com_m) for body in bodies), np.zeros(3)) / mass
    tensor = np.zeros((3, 3))
    for body in bodies:
        off = np.array(body.com_m) - com  # the parallel-axis theorem
        tensor += body.tensor_kg_m2 + body.mass_kg * ((off @ off) * np.eye(3) - np.outer(off, off))
    return Inertia(mass, _vector(com), tensor)


def in_parent_frame(one: Inertia, R: Floats, p_m: Vec3) -> Inertia:
    """Return the inertia of a body in a parent frame, in which the body's frame has this pose."""
    com = R @ one.com_m + p_m
    return Inertia(one.mass_kg, _vector(com), R @ one.tensor_kg_m2 @ R.T)


def _vector(values: Floats) -> Vec3:
    x, y, z = np.asarray(values, float).tolist()
    return x, y, z


BASE = "base_link"

_AXES: dict[str, Vec3] = {
    "yaw": (0.0, 0.0, 1.0), "pan": (0.0, 0.0, 1.0), "pitch": (0.0, -1.0, 0.0),
    "tilt": (0.0, -1.0, 0.0), "roll": (1.0, 0.0, 0.0),
}  # fmt: skip
_EYE: Vec3 = (0.0, 0.5, 0.0)
_THROAT: Vec3 = (-0.72, 0.0, -0.90)
"""Upper end of a neck without joints, in distances between the eyes."""
_BUST, _BELOW_CHIN = 1.45, 0.25
"""Width of the shoulders, and their distance from the chin, in distances between the eyes."""
_LEAST_M = 0.01
"""Smallest height of the shoulders."""


class RigShape(NamedTuple):
    """Values of a rig's YAML from which a description is built.

    lids: angles of the lid joints shut and open
    """

    name: str
    geometry: GeometryParams
    joints: Mapping[str, JointParams]
    lids: Mapping[str, LidEnds]
    camera: CameraParams
    mass: MassParams = MassParams()


def describe(rig: RigShape) -> Description:
    """Return the description of a rig."""
    return _Builder(rig).description()


def head_mass_fault(rig: RigShape) -> str:
    """Return why the mass of a head is impossible, "" if it is not."""
    given_kg = rig.mass.head.mass_kg
    links = describe(rig._replace(mass=MassParams())).links
    at = [link.name for link in links].index(HEAD)
    rest_kg = sum(one.mass_kg for one in carried_links(links[at + 1 :]))
    if given_kg is None or given_kg > 1.01 * rest_kg:
        return ""
    return (
        f"the head weighs {given_kg:g} kg with all it carries, and eyes, lids and other parts of "
        f"it weigh {rest_kg:.3g} kg already"
    )


def _measures(geometry: GeometryParams) -> HeadMeasures:
    pivot_m = (-geometry.eyes_ahead_mm / 1e3, 0.0, -geometry.eyes_above_mm / 1e3)
    return HeadMeasures(geometry.interocular_mm / 1e3, pivot_m)


class _Builder:
    def __init__(self, rig: RigShape) -> None:
        self._rig = rig
        geometry = rig.geometry
        self._eyes_m: Vec3 = (geometry.eyes_ahead_mm / 1e3, 0.0, geometry.eyes_above_mm / 1e3)
        self._measures = _measures(geometry)
        self._links: list[Link] = []

    def description(self) -> Description:
        rig = self._rig
        neck, place = self._add_neck()
        first = len(self._links)
        for side in SIDES:
            self._add_eye(side)
        for name in LIDS:
            if name in rig.joints and name in rig.lids:
                self._add_lid(name)
        for name in further_joints(rig.joints):
            self._add_face_part(name)
        self._links.insert(first, self._head(neck, place, self._links[first:]))
        camera = rig.camera
        angles = radians(camera.yaw_deg), radians(camera.pitch_deg), radians(camera.roll_deg)
        housing = Link(
            CAMERA,
            HEAD if camera.mount == "head" else BASE,
            scale(camera.position_mm, 1e-3),
            rotation(angles),
            visuals=(Visual(CAMERA, "camera"),),
        )
        self._links += [housing, Link(OPTICAL_FRAME, CAMERA, R=OPTICAL)]
        # A name that files and programs accept.
        name = re.sub(r"[^A-Za-z0-9_-]+", "_", rig.name).strip("_") or "rig"
        return Description(name, tuple(self._links))

    def _joint(self, name: str, axis: Vec3, follows: str = "") -> LinkJoint:
        params = self._rig.joints[follows or name]
        limit, turns = params.limit(), params.shaft_turns()
        most_nm = params.model_facts.stall_torque_nm * (params.torque_limit or 1.0) * turns
        return LinkJoint(
            name, axis, limit.low_rad, limit.high_rad, limit.speed_rad_s, most_nm, follows
        )

    def _add_neck(self) -> tuple[str, Vec3]:
        """Add base and neck; return the link that carries the head, and the head's place in it."""
        geometry, joints = self._rig.geometry, self._rig.joints
        pivot = geometry.pitch_axis_height_mm / 1e3
        chain = [(name, pivot) for name in NECK if name in joints]
        head_m = add((0.0, 0.0, pivot), self._eyes_m)
        self._add_base(head_m, chain[0][1] if chain else None)
        parent, at = BASE, 0.0
        heights = [height for _, height in chain[1:]] + [pivot]
        for (name, height), following in zip(chain, heights, strict=False):
            link, length = link_name(name), following - height
            looks = (tube(link, self._measures, length, ORIGIN),) if length >= 1e-3 else ()
            joint = self._joint(name, _AXES[name.rpartition("_")[2]])
            place = (0.0, 0.0, height - at)
            self._links.append(
                Link(link, parent, place, joint=joint, inertia=servo(), visuals=looks)
            )
            parent, at = link, height
        return parent, add((0.0, 0.0, pivot - at), self._eyes_m)

    def _add_base(self, head_m: Vec3, axis_m: float | None) -> None:
        """Add the fixed parts: shoulders, and a neck up to the first axis.

        Args:
            head_m: the point between the eyes with all joints at 0.
            axis_m: height of the first axis; None: the neck has no joints.
        """
        unit = self._measures.interocular_m
        # At the neck base or a little below the chin.
        top = min(0.0, head_m[2] + (CHIN - _BELOW_CHIN) * unit)
        tall = max(_LEAST_M, top - FLOOR_M)
        x, y, end = add(head_m, self._measures.scaled(_THROAT))
        if axis_m is not None:
            x, y, end = 0.0, 0.0, axis_m
        bust = _BUST * unit
        looks = [Visual("bust", "bust", "cloth", (x, y, top), scale=(bust, bust, tall))]
        if end > top + 1e-3:
            looks.append(tube("column", self._measures, end - top, (x, y, top)))
        body = Ellipsoid((x, y, top - 0.5 * tall), (1.2 * unit, 2.3 * unit, 0.5 * tall))
        self._links.append(Link(BASE, None, visuals=tuple(looks), collisions=(body,)))

    def _head(self, neck: str, p_m: Vec3, carried: list[Link]) -> Link:
        measures, joints, lids = self._measures, self._rig.joints, self._rig.lids
        unit = measures.interocular_m
        looks = [Visual("skin", "skin", "skin", scale=unit), Visual("cap", "cap", scale=unit)]
        if "jaw" in joints:
            looks.append(Visual("mouth", "mouth", "dark", scale=unit))
        looks += [face_look(part, measures) for part in FACE_PARTS if part not in joints]
        looks += [ear_look(side, measures) for side in SIDES]
        for side in SIDES:
            if f"{side}_upper_lid" in lids and f"{side}_lower_lid" not in lids:
                still = lid_look(f"{side}_still_lid", measures, False, self._lid_meeting_rad(side))
                looks.append(still._replace(p_m=measures.scaled(_EYE, side)))
        inertia = head_inertia(self._rig.mass, measures, carried_links(carried))
        bodies = measures.bodies()
        return Link(HEAD, neck, p_m, inertia=inertia, visuals=tuple(looks), collisions=bodies)

    def _add_eye(self, side: str) -> None:
        """Add an eyeball with iris and pupil, whose gaze is along its x axis, and its gimbal."""
        joints, radius = self._rig.joints, self._measures.eye_radius_m
        parent, place = HEAD, self._measures.scaled(_EYE, side)
        for turn in ("pan", "tilt"):
            own, both = f"{side}_eye_{turn}", f"eyes_{turn}"
            if own not in joints and both not in joints:
                continue
            name, follows = own if own in joints else both, ""
            if any(link.joint and link.joint.name == name for link in self._links):
                name, follows = f"{side}_eyes_{turn}", both
            joint = self._joint(name, _AXES[turn], follows)
            name = link_name(joint.name)
            self._links.append(
                Link(name, parent, place, joint=joint, inertia=shell("gimbal", radius))
            )
            parent, place = name, ORIGIN
        name = f"{side}_eye"
        look = Visual(name, "eye", "eye", scale=radius)
        self._links.append(Link(name, parent, place, inertia=shell_of(look), visuals=(look,)))

    def _add_lid(self, name: str) -> None:
        """Add a lid whose edge meets the other lid's at the rig's shut angle."""
        side, which, _ = name.split("_")
        shut, wide = self._rig.lids[name]
        upper = which == "upper"
        up = 1.0 if upper == (wide > shut) else -1.0
        rest = UPPER_REST if upper else LOWER_REST
        joint = self._joint(name, (0.0, -up, 0.0))._replace(awake_rad=shut + rest * (wide - shut))
        # Elevation of the edge above the eye's equator with the joint at 0.
        edge = self._lid_meeting_rad(side) - up * shut
        look = lid_look(link_name(name), self._measures, upper, edge)
        self._add_shell(joint, self._measures.scaled(_EYE, side), look)

    def _add_face_part(self, name: str) -> None:
        place, axis = hinge(name, self._measures)
        joint = self._joint(name, axis)
        if name in FACE_PARTS:
            look = face_look(name, self._measures)
            self._add_shell(joint, place, look._replace(p_m=sub(look.p_m, place)))
        else:
            inertia = servo(0.3)
            self._links.append(Link(link_name(name), HEAD, place, joint=joint, inertia=inertia))

    def _add_shell(self, joint: LinkJoint, p_m: Vec3, look: Visual) -> None:
        """Add a thin part of the head that a joint moves."""
        inertia = shell_of(look)
        name = link_name(joint.name)
        self._links.append(Link(name, HEAD, p_m, joint=joint, inertia=inertia, visuals=(look,)))

    def _lid_meeting_rad(self, side: str) -> float:
        ends = (self._rig.lids.get(f"{side}_{one}_lid", (0.0, 0.0)) for one in ("upper", "lower"))
        return meeting_rad(*(abs(wide - shut) for shut, wide in ends))


def link_name(joint: str) -> str:
    """Return the name of the link that a joint moves."""
    name = f"{joint}_link"
    # The name of a joint may be base or camera.
    return f"{name}_" if name in (BASE, CAMERA) else name
