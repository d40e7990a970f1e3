"""The links of a head with their collision shapes, visual shapes and masses, in metres.

All dimensions scale with the distance between the eyes (robot/description/head_shape.py). A user's
mesh replaces the visual shape of a link (robot/description/own_meshes.py).
"""

from collections.abc import Sequence
from math import cos, radians, sin

import numpy as np

from gazerig.gaze.angles import rotation
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.description import head_mesh, mass
from gazerig.robot.description.head_shape import CHIN, HeadMeasures
from gazerig.robot.description.links import CollisionShape, Inertia, Link, LinkJoint, Visual
from gazerig.robot.description.mesh import (
    Mesh,
    Painted,
    ellipsoid,
    merge_meshes,
    mirror_mesh,
    move_mesh,
    paint,
)

FLOOR_M = -0.09
"""Height of the table under the rig, relative to the neck base."""
UPPER_LID, LOWER_LID = 1.085, 1.07
"""Radii of the lids, in radii of the eyeball."""
BUST, BELOW_CHIN, NECK_RADIUS = 1.45, 0.25, 0.42
"""Width of the shoulders, their distance from the chin, and the neck's radius, in distances
between the eyes."""
THROAT: Vec3 = (-0.72, 0.0, -0.90)
"""Upper end of a neck without joints, in distances between the eyes."""
LEAST_M = 0.01
"""Smallest length of a part."""
_MIDDLE: Vec3 = (-0.85, 0.0, 0.10)
"""Centre of the head's solid."""

# With these openings at rest (gaze/lids/lid_params.py) an eye looks awake if the edges of its lids
# are this far above and below the centre of the pupil.
_UPPER_REST, _LOWER_REST = 0.75, 0.8
_UPPER_AWAKE_RAD, _LOWER_AWAKE_RAD = radians(24.0), radians(-26.0)
_LOWEST_MEETING_RAD = radians(-26.0)

_BODIES: tuple[tuple[Vec3, Vec3], ...] = (
    ((-1.10, 0.0, 0.50), (1.30, 1.20, 1.30)),  # skull
    ((-0.66, 0.0, -0.30), (0.84, 1.04, 0.96)),  # face
)
_JAW_BODIES: tuple[tuple[Vec3, Vec3], ...] = (
    ((-0.44, 0.0, -1.02), (0.60, 0.70, 0.50)),  # mouth and the cheeks next to it
    ((-0.06, 0.0, -1.42), (0.20, 0.30, 0.20)),  # chin
)
"""Ellipsoids (centre, half axes) that represent the head in collisions."""
_LID_EDGE = 0.022
"""Radius of the capsules along a lid's edge, in distances between the eyes."""
_LID_PIECES = 5
_LID_ASIDE_DEG = 35.0

_EAR_SCALE, _EAR_RAD = 0.36, radians(84.0)
_EAR: Vec3 = (-1.12, 1.185, -0.02)
_EAR_FRONT: Vec3 = (-0.80, 1.16, -0.02)
_BROW_HINGE: Vec3 = (-0.22, 0.54, 0.62)


def meeting_rad(upper_span_rad: float, lower_span_rad: float) -> float:
    """Return the elevation above an eye's equator at which its lids meet.

    It is chosen so that both lids leave the pupil free at their openings at rest. A lower lid that
    does not move is at this elevation.

    Args:
        upper_span_rad: travel of the upper lid from shut to open.
        lower_span_rad: travel of the lower lid.
    """
    for_upper = _UPPER_AWAKE_RAD - _UPPER_REST * upper_span_rad
    for_lower = _LOWER_AWAKE_RAD + _LOWER_REST * lower_span_rad
    return min(0.0, max(_LOWEST_MEETING_RAD, 0.5 * (for_upper + for_lower)))


def awake_opening_rad(upper: bool, meet_rad: float, span_rad: float) -> float:
    """Return the opening of a lid in an eye that looks awake, within the lid's travel.

    Args:
        upper: whether it is the upper lid.
        meet_rad: elevation at which the lids meet.
        span_rad: travel of the lid.
    """
    wanted = _UPPER_AWAKE_RAD - meet_rad if upper else meet_rad - _LOWER_AWAKE_RAD
    return min(span_rad, max(0.0, wanted))


