"""Gaze at a point: eyes and head by the oculomotor model, through the guard, without a camera."""

from collections.abc import Mapping
from math import degrees, isfinite
from typing import NamedTuple

from gazerig.drivers.errors import SetupError
from gazerig.features.bringup.manual_control import ManualControl, MoveResult, Step
from gazerig.gaze.angles import angle_between, norm, sub
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.gaze.oculomotor.oculomotor import Oculomotor
from gazerig.gaze.types import ORDERED, Target, Vec3
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.kinematics import Kinematics, gaze_error
from gazerig.robot.model.types import JointAngles, JointState

AT_END_DEG = 1.0

TOGETHER = "eyes_pan"
"""Joint that turns both eyes sideways by one linkage."""


class GazeResult(NamedTuple):
    """Measured gaze error of both eyes at the end. Degrees, metres.

    left_error, right_error: angle between each eye's line of sight and the point
    error: the larger of both; if one linkage turns both eyes sideways, the error of their mean
        line of sight, from midway between them
    vergence: angle between the lines of sight; desired_vergence: angle required by the point
    converges: whether each eye has its own yaw joint, so that vergence is possible
    head: (yaw, pitch, roll); distance_m: distance from midway between the eyes
    moved: result of the last desired pose after the guard, by joint
    """

    left_error: float
    right_error: float
    vergence: float
    desired_vergence: float
    head: tuple[float, float, float]
    distance_m: float
    moved: MoveResult
    error: float
    converges: bool


def look_at(
    control: ManualControl,
    kinematics: Kinematics,
    oculomotor: Oculomotor,
    p_world_m: Vec3,
    seconds: float,
) -> GazeResult:
    """Turn eyes and head to a point for some seconds; ``control`` has been started.

    p_world_m: x forward, y left, z up from the neck base

    Raises:
        SetupError: the coordinates are not a point, or the point is in the head itself.
        DriverError: the bus has disappeared.
    """
    refuse_not_finite(p_world_m)
    fresh = True
    target = Target(p_world_m, (0.0, 0.0, 0.0), 0.0, ORDERED, 0, 1.0, True, None, 1, "ordered")

    def desired(joints: JointState, t_s: float, dt_s: float) -> JointAngles:
        nonlocal fresh
        pose = kinematics.forward(joints)
        if fresh:
            fresh = False
            if norm(sub(p_world_m, pose.p_world_head_m)) < 0.03:
                x, y, z = p_world_m
                raise SetupError(
                    f"{x:g} {y:g} {z:g} is inside the head: metres from the neck base, "
                    "x forward, y left, z up, e.g. 1.0 0.2 0.3"
                )
            oculomotor.reset(t_s, pose)
        gaze = oculomotor.step(target._replace(at_s=t_s), pose, t_s, max(dt_s, 1e-3))
        return kinematics.inverse(gaze)

    start_s: list[float] = []

    def over(step: Step) -> str | None:
        if not start_s:
            start_s.append(step.t_s)
        return "arrived" if step.t_s - start_s[0] >= seconds else None

    moved = control.follow(desired, over, seconds + 1.0)
    converges, pose = TOGETHER not in kinematics.names, kinematics.forward(moved.last.joints)
    left, right = line_of_sight(pose, left=True), line_of_sight(pose, left=False)
    to_left = sub(p_world_m, pose.p_world_eye_left_m)
    to_right = sub(p_world_m, pose.p_world_eye_right_m)
    yaw, pitch, roll = pose.head_rad
    error = gaze_error(p_world_m, pose, converges)
    return GazeResult(
        degrees(error.left),
        degrees(error.right),
        degrees(angle_between(left, right)),
        degrees(angle_between(to_left, to_right)),
        (degrees(yaw), degrees(pitch), degrees(roll)),
        norm(sub(p_world_m, pose.p_world_head_m)),
        moved,
        degrees(error.whole),
        converges,
    )


def gaze_result_text(looked: GazeResult) -> tuple[str, ...]:
    """Return gaze error and, if the mechanism has it, vergence as text."""
    eyes = [part for part in looked.moved.joints if part.joint.endswith(("_pan", "_tilt"))]
    known = " (estimated, not measured)" if any(part.estimated for part in eyes) else ""
    away = f"of a point {looked.distance_m:.2f} m away{known}"
    if not looked.converges:
        return (
            f"gaze error: {looked.error:.2f} deg between the eyes' mean line of sight and the "
            f"direction {away}",
            "vergence: none, as one servo turns both eyes to the sides; the point needs "
            f"{looked.desired_vergence:.2f} deg",
        )
    return (
        f"gaze error: left eye {looked.left_error:.2f}, right eye {looked.right_error:.2f} deg "
        f"{away}",
        f"vergence: {looked.vergence:.2f} deg, the point needs {looked.desired_vergence:.2f}",
    )


def joints_at_limits(
    joints: Mapping[str, JointParams], narrower_deg: Mapping[str, float], moved: MoveResult
) -> tuple[str, ...]:
    """Return the names of the joints that could not turn farther towards the point.

    narrower_deg: suffix of a joint's name -> limit of a gaze style to each side
    """
    found = []
    for part in moved.joints:
        most = min((v for key, v in narrower_deg.items() if part.joint.endswith(key)), default=180)
        joint = joints[part.joint]
        low, high = max(joint.min_deg, -most), min(joint.max_deg, most)
        if part.measured <= low + AT_END_DEG or part.measured >= high - AT_END_DEG:
            found.append(f"{part.joint} is at the end of its range ({low:g}..{high:g} deg)")
    return tuple(found)


def refuse_not_finite(p_world_m: Vec3) -> None:
    """Refuse coordinates that are not numbers.

    Raises:
        SetupError: a coordinate is not a number.
    """
    if not all(map(isfinite, p_world_m)):
        raise SetupError(f"{p_world_m} is no point: three numbers in metres, e.g. 1.0 0.2 0.3")
