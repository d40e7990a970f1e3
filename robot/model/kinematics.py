"""Exact kinematics of the head: joint angles to lines of sight and back.

The neck rotates in yaw, then pitch, then roll, about axes that may be apart. Each eye pans, then
tilts about its own centre, so that vergence results from geometry. Eyes on one common linkage
stay parallel, at the mean of both desired angles. A joint that a rig lacks is at 0, a lid that it
lacks is open. Frames and signs are those of gaze.types; the world's origin is the neck base on the
yaw axis.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import asin, atan2, hypot, pi
from operator import itemgetter
from typing import Annotated

from gazerig.gaze.angles import (
    add,
    angle_between,
    rotate,
    rotation,
    sub,
)
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.gaze.types import Angles2, Angles3, GazeCommand, GazeState, Mat3, Vec3
from gazerig.params import Bounds
from gazerig.robot.model.types import GAZE_JOINTS, JointAngles, JointState, order_joints


@dataclass(frozen=True)
class GeometryParams:
    """Dimensions of the rig in mm, with the neck level and straight."""

    # fmt: off
    pitch_axis_height_mm: Annotated[float, Bounds(0, 2000), "height of the neck's pitch and roll axes above the neck base"]
    eyes_ahead_mm: Annotated[float, Bounds(-500, 500), "distance of the eye centres in front of the pitch axis"]
    eyes_above_mm: Annotated[float, Bounds(-500, 1000), "height of the eye centres above the pitch axis"]
    interocular_mm: Annotated[float, Bounds(10, 500), "distance between the eye centres (Mitake et al., table 1: 61.9)"] = 61.9
    # fmt: on


LidEnds = tuple[float, float]
"""Joint angles at which a lid is shut and fully open, radians."""

NECK = ("neck_yaw", "neck_pitch", "neck_roll")
LIDS = ("left_upper_lid", "right_upper_lid", "left_lower_lid", "right_lower_lid")


class Kinematics:
    """The forward and inverse kinematics of one rig.

    Attributes:
        names: Names of its joints, in the order of every sequence of joints; the joints that
            gaze moves come first.
        one_pan, one_tilt: Whether one linkage pans or tilts both eyes.
    """

    def __init__(
        self, params: GeometryParams, joints: Iterable[str], lids: Mapping[str, LidEnds]
    ) -> None:
        self.names = order_joints(joints)
        self.one_pan, self.one_tilt = "eyes_pan" in self.names, "eyes_tilt" in self.names
        place = {name: i for i, name in enumerate(self.names)}
        # A missing joint is looked up behind the rig's joints, at an appended 0.
        absent = len(self.names)
        both = {"pan": place.get("eyes_pan", absent), "tilt": place.get("eyes_tilt", absent)}
        eyes = [
            place.get(f"{side}_eye_{axis}", both[axis])
            for side in ("left", "right")
            for axis in ("pan", "tilt")
        ]
        neck = [place.get(name, absent) for name in NECK]
        lids_at = [place.get(name, absent) for name in LIDS]
        self._angles_of = itemgetter(*neck, *eyes, *lids_at)
        self._rates_of = itemgetter(*neck)
        self._wanted = tuple(GAZE_JOINTS.index(name) for name in self.names if name in GAZE_JOINTS)
        self._further = (0.0,) * (len(self.names) - len(self._wanted))
        self._pivot_m = params.pitch_axis_height_mm / 1e3
        self._ahead_m, self._above_m = params.eyes_ahead_mm / 1e3, params.eyes_above_mm / 1e3
        self._half = params.interocular_mm / 2e3
        # The opening of a missing lid, whose angle is 0, is computed as 1.
        ends = [lids[name] if name in self.names else (-1.0, 0.0) for name in LIDS]
        self._shut = tuple(shut for shut, _ in ends)
        self._span = tuple(wide - shut for shut, wide in ends)

    def head_pose(self, head_rad: Angles3) -> tuple[Mat3, Vec3]:
        """Return R_world_head and p_world_head_m (midway between the eyes).

        Args:
            head_rad: (yaw, pitch, roll) of the neck.
        """
        R = rotation(head_rad)
        (a, _, b), (c, _, d), (e, _, f) = R
        ahead, above = self._ahead_m, self._above_m  # the arm from the pivot to between the eyes
        p = (
            a * ahead + b * above,
            c * ahead + d * above,
            self._pivot_m + (e * ahead + f * above),
        )
        return R, p

    def pivot_m(self, R_world_head: Mat3, p_world_head_m: Vec3) -> Vec3:
        """Return the intersection of the neck's pitch and roll axes in the world."""
        return add(p_world_head_m, rotate(R_world_head, (-self._ahead_m, 0.0, -self._above_m)))

    def neck_angles_to(self, p_world_m: Vec3) -> Angles2:
        """Return the neck yaw and pitch at which the head's x axis passes through a point.

        The axis passes above the pivot by the arm's height, so the pitch is that of the point
        minus the angle of that height. A point nearer to the pivot than the height cannot be
        faced; the result is then the pitch of its direction.
        """
        x, y, z = p_world_m
        z -= self._pivot_m
        level = hypot(x, y)
        distance = hypot(level, z)
        above = self._above_m
        if distance <= abs(above):
            return (atan2(y, x), atan2(z, level))
        return (atan2(y, x), atan2(z, level) - asin(above / distance))

    def eye_angles_to(
        self, p_world_m: Vec3, R_world_head: Mat3, p_world_head_m: Vec3
    ) -> tuple[Angles2, Angles2]:
        """Return left and right (yaw, pitch) in the head that fixate a point.

        Eyes on a common linkage come as close to the point as both together can.
        """
        (a, b, c), (d, e, f), (g, h, i) = R_world_head
        p, o = p_world_m, p_world_head_m
        ahead, aside, above = p[0] - o[0], p[1] - o[1], p[2] - o[2]
        # The point in the head: R^T (p - o).
        x = a * ahead + d * aside + g * above
        y = b * ahead + e * aside + h * above
        z = c * ahead + f * aside + i * above
        y_left, y_right = y - self._half, y + self._half
        left = atan2(y_left, x), atan2(z, hypot(x, y_left))
        right = atan2(y_right, x), atan2(z, hypot(x, y_right))
        if self.one_pan:
            yaw = 0.5 * (left[0] + right[0])
            if abs(left[0] - right[0]) > pi:  # midway along the shorter arc
                yaw = yaw - pi if yaw > 0.0 else yaw + pi
            left, right = (yaw, left[1]), (yaw, right[1])
        if self.one_tilt:
            pitch = 0.5 * (left[1] + right[1])
            left, right = (left[0], pitch), (right[0], pitch)
        return left, right

    def convergence_rad(self, distance_m: float) -> float:
        """Return the angle by which each eye turns in for a point straight ahead."""
        return 0.0 if self.one_pan else atan2(self._half, distance_m)

    def forward(self, joints: JointState) -> GazeState:
        """Return the poses of head and eyes at measured joints."""
        (
            yaw, pitch, roll,
            pan_left, tilt_left, pan_right, tilt_right,
            upper_left, upper_right, lower_left, lower_right,
        ) = self._angles_of((*joints.position_rad, 0.0))  # fmt: skip
        rates = self._rates_of((*joints.velocity_rad_s, 0.0))
        head = (yaw, pitch, roll)
        R, p_head = self.head_pose(head)
        x, y, z = p_head
        half, shut, span = self._half, self._shut, self._span
        aside_x, aside_y, aside_z = R[0][1] * half, R[1][1] * half, R[2][1] * half
        return GazeState(
            head,
            rates,
            (pan_left, tilt_left),
            (pan_right, tilt_right),
            R,
            p_head,
            (x + aside_x, y + aside_y, z + aside_z),
            (x - aside_x, y - aside_y, z - aside_z),
            _share((upper_left - shut[0]) / span[0]),
            _share((upper_right - shut[1]) / span[1]),
            _share((lower_left - shut[2]) / span[2]),
            _share((lower_right - shut[3]) / span[3]),
        )

    def inverse(self, command: GazeCommand, further_rad: JointAngles = ()) -> JointAngles:
        """Return the joint angles of a command.

        Args:
            command: Gaze command.
            further_rad: Angles of the joints that gaze does not move, default 0.
        """
        head, left, right = command.head_rad, command.eye_left_rad, command.eye_right_rad
        shut, span = self._shut, self._span
        # In the order of GAZE_JOINTS.
        angles = (
            *left,
            *right,
            0.5 * (left[0] + right[0]),
            0.5 * (left[1] + right[1]),
            shut[0] + command.lid_left * span[0],
            shut[1] + command.lid_right * span[1],
            shut[2] + command.lower_left * span[2],
            shut[3] + command.lower_right * span[3],
            *head,
        )
        return (*[angles[i] for i in self._wanted], *(further_rad or self._further))


def _share(value: float) -> float:
    """Clip a number to 0..1; return 0 for NaN."""
    return value if 0.0 < value < 1.0 else 1.0 if value >= 1.0 else 0.0


def gaze_error(p_world_m: Vec3, pose: GazeState, converges: bool = True) -> float:
    """Return the angle between a point and the line of sight of the worse eye, rad.

    Args:
        p_world_m: The point.
        pose: Poses of head and eyes.
        converges: Whether each eye pans separately; if one linkage pans both, the angle is that of
            their mean line of sight, from midway between them.
    """
    left, right = line_of_sight(pose, left=True), line_of_sight(pose, left=False)
    to_left = sub(p_world_m, pose.p_world_eye_left_m)
    to_right = sub(p_world_m, pose.p_world_eye_right_m)
    if not converges:
        return angle_between(add(left, right), add(to_left, to_right))
    return max(angle_between(left, to_left), angle_between(right, to_right))
