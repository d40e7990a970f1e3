"""Links, joints, inertias and shapes of a rig's description, and the measures of its head.

SI units. A link's frame is that of its joint, which turns it about an axis through its origin.
World: origin at the neck base, x forward, y left, z up. All link frames except those of the camera
are parallel to it while every joint is at 0. The head's frame has its origin midway between the
eyes; all of the head scales with their distance.
"""

from collections.abc import Mapping, Sequence
from math import cos, radians, sin
from typing import Literal, NamedTuple

from gazerig.gaze.angles import add, compose, rotate, rotation, scale, turn_about
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


FLOOR_M = -0.09
"""Height of the table under the rig, relative to the neck base."""
EYE_RADIUS = 0.335
"""Radius of an eyeball, in distances between the eyes."""
TOP, CHIN = 1.80, -1.62
"""Height of the head's top and of the chin, in distances between the eyes."""
SIDES = ("left", "right")
FACE_PARTS = ("jaw", "left_brow", "right_brow")
"""Joints that move a part of the face, besides eyes and lids."""
MIDDLE: Vec3 = (-0.85, 0.0, 0.10)
"""Centre of the head's solid, in distances between the eyes; servos and frame are around it."""
_BODIES: tuple[tuple[Vec3, Vec3], ...] = (
    ((-1.10, 0.0, 0.50), (1.30, 1.20, 1.30)),  # skull
    ((-0.66, 0.0, -0.30), (0.84, 1.04, 0.96)),  # face
    ((-0.44, 0.0, -1.02), (0.60, 0.70, 0.50)),  # mouth and the cheeks next to it
    ((-0.06, 0.0, -1.42), (0.20, 0.30, 0.20)),  # chin
)
"""Centre and half axes of the ellipsoids that represent the head in collisions."""
_UPPER_LID, _LOWER_LID = 1.085, 1.07
"""Radii of the lids, in radii of the eyeball."""
_NECK_RADIUS = 0.42
_EAR_SCALE, _EAR_RAD = 0.36, radians(84.0)
_EAR: Vec3 = (-1.12, 1.185, -0.02)
_BROW_HINGE: Vec3 = (-0.22, 0.54, 0.62)
_JAW_HINGE: Vec3 = (-0.85, 0.0, -0.55)

UPPER_REST, LOWER_REST = 0.75, 0.8
"""Openings at rest (gaze/lids/blink.py)."""
# With them an eye looks awake if the edges of its lids are this far above and below the centre of
# the pupil.
_UPPER_AWAKE_RAD, _LOWER_AWAKE_RAD = radians(24.0), radians(-26.0)


class HeadMeasures(NamedTuple):
    """Values of a rig that the shape depends on.

    interocular_m: distance between the eye centres
    pivot_m: a point of the neck's pitch axis in the head frame
    """

    interocular_m: float = 0.0619
    pivot_m: Vec3 = (-0.038, 0.0, -0.055)

    @property
    def eye_radius_m(self) -> float:
        """Return the radius of the eyeballs."""
        return EYE_RADIUS * self.interocular_m

    @property
    def height_m(self) -> float:
        """Return the height of the head from chin to top."""
        return (TOP - CHIN) * self.interocular_m

    def scaled(self, point: Vec3, side: str = "left") -> Vec3:
        """Convert a point on the left from distances between the eyes to metres, on a side."""
        x, y, z = scale(point, self.interocular_m)
        return x, -y if side == "right" else y, z

    def bodies(self) -> tuple[Ellipsoid, ...]:
        """Return the head in collisions."""
        return tuple(Ellipsoid(*map(self.scaled, body)) for body in _BODIES)


def meeting_rad(upper_span_rad: float, lower_span_rad: float) -> float:
    """Return the elevation above an eye's equator at which its lids meet.

    It is chosen so that both lids leave the pupil free at their openings at rest. A lower lid that
    does not move is at this elevation.

    Args:
        upper_span_rad: travel of the upper lid from shut to open.
        lower_span_rad: travel of the lower lid.
    """
    for_upper = _UPPER_AWAKE_RAD - UPPER_REST * upper_span_rad
    for_lower = _LOWER_AWAKE_RAD + LOWER_REST * lower_span_rad
    return min(0.0, max(_LOWER_AWAKE_RAD, 0.5 * (for_upper + for_lower)))


def hinge(joint: str, measures: HeadMeasures) -> tuple[Vec3, Vec3]:
    """Return position and axis of a joint in the head that gaze does not move.

    A jaw opens down about a hinge below the ears; brows turn up about an axis behind them. Any
    other joint pitches up about the centre of the head.
    """
    if joint == "jaw":
        return measures.scaled(_JAW_HINGE), (0.0, 1.0, 0.0)
    place = measures.scaled(MIDDLE)
    if joint in FACE_PARTS:
        place = measures.scaled(_BROW_HINGE, joint.removesuffix("_brow"))
    return place, (0.0, -1.0, 0.0)


def face_look(part: str, measures: HeadMeasures) -> Visual:
    """Return one of the ``FACE_PARTS`` in the head's frame."""
    unit = measures.interocular_m
    if part == "jaw":
        return Visual("jaw", "jaw", "skin", scale=unit)
    aside = -unit if part == "right_brow" else unit
    return Visual(part, "brow", "skin", scale=(unit, aside, unit))


def ear_look(side: str, measures: HeadMeasures) -> Visual:
    """Return an ear in the head's frame."""
    # About x: from facing up to facing sideways.
    c, s = cos(_EAR_RAD), (1.0 if side == "right" else -1.0) * sin(_EAR_RAD)
    R: Mat3 = ((1.0, 0.0, 0.0), (0.0, c, -s), (0.0, s, c))
    size = _EAR_SCALE * measures.interocular_m
    return Visual(f"{side}_ear", "ear", "plastic", measures.scaled(_EAR, side), R, size)


def lid_look(name: str, measures: HeadMeasures, upper: bool, edge_rad: float) -> Visual:
    """Return a lid whose edge is at an elevation above the eye's equator, in the eye's frame."""
    shape, radius = ("upper_lid", _UPPER_LID) if upper else ("lower_lid", _LOWER_LID)
    R = rotation((0.0, edge_rad, 0.0))
    return Visual(name, shape, "skin", ORIGIN, R, radius * measures.eye_radius_m)


def tube(name: str, measures: HeadMeasures, length_m: float, p_m: Vec3) -> Visual:
    """Return a piece of the neck above a point."""
    radius = _NECK_RADIUS * measures.interocular_m
    return Visual(name, "neck", "plastic", p_m, scale=(radius, radius, length_m))