def base(name: str, measures: HeadMeasures, head_m: Vec3, column_m: float, necked: bool) -> Link:
    """Return the fixed parts: shoulders, and a neck that does not move.

    Args:
        name: name of the link.
        measures: dimensions of the head.
        head_m: the point between the eyes with all joints at 0.
        column_m: height of the top of a fixed column on the shoulders; 0: no column.
        necked: whether the head is on a neck with joints.
    """
    unit = measures.interocular_m
    throat = _sum(head_m, measures.scaled(THROAT))
    x, y, _ = (0.0, 0.0, 0.0) if necked else throat
    top = shoulders_m(measures, head_m)
    tall = max(LEAST_M, top - FLOOR_M)
    looks = [
        Visual("bust", _scale_axes(head_mesh.bust(), (BUST * unit, BUST * unit, tall)), "cloth",
               (x, y, top))
    ]  # fmt: skip
    end = column_m if necked else throat[2]
    if end > top + 1e-3:
        looks.append(Visual("column", _tube(unit, end - top), "plastic", (x, y, top)))
    shapes = (
        CollisionShape("box", (1.2 * unit, 2.3 * unit, 0.27 * tall), (x, y, top - 0.73 * tall)),
        CollisionShape(
            "capsule",
            (0.62 * unit, max(1e-3, 0.5 * tall - 0.62 * unit), 0.0),
            (x, y, top - 0.5 * tall - 0.02 * unit),
        ),
    )
    inertia = Inertia(
        1.5, (x, y, top - 0.6 * tall), mass.diagonal(0.010, 0.006, 0.012)
    )  # it does not move
    return Link(name, None, inertia=inertia, visuals=tuple(looks), collisions=shapes)


def shoulders_m(measures: HeadMeasures, head_m: Vec3) -> float:
    """Return the height of the shoulders' top: at the neck base or a little below the chin."""
    return min(0.0, head_m[2] + (CHIN - BELOW_CHIN) * measures.interocular_m)


def neck(
    name: str,
    parent: str,
    p_m: Vec3,
    joint: LinkJoint,
    measures: HeadMeasures,
    below_m: float,
    above_m: float,
) -> Link:
    """Return a link of the neck: a servo, and tubes down to the shoulders and up to the next axis.

    Args:
        name: name of the link.
        parent: parent of the link.
        p_m: position in the parent.
        joint: joint that turns it.
        measures: dimensions of the head.
        below_m: length of the tube below the origin.
        above_m: length of the tube above the origin.
    """
    unit = measures.interocular_m
    looks, shapes = [], []
    for which, length, start in (("below", below_m, -below_m), ("above", above_m, 0.0)):
        if length < 1e-3:
            continue
        looks.append(Visual(f"{name}_{which}", _tube(unit, length), "plastic", (0.0, 0.0, start)))
        radius = min(NECK_RADIUS * unit, 0.5 * length)
        half = max(1e-3, 0.5 * length - radius)
        middle = (0.0, 0.0, start + 0.5 * length)
        shapes.append(CollisionShape("capsule", (radius, half, 0.0), middle))
    return Link(
        name,
        parent,
        p_m,
        joint=joint,
        inertia=mass.servo(),
        visuals=tuple(looks),
        collisions=tuple(shapes),
    )


def head(
    name: str,
    parent: str,
    p_m: Vec3,
    measures: HeadMeasures,
    inertia: Inertia,
    moved_parts: Sequence[str],
    still_lids: Sequence[tuple[str, float]],
    looks: bool,
) -> Link:
    """Return the head without the parts that its joints move.

    Args:
        name: name of the link.
        parent: parent of the link.
        p_m: position in the parent.
        measures: dimensions of the head.
        inertia: inertia of the head without its moved parts.
        moved_parts: joints that move parts of it: jaw, brows, ears.
        still_lids: side and elevation of lower lids that no joint moves.
        looks: include visual shapes, whose creation is slow.
    """
    bodies = _BODIES + (() if "jaw" in moved_parts else _JAW_BODIES)
    shapes = tuple(_body(measures, *body) for body in bodies)
    visuals = _head_looks(measures, moved_parts, still_lids) if looks else ()
    return Link(name, parent, p_m, inertia=inertia, visuals=visuals, collisions=shapes)


