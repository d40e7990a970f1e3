"""Links, joints, inertias and shapes of a rig's description. Values only.

SI units. A link's frame is that of its joint, which turns it about an axis through its origin.
World: origin at the neck base, x forward, y left, z up. All link frames except those of the camera
are parallel to it while every joint is at 0.
"""

from collections.abc import Mapping, Sequence
from math import inf
from typing import Literal, NamedTuple

from gazerig.gaze.angles import add, compose, rotate, turn_about
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.description.mesh import Painted

IDENTITY: Mat3 = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
ORIGIN: Vec3 = (0.0, 0.0, 0.0)

Pose = tuple[Mat3, Vec3]
"""R_parent_child and p_parent_child_m."""
Finish = Literal["skin", "plastic", "cloth", "eye", "dark"]
"""Material of a surface; each viewer approximates it."""
Layer = Literal["body", "lid"]
ShapeKind = Literal["sphere", "ellipsoid", "capsule", "box"]


class Inertia(NamedTuple):
    """Mass of a link, its centre in the link's frame, and the tensor about that centre."""

    mass_kg: float
    com_m: Vec3
    tensor_kg_m2: Mat3


class CollisionShape(NamedTuple):
    """A simple body that represents a link in collisions.

    half_m: half axes of an ellipsoid or a box; radius of a sphere first; a capsule's radius and
        half the length of its line, along its z axis
    layer: lids collide only with lids, bodies with everything else
    """

    kind: ShapeKind
    half_m: Vec3
    p_m: Vec3 = ORIGIN
    R: Mat3 = IDENTITY
    layer: Layer = "body"


class Visual(NamedTuple):
    """Painted mesh of a link; the name is unique in the description."""

    name: str
    painted: Painted
    finish: Finish = "plastic"
    p_m: Vec3 = ORIGIN
    R: Mat3 = IDENTITY


class LinkageFollower(NamedTuple):
    """Joint that a linkage moves with another joint: its angle is ``ratio`` times the other's."""

    joint: str
    ratio: float = 1.0


class ServoDrive(NamedTuple):
    """Servo as it acts at its joint, all values per rad of the joint.

    armature_kg_m2: inertia of its rotor at the output of the gear
    friction_nm, damping_nm_s: dry and viscous friction of motor and gear
    kp_nm_rad, kv_nm_s: gains of its controller on the errors of position and speed
    force_nm: largest torque of its controller, at standstill
    back_emf_nm_s: loss of torque due to the motor's induced voltage, per rad/s; none while it is
        switched off
    smoothing_s: time constant with which its controller adopts the speed of a goal
    slew_nm_s: largest change of its controller's torque per second; inf: not limited
    """

    armature_kg_m2: float
    friction_nm: float
    damping_nm_s: float
    kp_nm_rad: float
    kv_nm_s: float
    force_nm: float
    back_emf_nm_s: float
    smoothing_s: float
    slew_nm_s: float = inf


class LinkJoint(NamedTuple):
    """The hinge between a link and its parent.

    name: name in the rig, or a separate one if it follows another joint
    axis: unit vector in the link's frame; positive angles turn about it by the right-hand rule
    max_torque_nm: largest torque of the servo at the joint
    awake_rad: its angle while the head is awake and looks straight ahead
    drive: its servos; None if they are unknown or not part of the description
    """

    name: str
    axis: Vec3
    low_rad: float
    high_rad: float
    max_speed_rad_s: float
    max_torque_nm: float
    follows: LinkageFollower | None = None
    awake_rad: float = 0.0
    drive: ServoDrive | None = None


class Link(NamedTuple):
    """Rigid part: its pose in its parent with the joint at 0, its inertia and shapes."""

    name: str
    parent: str | None
    p_m: Vec3 = ORIGIN
    R: Mat3 = IDENTITY
    joint: LinkJoint | None = None
    inertia: Inertia | None = None
    visuals: tuple[Visual, ...] = ()
    collisions: tuple[CollisionShape, ...] = ()


class CameraFrame(NamedTuple):
    """Camera: its links and its field of view.

    link: x forward, y left, z up; optical: x right, y down, z forward (as in ROS)
    """

    link: str
    optical: str
    horizontal_field_rad: float
    width_px: int
    height_px: int


class Description(NamedTuple):
    """A rig as a tree of links, parents first.

    may_touch: pairs of links whose shapes overlap by construction
    """

    name: str
    links: tuple[Link, ...]
    camera: CameraFrame
    may_touch: tuple[tuple[str, str], ...] = ()

    @property
    def joints(self) -> tuple[LinkJoint, ...]:
        """Return all joints, also those that follow others."""
        return tuple(link.joint for link in self.links if link.joint is not None)

    def link(self, name: str) -> Link:
        """Return a link by its name.

        Raises:
            KeyError: no link has that name.
        """
        for link in self.links:
            if link.name == name:
                return link
        raise KeyError(name)

    def without_looks(self) -> "Description":
        """Return the same mechanism without visual shapes."""
        return self._replace(links=tuple(link._replace(visuals=()) for link in self.links))

    def with_drives(self, drives: Mapping[str, ServoDrive]) -> "Description":
        """Return the description with the servos at its joints, by the joints' names."""
        links = []
        for link in self.links:
            if link.joint is not None and link.joint.name in drives:
                link = link._replace(joint=link.joint._replace(drive=drives[link.joint.name]))
            links.append(link)
        return self._replace(links=tuple(links))

    def angles(self, names: Sequence[str], position_rad: Sequence[float]) -> dict[str, float]:
        """Return the angle of every joint, those that follow others included.

        Args:
            names: names of joints of the rig.
            position_rad: their angles; the other joints are at 0.
        """
        known = dict(zip(names, position_rad, strict=True))
        found = {}
        for joint in self.joints:
            if joint.follows is None:
                found[joint.name] = known.get(joint.name, 0.0)
            else:
                found[joint.name] = joint.follows.ratio * known.get(joint.follows.joint, 0.0)
        return found

    def poses(self, angles_rad: Mapping[str, float]) -> dict[str, Pose]:
        """Return R_world_link and p_world_link_m of every link.

        Args:
            angles_rad: angles of all joints, as returned by ``angles``.
        """
        found: dict[str, Pose] = {}
        for link in self.links:
            R, p = (IDENTITY, ORIGIN) if link.parent is None else found[link.parent]
            p = add(p, rotate(R, link.p_m))
            R = compose(R, link.R)
            if link.joint is not None:
                R = compose(R, turn_about(link.joint.axis, angles_rad[link.joint.name]))
            found[link.name] = R, p
        return found
