"""Guards of nine joints as quick as those of the desk rig."""

from math import radians
from typing import Any

from desk import GAZE_JOINTS

from gazerig.robot.model.guard_params import GuardParams
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.safety.guard import Guard

EYE = JointLimit(radians(-35), radians(35), radians(600), radians(45_000), 70.0, 3.5, 7.0)
NECK = JointLimit(radians(-60), radians(50), radians(200), radians(1_500), 70.0, 3.5, 7.0)
LIMITS = (EYE,) * 6 + (NECK,) * 3
ZERO = (0.0,) * 9
DT = 0.005


def guarding(
    start: tuple[float, ...] = ZERO,
    limits: tuple[JointLimit, ...] = LIMITS,
    gentle: bool = False,
    period_s: float = 0.1,
    **params: Any,
) -> Guard:
    """Return a guard that begins at some angles; gentle: with its slow start."""
    guard = Guard(GuardParams(**params), limits, GAZE_JOINTS, period_s=period_s)
    guard.reset(0.0, start)
    if not gentle:
        guard._gentle = [False] * 9
    return guard
