"""Torques of the weight of bodies on the joints that turn them. Pure."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from gazerig.gaze.angles import (
    Mat3,
    Vec3,
    add,
    compose,
    dot,
    rotate,
    rotate_back,
    scale,
    turn_about,
)

GRAVITY_M_S2 = 9.81
ORIGIN: Vec3 = (0.0, 0.0, 0.0)


class MovingBody(NamedTuple):
    """Links that move together, in the frame of the joint that turns them.

    joint, axis: the joint, and its axis
    parent: number of the body that carries it; the first one has no parent
    R_parent, p_parent_m: pose in the parent with the joint at 0
    mass_kg, moment_kg_m: mass, and mass times its centre
    """

    joint: str
    axis: Vec3
    parent: int
    R_parent: Mat3
    p_parent_m: Vec3
    mass_kg: float = 0.0
    moment_kg_m: Vec3 = ORIGIN


def weight_nm(bodies: Sequence[MovingBody], angles_rad: Mapping[str, float]) -> dict[str, float]:
    """Return the torque of the weight at each joint of some bodies; omitted joints are at 0."""
    turns = [
        compose(one.R_parent, turn_about(one.axis, angles_rad.get(one.joint, 0.0)))
        for one in bodies
    ]
    masses = [one.mass_kg for one in bodies]
    moments = [one.moment_kg_m for one in bodies]
    for i in range(len(bodies) - 1, 0, -1):  # children come after their parents
        parent, p = bodies[i].parent, bodies[i].p_parent_m
        masses[parent] += masses[i]
        carried = add(scale(p, masses[i]), rotate(turns[i], moments[i]))
        moments[parent] = add(moments[parent], carried)
    up: list[Vec3] = [(0.0, 0.0, 1.0)]
    found: dict[str, float] = {}
    for one, turn, (x, y, z) in zip(bodies[1:], turns[1:], moments[1:], strict=True):
        a, b, c = rotate_back(turn, up[one.parent])
        up.append((a, b, c))
        torque = dot(one.axis, (y * c - z * b, z * a - x * c, x * b - y * a))
        found[one.joint] = found.get(one.joint, 0.0) - GRAVITY_M_S2 * torque
    return found
