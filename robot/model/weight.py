"""Masses of a head, and the torques of the weight of bodies on the joints that turn them. Pure."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, NamedTuple

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
from gazerig.params import Bounds

GEAR_FRICTION = 0.03
"""Dry friction of motor and gear as a fraction of the stall torque."""
AMBIENT_C = 30.0
"""Temperature of the air in a head."""

GRAVITY_M_S2 = 9.81
ORIGIN: Vec3 = (0.0, 0.0, 0.0)


_Millimetres = Annotated[float, Bounds(-1000, 1000)]
PositionMm = tuple[_Millimetres, _Millimetres, _Millimetres]


@dataclass(frozen=True)
class HeadMassParams:
    """Mass of the head; null values follow from its shape."""

    # fmt: off
    mass_kg: Annotated[float | None, Bounds(1e-5, 50), "measured mass; null: from its shape"] = None
    com_mm: Annotated[PositionMm | None,
        "centre of mass ahead, left and above of the neck's pitch axis, with all joints at 0; null: from its shape"] = None
    # fmt: on


@dataclass(frozen=True)
class CounterweightParams:
    """A weight added to the head, as a point."""

    # fmt: off
    mass_kg: Annotated[float, Bounds(0, 20), "mass of the weight"]
    position_mm: Annotated[PositionMm,
        "position ahead, left and above of the neck's pitch axis"]
    # fmt: on


@dataclass(frozen=True)
class MassParams:
    """Masses of a head."""

    # fmt: off
    head: Annotated[HeadMassParams,
        "the whole head with eyes, lids and servos in it, without counterweights"] = field(default_factory=HeadMassParams)
    counterweights: Annotated[Mapping[str, CounterweightParams],
        "weights added to the head, each under any name"] = field(default_factory=dict)
    # fmt: on


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