def _head_looks(
    measures: HeadMeasures, moved_parts: Sequence[str], still_lids: Sequence[tuple[str, float]]
) -> tuple[Visual, ...]:
    unit = measures.interocular_m
    skin = head_mesh.skin()
    looks = [
        Visual("skin", move_mesh(skin.head, _ORIGIN, unit), "skin"),
        Visual("cap", move_mesh(head_mesh.cap(), _ORIGIN, unit), "plastic"),
    ]
    if "jaw" in moved_parts:
        looks.append(Visual("mouth", move_mesh(head_mesh.mouth(), _ORIGIN, unit), "dark"))
    else:
        looks.append(Visual("jaw", move_mesh(skin.jaw, _ORIGIN, unit), "skin"))
    for side in ("left", "right"):
        if f"{side}_brow" not in moved_parts:
            looks.append(Visual(f"{side}_brow", _brow(side, unit, _ORIGIN), "skin"))
        if f"{side}_ear" not in moved_parts:
            looks.append(_ear(side, unit, _ORIGIN))
    for side, elevation in still_lids:
        looks.append(_lid_look(f"{side}_still_lid", measures, False, elevation, eye_m(side, unit)))
    return tuple(looks)


def eye_m(side: str, interocular_m: float) -> Vec3:
    """Return the centre of an eye in the head."""
    return (0.0, (0.5 if side == "left" else -0.5) * interocular_m, 0.0)


def eye(name: str, parent: str, p_m: Vec3, measures: HeadMeasures) -> Link:
    """Return an eyeball with iris and pupil, whose gaze is along its x axis."""
    ball = move_mesh(head_mesh.eye(), _ORIGIN, measures.eye_radius_m)
    look = Visual(name, ball, "eye")
    return Link(name, parent, p_m, inertia=mass.globe(measures.eye_radius_m), visuals=(look,))


def lid(
    name: str,
    parent: str,
    p_m: Vec3,
    joint: LinkJoint,
    measures: HeadMeasures,
    upper: bool,
    edge_rad: float,
) -> Link:
    """Return a lid whose edge is at an elevation above the eye's equator with its joint at 0."""
    look = _lid_look(name, measures, upper, edge_rad, _ORIGIN)
    mesh = look.painted.mesh
    weight = mass.sheet(mesh.vertices @ np.array(look.R).T, mesh.faces)
    edge = _LID_EDGE * measures.interocular_m
    radius = 0.5 * (UPPER_LID + LOWER_LID) * measures.eye_radius_m
    # Set back by their radius, at the sides where they are nearest: they touch as the lids meet.
    aside = radians(_LID_ASIDE_DEG)
    elevation = edge_rad + (1.0 if upper else -1.0) * edge / (radius * cos(aside))
    across = np.linspace(-aside, aside, _LID_PIECES + 1)
    points = radius * np.stack(
        (np.cos(across) * cos(elevation), np.sin(across), np.cos(across) * sin(elevation)), axis=-1
    )
    shapes = tuple(
        capsule_between(_vector(a), _vector(b), edge, "lid")
        for a, b in zip(points[:-1], points[1:], strict=True)
    )
    return Link(name, parent, p_m, joint=joint, inertia=weight, visuals=(look,), collisions=shapes)


def facial_joint_axis(name: str, measures: HeadMeasures) -> tuple[Vec3, Vec3]:
    """Return position and axis of a joint in the head that gaze does not move.

    A jaw opens down about a hinge below the ears; brows turn up about an axis behind them; ears
    turn forwards. Any other joint pitches up about the centre of the head.
    """
    up, down = (0.0, -1.0, 0.0), (0.0, 1.0, 0.0)
    side, _, part = name.rpartition("_")
    sign = -1.0 if side == "right" else 1.0
    if name == "jaw":
        return measures.hinge_m, down
    if part == "brow":
        x, y, z = measures.scaled(_BROW_HINGE)
        return (x, sign * y if side in ("left", "right") else 0.0, z), up
    if part == "ear" and side in ("left", "right"):
        x, y, z = measures.scaled(_EAR_FRONT)
        return (x, sign * y, z), (0.0, 0.0, -sign)
    return measures.scaled(_MIDDLE), up


