"""The description of a rig: a tree of links from the dimensions and joints in its YAML. Pure.

The neck turns yaw, pitch, roll about axes through one point.
The head carries eyes that pan and tilt about their centres, lids that turn about an axis through
both eyes' centres, and any other joints of the rig. Angles are those of the rig's joints,
with their signs (robot/model/kinematics.py).
"""

import re
from collections.abc import Mapping
from math import radians
from typing import NamedTuple

from gazerig.gaze.angles import add, rotation, scale, sub
from gazerig.gaze.types import Vec3
from gazerig.robot.description import mass
from gazerig.robot.description.links import (
    CAMERA,
    OPTICAL_FRAME,
    ORIGIN,
    Description,
    Ellipsoid,
    Link,
    LinkJoint,
    Visual,
)
from gazerig.robot.description.parts import (
    CHIN,
    FACE_PARTS,
    FLOOR_M,
    LOWER_REST,
    SIDES,
    UPPER_REST,
    HeadMeasures,
    ear_look,
    face_look,
    hinge,
    lid_look,
    meeting_rad,
    tube,
)
from gazerig.robot.model.frames import OPTICAL, CameraParams
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.kinematics import LIDS, NECK, GeometryParams, LidEnds
from gazerig.robot.model.types import further_joints
from gazerig.robot.model.weight import MassParams

BASE, HEAD = "base_link", mass.HEAD

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
    rest_kg = sum(one.mass_kg for one in mass.carried_links(links[at + 1 :]))
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
                Link(link, parent, place, joint=joint, inertia=mass.servo(), visuals=looks)
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
        inertia = mass.head_inertia(self._rig.mass, measures, mass.carried_links(carried))
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
                Link(name, parent, place, joint=joint, inertia=mass.shell("gimbal", radius))
            )
            parent, place = name, ORIGIN
        name = f"{side}_eye"
        look = Visual(name, "eye", "eye", scale=radius)
        self._links.append(Link(name, parent, place, inertia=mass.shell_of(look), visuals=(look,)))

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
            inertia = mass.servo(0.3)
            self._links.append(Link(link_name(name), HEAD, place, joint=joint, inertia=inertia))

    def _add_shell(self, joint: LinkJoint, p_m: Vec3, look: Visual) -> None:
        """Add a thin part of the head that a joint moves."""
        inertia = mass.shell_of(look)
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
