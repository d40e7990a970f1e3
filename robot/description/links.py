"""Links, joints, inertias and shapes of a rig's description. Values only.

SI units. A link's frame is that of its joint, which turns it about an axis through its origin.
World: origin at the neck base, x forward, y left, z up. All link frames except those of the camera
are parallel to it while every joint is at 0.
"""

from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple

from gazerig.gaze.angles import add, compose, rotate, turn_about
from gazerig.gaze.types import Floats, Mat3, Vec3
from gazerig.robot.description.mesh import Painted, move_mesh, stored_shape

IDENTITY: Mat3 = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
ORIGIN: Vec3 = (0.0, 0.0, 0.0)

Pose = tuple[Mat3, Vec3]
"""R_parent_child and p_parent_child_m."""
Finish = Literal["skin", "plastic", "cloth", "eye", "dark"]
"""Material of a surface; each viewer approximates it."""


class Inertia(NamedTuple):
    """Mass of a link, its centre in the link's frame, and the tensor about that centre."""

    mass_kg: float
    com_m: Vec3
    tensor_kg_m2: Floats


class Ellipsoid(NamedTuple):
    """A simple body that represents a link in collisions: its centre and half axes."""

    p_m: Vec3
    half_m: Vec3


class Visual(NamedTuple):
    """Visible shape of a link; the name is unique in the description.

    shape: name of a stored shape
    scale: factor of its size, or one for each axis; a negative one mirrors it
    """

    name: str
    shape: str
    finish: Finish = "plastic"
    p_m: Vec3 = ORIGIN
    R: Mat3 = IDENTITY
    scale: float | Vec3 = 1.0

    def painted(self) -> Painted:
        """Return its mesh, in metres."""
        return move_mesh(stored_shape(self.shape), scale=self.scale)


class LinkJoint(NamedTuple):
    """The hinge between a link and its parent.

    name: name in the rig, or a separate one if it follows another joint
    follows: joint of the rig that a linkage turns together with it, "" for none
    axis: unit vector in the link's frame; positive angles turn about it by the right-hand rule
    max_torque_nm: largest torque of the joint's own servo
    awake_rad: its angle while the head is awake and looks straight ahead
    """

    name: str
    axis: Vec3
    low_rad: float
    high_rad: float
    max_speed_rad_s: float
    max_torque_nm: float
    follows: str = ""
    awake_rad: float = 0.0


class Link(NamedTuple):
    """Rigid part: its pose in its parent with the joint at 0, its inertia and shapes."""

    name: str
    parent: str | None
    p_m: Vec3 = ORIGIN
    R: Mat3 = IDENTITY
    joint: LinkJoint | None = None
    inertia: Inertia | None = None
    visuals: tuple[Visual, ...] = ()
    collisions: tuple[Ellipsoid, ...] = ()


CAMERA, OPTICAL_FRAME = "camera_link", "camera_optical_frame"
"""Links of the camera: x forward, y left, z up; x right, y down, z forward (as in ROS)."""


class Description(NamedTuple):
    """A rig as a tree of links, parents first."""

    name: str
    links: tuple[Link, ...]

    @property
    def joints(self) -> tuple[LinkJoint, ...]:
        """Return all joints, also those that follow others."""
        return tuple(link.joint for link in self.links if link.joint is not None)

    def angles(self, names: Sequence[str], position_rad: Sequence[float]) -> dict[str, float]:
        """Return the angle of every joint, those that follow others included.

        Args:
            names: names of joints of the rig.
            position_rad: their angles; the other joints are at 0.
        """
        known = dict(zip(names, position_rad, strict=True))
        return {joint.name: known.get(joint.follows or joint.name, 0.0) for joint in self.joints}

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
