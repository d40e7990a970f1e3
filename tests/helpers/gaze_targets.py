"""Targets of the gaze, a head that turns to them, and joints at rest."""

from collections.abc import Callable, Sequence
from math import radians
from typing import Any

import numpy as np
from msgspec.structs import replace

from gazerig.gaze.oculomotor.head import HeadModel
from gazerig.gaze.types import Floats, Target, Vec3
from gazerig.robot.model.types import JointState

DT = 0.005


def target(
    place: Vec3 = (1.0, 0.0, 0.0),
    v: Vec3 = (0.0, 0.0, 0.0),
    at_s: float = 0.0,
    kind: str = "face",
    id: int = 1,
    salience: float = 0.5,
    top_down: bool = False,
    shift: int = 1,
    centre: Vec3 | None = None,
) -> Target:
    """Return a target, by default a still face a metre ahead."""
    return Target(place, v, at_s, kind, id, salience, top_down, None, shift, "", centre)


def turn(
    model: HeadModel,
    seconds: float,
    where: Callable[[float], tuple[Target, float]],
    facing_deg: float | None = None,
) -> Floats:
    """Return the yaws of a head that begins straight ahead, one before each tick; degrees.

    Args:
        model: the head.
        seconds: how long it turns.
        where: the target and its yaw in degrees at a time.
        facing_deg: yaw of the target's centre if it is not that of the target.
    """
    yaws = [0.0]
    for k in range(round(seconds / DT)):
        seen, yaw_deg = where(k * DT)
        gaze = radians(yaw_deg), 0.0
        facing = gaze if facing_deg is None else (radians(facing_deg), 0.0)
        yaws.append(model.step(seen, facing, gaze, abs(gaze[0] - yaws[-1]), 1.0, k * DT)[0])
    return np.degrees(yaws)


def joints_at(position_rad: Sequence[float], t_s: float = 0.0, **columns: Any) -> JointState:
    """Return joints at rest, measured at a time; columns: others than usual."""
    still = (0.0,) * len(position_rad)
    at = JointState(tuple(position_rad), still, (t_s,) * len(still), ())
    return replace(at, **columns)
