"""Ticks of a head with the desk's joints, made from joint angles without a loop."""

from collections.abc import Mapping, Sequence
from math import radians
from typing import Any

from desk import GAZE_JOINTS, LIDS
from gaze_targets import joints_at, target
from msgspec.structs import replace

from gazerig.gaze.types import GazeCommand, Target
from gazerig.robot.loop.tick import Tick
from gazerig.robot.model.kinematics import GeometryParams, Kinematics
from gazerig.robot.model.types import GuardResult

KINEMATICS = Kinematics(GeometryParams(60.0, 40.0, 50.0), GAZE_JOINTS, LIDS)
_STRAIGHT = (0.0, 0.0)


def made_tick(
    t_s: float = 0.0,
    deg: Sequence[float] = (0.0,) * 9,
    gaze: Mapping[str, Any] | None = None,
    seen: Target | None = None,
    **changes: Any,
) -> Tick:
    """Return a tick in which all joints are where they are wanted.

    Args:
        t_s: its time.
        deg: angles of the joints.
        gaze: changes of a gaze command that fixates straight ahead.
        seen: the target; None: a face a metre ahead.
        changes: others of the tick.
    """
    joints, seen = joints_at([radians(one) for one in deg], t_s), seen or target()
    angles = joints.position_rad
    command = GazeCommand(
        (0.0, 0.0, 0.0), _STRAIGHT, _STRAIGHT, 1.0, 1.0, "fixate", False, seen.p_world_m, 0, 0, 0
    )
    result = GuardResult(angles, "ok", (), angles, joints=GAZE_JOINTS)
    pose, command = KINEMATICS.forward(joints), replace(command, **(gaze or {}))
    tick = Tick(t_s, joints, pose, None, None, seen, command, angles, result)
    return replace(tick, **changes)
