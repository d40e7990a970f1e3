"""Exact geometry of the head: joint angles to lines of sight and back. Pure.

The neck turns yaw, then pitch, then roll about axes that may lie apart; each eye pans,
then tilts about its own centre, so that vergence comes from geometry. Eyes that one
linkage turns both stay parallel: they take the mean of what each would need. A joint that
a rig does not have stands at 0, a lid that it does not have is open. Frames and signs as
in gaze.types; the world's origin is the neck base on the yaw axis.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import asin, atan2, hypot, pi
from typing import Annotated

from gazerig.gaze.angles import add, compose, rotate, rotate_back, rotation, sub, yaw_pitch
from gazerig.gaze.types import Angles2, Angles3, GazeCommand, GazeState, Mat3, Vec3
from gazerig.params import Bounds
from gazerig.robot.model.types import GAZE_JOINTS, JointAngles, JointState, in_order


@dataclass(frozen=True)
class GeometryParams:
    """Measures of the rig, in millimetres, with the neck level and straight."""

    # fmt: off
    pitch_axis_height_mm: Annotated[float, Bounds(0, 2000), "height of the neck's pitch and roll axes above the neck base"]
    eyes_ahead_mm: Annotated[float, Bounds(-500, 500), "distance of the eye centres in front of the pitch axis"]
    eyes_above_mm: Annotated[float, Bounds(-500, 1000), "height of the eye centres above the pitch axis"]
    interocular_mm: Annotated[float, Bounds(10, 500), "distance between the eye centres (Mitake et al., table 1: 61.9)"] = 61.9
    lower_pitch_axis_height_mm: Annotated[float, Bounds(0, 2000),
        "height of the pitch axis of a lower neck (lower_neck_yaw, lower_neck_pitch) above the neck base"] = 0.0
    # fmt: on


_UPRIGHT = (0.0, 0.0)
LidEnds = tuple[float, float]
"""Joint angles at which a lid is shut and fully open, radians."""

NECK = ("neck_yaw", "neck_pitch", "neck_roll")
LOWER_NECK = ("lower_neck_yaw", "lower_neck_pitch")
"""A second pair below the neck: expressions and gestures move it, and gaze allows for it."""
LIDS = ("left_upper_lid", "right_upper_lid", "left_lower_lid", "right_lower_lid")


class Kinematics:
    """Forward and inverse geometry of one rig.

    names: of its joints, in the order of every sequence of them; gaze moves the first of them
    one_pan, one_tilt: both eyes are turned by one linkage
    """

    def __init__(
        self, params: GeometryParams, joints: Iterable[str], lids: Mapping[str, LidEnds]
    ) -> None:
        self.names = in_order(joints)
        self.one_pan, self.one_tilt = "eyes_pan" in self.names, "eyes_tilt" in self.names
        place = {name: i for i, name in enumerate(self.names)}
        # What a rig does not have is looked up behind its joints, where a 0 stands.
        absent = len(self.names)
        both = {"pan": place.get("eyes_pan", absent), "tilt": place.get("eyes_tilt", absent)}
        self._eyes = tuple(
            place.get(f"{side}_eye_{way}", both[way])
            for side in ("left", "right")
            for way in ("pan", "tilt")
        )
        self._neck = tuple(place.get(name, absent) for name in NECK)
        self._lower = tuple(place.get(name, absent) for name in LOWER_NECK)
        self._lid_places = tuple(place.get(name, absent) for name in LIDS)
        self._wanted = tuple(GAZE_JOINTS.index(name) for name in self.names if name in GAZE_JOINTS)
        self._further = (0.0,) * (len(self.names) - len(self._wanted))
        self.retune(params, lids)

    def retune(self, params: GeometryParams, lids: Mapping[str, LidEnds]) -> None:
        """Change the geometry and lid angles."""
        self._pivot: Vec3 = (0.0, 0.0, params.pitch_axis_height_mm / 1e3)
        self._base: Vec3 = (0.0, 0.0, params.lower_pitch_axis_height_mm / 1e3)
        self._arm: Vec3 = (params.eyes_ahead_mm / 1e3, 0.0, params.eyes_above_mm / 1e3)
        self._half = params.interocular_mm / 2e3
        # Of an absent lid, whose angle is 0, the opening comes out as 1.
        ends = [lids[name] if name in self.names else (-1.0, 0.0) for name in LIDS]
        self._shut = tuple(shut for shut, _ in ends)
        self._span = tuple(wide - shut for shut, wide in ends)

    def head_pose(self, head_rad: Angles3, base_rad: Angles2 = _UPRIGHT) -> tuple[Mat3, Vec3]:
        """Return R_world_head and p_world_head_m (midway between the eyes).

        Args:
            head_rad: (yaw, pitch, roll) of the neck.
            base_rad: (yaw, pitch) of a lower neck that carries it.
        """
        R = rotation(head_rad)
        p = add(self._pivot, rotate(R, self._arm))
        if base_rad == _UPRIGHT:
            return R, p
        R_world_base = rotation((*base_rad, 0.0))
        return compose(R_world_base, R), self._carried(R_world_base, p)

    def _carried(self, R_world_base: Mat3, p_m: Vec3) -> Vec3:
        """Return where a lower neck carries a point, which is given for it upright."""
        return add(self._base, rotate(R_world_base, sub(p_m, self._base)))

    def facing(self, p_world_m: Vec3, base_rad: Angles2 = _UPRIGHT) -> Angles2:
        """Return the neck yaw and pitch that lead the head's x axis through a point.

        The axis passes above the pivot by the arm's height, so the pitch is that of the
        point less the angle which that height takes up. A point nearer to the pivot than
        the height cannot be faced; it gets the pitch of its own direction.
        """
        if base_rad != _UPRIGHT:
            back = rotate_back(rotation((*base_rad, 0.0)), sub(p_world_m, self._base))
            p_world_m = add(self._base, back)
        x, y, z = sub(p_world_m, self._pivot)
        level = hypot(x, y)
        distance = hypot(level, z)
        above = self._arm[2]
        yaw = atan2(y, x)
        if distance <= abs(above):
            return (yaw, atan2(z, level))
        return (yaw, atan2(z, level) - asin(above / distance))

    def eyes_on(
        self, p_world_m: Vec3, R_world_head: Mat3, p_world_head_m: Vec3
    ) -> tuple[Angles2, Angles2]:
        """Return left and right (yaw, pitch) in the head that fixate a point.

        Eyes that cannot turn each by itself come as near to that as both together can.
        """
        x, y, z = rotate_back(R_world_head, sub(p_world_m, p_world_head_m))
        left, right = yaw_pitch((x, y - self._half, z)), yaw_pitch((x, y + self._half, z))
        if self.one_pan:
            yaw = _between(left[0], right[0])
            left, right = (yaw, left[1]), (yaw, right[1])
        if self.one_tilt:
            pitch = 0.5 * (left[1] + right[1])
            left, right = (left[0], pitch), (right[0], pitch)
        return left, right

    def forward(self, joints: JointState) -> GazeState:
        """Return where head and eyes are for measured joints."""
        q, rate = (*joints.position_rad, 0.0), (*joints.velocity_rad_s, 0.0)
        yaw, pitch, roll = self._neck
        head = (q[yaw], q[pitch], q[roll])
        lower_yaw, lower_pitch = self._lower
        base = (q[lower_yaw], q[lower_pitch])
        R, p_head = self.head_pose(head, base)
        side = rotate(R, (0.0, self._half, 0.0))
        pan_left, tilt_left, pan_right, tilt_right = self._eyes
        upper_left, upper_right, lower_left, lower_right = (
            min(1.0, max(0.0, (q[i] - shut) / span))
            for i, shut, span in zip(self._lid_places, self._shut, self._span, strict=True)
        )
        return GazeState(
            head,
            (rate[yaw], rate[pitch], rate[roll]),
            (q[pan_left], q[tilt_left]),
            (q[pan_right], q[tilt_right]),
            R,
            p_head,
            add(p_head, side),
            sub(p_head, side),
            upper_left,
            upper_right,
            lower_left,
            lower_right,
            base,
            (rate[lower_yaw], rate[lower_pitch]),
        )

    def inverse(self, command: GazeCommand, further_rad: JointAngles = ()) -> JointAngles:
        """Return the joint angles of a command.

        Args:
            command: what gaze asks for.
            further_rad: angles of the joints that gaze does not move; 0 where not given.
        """
        left, right, shut, span = (
            command.eye_left_rad,
            command.eye_right_rad,
            self._shut,
            self._span,
        )
        every = (
            *left,
            *right,
            0.5 * (left[0] + right[0]),
            0.5 * (left[1] + right[1]),
            shut[0] + command.lid_left * span[0],
            shut[1] + command.lid_right * span[1],
            shut[2] + command.lower_left * span[2],
            shut[3] + command.lower_right * span[3],
            *command.head_rad,
        )
        return (*[every[i] for i in self._wanted], *(further_rad or self._further))

    def further_rad(self, base_rad: Angles2) -> JointAngles:
        """Return the joints that gaze does not move at 0, but a lower neck at its angles."""
        lower = dict(zip(LOWER_NECK, base_rad, strict=True))
        return tuple(lower.get(name, 0.0) for name in self.names[len(self._wanted) :])


def _between(one: float, other: float) -> float:
    """Return the direction midway between two within -pi..pi, the short way round."""
    middle = 0.5 * (one + other)
    if abs(one - other) <= pi:
        return middle
    return middle - pi if middle > 0.0 else middle + pi