def facial_part(
    name: str, parent: str, p_m: Vec3, joint: LinkJoint, measures: HeadMeasures
) -> Link:
    """Return a part of the face that a joint of the rig moves besides eyes and lids."""
    unit = measures.interocular_m
    back: Vec3 = (-p_m[0], -p_m[1], -p_m[2])
    side, _, part = joint.name.rpartition("_")
    looks: tuple[Visual, ...] = ()
    shapes: tuple[CollisionShape, ...] = ()
    if joint.name == "jaw":
        skin = move_mesh(head_mesh.skin().jaw, back, unit)
        looks = (Visual("jaw", skin, "skin"),)
        shapes = tuple(_body(measures, *body, back) for body in _JAW_BODIES)
    elif part == "brow" and side in ("left", "right"):
        looks = (Visual(joint.name, _brow(side, unit, back), "skin"),)
    elif part == "ear" and side in ("left", "right"):
        looks = (_ear(side, unit, back),)
    weight = mass.servo(0.3)
    if looks:
        weight = mass.join_inertias(
            mass.in_parent_frame(
                mass.sheet(one.painted.mesh.vertices, one.painted.mesh.faces, 2.0e-3),
                one.R,
                one.p_m,
            )
            for one in looks
        )
    return Link(name, parent, p_m, joint=joint, inertia=weight, visuals=looks, collisions=shapes)


def camera(name: str, parent: str, p_m: Vec3, R: Mat3) -> Link:
    """Return the camera's housing, behind the lens at its origin."""
    box = paint(ellipsoid((0.006, 0.012, 0.008), 0.35, 9), (44, 46, 52))
    lens = paint(ellipsoid((0.003, 0.0045, 0.0045), 1.0, 9), (14, 16, 22))
    look = merge_meshes([move_mesh(box, (-0.0085, 0.0, 0.0)), move_mesh(lens, (-0.0035, 0.0, 0.0))])
    return Link(name, parent, p_m, R, visuals=(Visual(name, look, "plastic"),))


def capsule_between(a: Vec3, b: Vec3, radius_m: float, layer: str = "body") -> CollisionShape:
    """Return a capsule between two points."""
    way = np.subtract(b, a)
    length = float(np.linalg.norm(way))
    z = way / length
    x = np.cross(z, (1.0, 0.0, 0.0) if abs(z[0]) < 0.9 else (0.0, 1.0, 0.0))
    x /= np.linalg.norm(x)
    R = np.stack((x, np.cross(z, x), z), axis=1)
    rows = (_vector(R[0]), _vector(R[1]), _vector(R[2]))
    middle = _vector(0.5 * np.add(a, b))
    half = (radius_m, 0.5 * length, 0.0)
    return CollisionShape("capsule", half, middle, rows, "lid" if layer == "lid" else "body")


_ORIGIN: Vec3 = (0.0, 0.0, 0.0)


def _body(measures: HeadMeasures, centre: Vec3, half: Vec3, by: Vec3 = _ORIGIN) -> CollisionShape:
    middle = _sum(measures.scaled(centre), by)
    return CollisionShape("ellipsoid", measures.scaled(half), middle)


def _brow(side: str, unit: float, by: Vec3) -> Painted:
    brow = head_mesh.brow()
    return move_mesh(brow if side == "left" else mirror_mesh(brow), by, unit)


def _ear(side: str, unit: float, by: Vec3) -> Visual:
    sign = 1.0 if side == "left" else -1.0
    x, y, z = _EAR
    place = _sum((x * unit, sign * y * unit, z * unit), by)
    # About x: from facing up to facing sideways.
    c, s = cos(-sign * _EAR_RAD), sin(-sign * _EAR_RAD)
    R: Mat3 = ((1.0, 0.0, 0.0), (0.0, c, -s), (0.0, s, c))
    return Visual(
        f"{side}_ear", move_mesh(head_mesh.ear(), _ORIGIN, _EAR_SCALE * unit), "plastic", place, R
    )


def _lid_look(name: str, measures: HeadMeasures, upper: bool, edge_rad: float, p_m: Vec3) -> Visual:
    radius = (UPPER_LID if upper else LOWER_LID) * measures.eye_radius_m
    lid_shape = move_mesh(head_mesh.eyelid(upper), _ORIGIN, radius)
    return Visual(name, lid_shape, "skin", p_m, rotation((0.0, edge_rad, 0.0)))


def _tube(unit: float, length_m: float) -> Painted:
    radius = NECK_RADIUS * unit
    return _scale_axes(head_mesh.neck(), (radius, radius, length_m))


def _scale_axes(one: Painted, by: Vec3) -> Painted:
    """Scale a mesh along each axis."""
    mesh = Mesh(one.mesh.vertices * by, one.mesh.faces)
    if one.normals is None:
        return one._replace(mesh=mesh)
    out = one.normals / by
    out /= np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-12)
    return one._replace(mesh=mesh, normals=out)


def _sum(a: Vec3, b: Vec3) -> Vec3:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _vector(values: object) -> Vec3:
    x, y, z = np.asarray(values, float).tolist()
    return x, y, z
