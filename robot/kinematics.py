"""Exact geometry of the head: joint angles to lines of sight and back. Pure.

The neck turns yaw, then pitch, then roll about axes that may lie apart; each eye pans,
then tilts about its own centre, so that vergence comes from geometry. Frames and signs
as in gaze.types; the world's origin is the neck base on the yaw axis.
"""

from dataclasses import dataclass, field
from math import asin, atan2, hypot

from gaze.angles import add, rotate, rotate_back, rotation, sub, yaw_pitch
from gaze.types import Angles2, Angles3, GazeCommand, GazeState, Mat3, Vec3
from robot.types import JointAngles, JointState


@dataclass(frozen=True)
class GeometryParams:
    """Measures of the rig, in millimetres, with the neck level and straight."""

    pitch_axis_height_mm: float = field(
        metadata={
            "low": 0.0,
            "high": 2000.0,
            "unit": "mm",
            "says": "neck pitch and roll axes above the neck base",
        }
    )
    eyes_ahead_mm: float = field(
        metadata={
            "low": -500.0,
            "high": 500.0,
            "unit": "mm",
            "says": "eye centres ahead of the pitch axis",
        }
    )
    eyes_above_mm: float = field(
        metadata={
            "low": -500.0,
            "high": 1000.0,
            "unit": "mm",
            "says": "eye centres above the pitch axis",
        }
    )
    interocular_mm: float = field(
        default=61.9,
        metadata={
            "low": 10.0,
            "high": 500.0,
            "unit": "mm",
            "says": "between the eye centres (Mitake et al., table 1: 61.9)",
        },
    )


class Kinematics:
    """Forward and inverse geometry of one rig."""

    def __init__(
        self, params: GeometryParams, lid_shut_rad: Angles2, lid_open_rad: Angles2
    ) -> None:
        """Take the measures, and the (left, right) lid joint angles shut and open."""
        self.retune(params, lid_shut_rad, lid_open_rad)

    def retune(self, params: GeometryParams, lid_shut_rad: Angles2, lid_open_rad: Angles2) -> None:
        """Take other measures and lid angles."""
        self._pivot: Vec3 = (0.0, 0.0, params.pitch_axis_height_mm / 1e3)
        self._arm: Vec3 = (params.eyes_ahead_mm / 1e3, 0.0, params.eyes_above_mm / 1e3)
        self._half = params.interocular_mm / 2e3
        self._lid_shut = lid_shut_rad
        self._lid_open = lid_open_rad

    def head_pose(self, head_rad: Angles3) -> tuple[Mat3, Vec3]:
        """Give R_world_head and p_world_head_m (midway between the eyes)."""
        R = rotation(head_rad)
        return R, add(self._pivot, rotate(R, self._arm))

    def facing(self, p_world_m: Vec3) -> Angles2:
        """Give the neck yaw and pitch that lead the head's x axis through a point.

        The axis passes above the pivot by the arm's height, so the pitch is that of the
        point less the angle which that height takes up. A point nearer to the pivot than
        the height cannot be faced; it gets the pitch of its own direction.
        """
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
        """Give left and right (yaw, pitch) in the head that fixate a point."""
        x, y, z = rotate_back(R_world_head, sub(p_world_m, p_world_head_m))
        return yaw_pitch((x, y - self._half, z)), yaw_pitch((x, y + self._half, z))

    def forward(self, joints: JointState) -> GazeState:
        """Give where head and eyes are for measured joints."""
        q, rate = joints.position_rad, joints.velocity_rad_s
        head = (q[6], q[7], q[8])
        R, p_head = self.head_pose(head)
        side = rotate(R, (0.0, self._half, 0.0))
        return GazeState(
            head,
            (rate[6], rate[7], rate[8]),
            (q[0], q[1]),
            (q[2], q[3]),
            R,
            p_head,
            add(p_head, side),
            sub(p_head, side),
            self._opening(q[4], 0),
            self._opening(q[5], 1),
        )

    def inverse(self, command: GazeCommand) -> JointAngles:
        """Give the joint angles of a command, in the order of JOINTS."""
        shut, wide = self._lid_shut, self._lid_open
        return (
            command.eye_left_rad[0],
            command.eye_left_rad[1],
            command.eye_right_rad[0],
            command.eye_right_rad[1],
            shut[0] + command.lid_left * (wide[0] - shut[0]),
            shut[1] + command.lid_right * (wide[1] - shut[1]),
            command.head_rad[0],
            command.head_rad[1],
            command.head_rad[2],
        )

    def _opening(self, angle_rad: float, side: int) -> float:
        """Give how far a lid is open, 0..1, from its joint angle."""
        span = self._lid_open[side] - self._lid_shut[side]
        return min(1.0, max(0.0, (angle_rad - self._lid_shut[side]) / span))
