"""Smooth pursuit of a moving target between saccades, in gaze space.

It has two controls, conjugate and vergence, like the binocular controller (binocular.py, which
replaces it with ``model: binocular``). They act on the predicted present position of the target
(target_prediction.py): no visual delay remains, a jump of the position never enters the speed, and
motion of the head changes nothing, near targets included.

The direction adopts the share Gp of the target's angular speed and closes the error at the rate Kc,
both together no faster than human pursuit; the nearness closes its own error at Kd, or at the
slower Kdiv for a receding target. Saccades close larger errors of direction.
"""

from dataclasses import dataclass
from math import exp, radians, sqrt
from typing import Annotated, Literal, NamedTuple

from gazerig.gaze.angles import dot, norm, perpendicular, scale, sub
from gazerig.gaze.oculomotor.binocular import (
    DIVERGENCE_GAIN_1_S,
    GAIN_1_S,
    MAX_ERROR_RAD,
    MAX_RAD_S,
    REJECT_RAD_S,
    VELOCITY_GAIN,
    VERGENCE_GAIN_1_S,
    BinocularController,
    OppositeAngles,
)
from gazerig.gaze.oculomotor.target_prediction import limit_length
from gazerig.gaze.types import Vec3

Sight = tuple[float, float, float, float]
"""A point as seen from the eyes: its direction x, y, z, and its nearness, 1 / distance in 1/m."""

_FARTHEST_1_M = 0.01
"""Nearness below which the lines of sight are practically parallel (100 m)."""
_NEAREST_1_M = 20.0
"""Nearness of a point at the eyes themselves (0.05 m); the direction of a nearer point is
undefined.
"""
FASTEST_SWING_RAD_S = 1.2 * MAX_RAD_S
"""Largest peak speed of a followed swing: motion at its ends compensates for the part cut off in
its middle.
"""
_REFRACTORY_S = 0.15
"""Shortest time after a saccade before a position error alone triggers the next."""
_NEAREST_M = 1.0 / _NEAREST_1_M
_FASTEST_RAD_S = radians(28.0), MAX_RAD_S
"""Fastest pursuit of motion whose course is not known: people's gain is .9 at 30 deg/s, and above
that saccades catch up (Robinson, Gordon & Gordon 1986); and of one that is known."""
_SLOW_RAD_S = radians(5.0)
"""Up to this speed of the target, the gaze may exceed its speed less and less to catch up."""


class Slip(NamedTuple):
    """Position error and retinal slip of the target, as seen from the eyes.

    error_rad: angle from the gaze to the target, as a vector across the line of sight
    slip_rad_s: speed of the target minus that of pursuit, without the closing of the error
    """

    error_rad: Vec3
    slip_rad_s: Vec3


@dataclass(frozen=True)
class PursuitParams:
    """Model of pursuit."""

    # fmt: off
    model: Annotated[Literal["gaze_space", "binocular", "opposite_angles"],
        "the gaze point follows the predicted target; or the binocular controller of Zhang & Wakamatsu moves the eyes; or they turn "
        "between shifts by the opposite of the head's angles (Nakamoto & Tsuruno 3.4)"] = "gaze_space"
    # fmt: on


class Pursuit:
    """Smooth pursuit of a target point by the gaze point.

    controller: moves the eyes instead; None: no controller
    refractory_s: shortest time after a saccade before a position error alone triggers the next; 0
        if only saccades close an error
    """

    def __init__(self, params: PursuitParams) -> None:
        self.retune(params)

    def reset(self) -> None:
        """Begin without a target."""
        if self.controller is not None:
            self.controller.reset()

    def retune(self, params: PursuitParams) -> None:
        """Change the model; the new one begins without a target."""
        self.controller: BinocularController | OppositeAngles | None = None
        self.refractory_s = _REFRACTORY_S
        if params.model == "binocular":
            self.controller = BinocularController()
        elif params.model == "opposite_angles":
            self.controller, self.refractory_s = OppositeAngles(), 0.0

    def slip(self, gaze: Vec3, target: Vec3, v_target: Vec3, eye: Vec3, known: bool = True) -> Slip:
        """Return error and retinal slip; arguments as those of ``follow``."""
        (x, y, z, _), (to_x, to_y, to_z, near) = (
            line_of_sight_to(gaze, eye),
            line_of_sight_to(target, eye),
        )
        across = perpendicular(scale(v_target, near), (to_x, to_y, to_z))
        return Slip((to_x - x, to_y - y, to_z - z), sub(across, _adopted_speed(across, known)))

    def follow(
        self,
        gaze: Sight,
        now: Sight,
        target: Vec3,
        v_target: Vec3,
        eye: Vec3,
        dt_s: float,
        closing: bool,
        known: bool = True,
    ) -> Vec3:
        """Return the gaze point ``dt_s`` later; all points in the world, metres.

        gaze, now: gaze point and target as seen from ``eye``
        target, v_target: the target's present position and velocity
        eye: midpoint between the eyes, the origin of directions and nearness
        dt_s: above 0
        closing: whether the error of direction is closed; False leaves it to a saccade
        known: whether the motion is predictable; if it is not, a gaze that is behind is no faster
            than the target, nor than people's is then, and leaves the rest to catch-up saccades
        """
        (x, y, z, near), (to_x, to_y, to_z, near_now) = gaze, now
        vx, vy, vz = v_target
        # The target one step ago, and the change of its direction since then.
        was_x, was_y, was_z, near_before = line_of_sight_to(
            (target[0] - vx * dt_s, target[1] - vy * dt_s, target[2] - vz * dt_s), eye
        )
        rate = 1.0 / dt_s
        move_x, move_y, move_z = _adopted_speed(
            ((to_x - was_x) * rate, (to_y - was_y) * rate, (to_z - was_z) * rate), known
        )
        move_x, move_y, move_z = move_x * dt_s, move_y * dt_s, move_z * dt_s
        if closing:
            off = limit_length((was_x - x, was_y - y, was_z - z), MAX_ERROR_RAD)
            close = scale(off, 1.0 - exp(-GAIN_1_S * dt_s))
            if not known:
                way = to_x - was_x, to_y - was_y, to_z - was_z
                close = _limit_speed(close, way, 1.0 - VELOCITY_GAIN, dt_s)
            move = move_x + close[0], move_y + close[1], move_z + close[2]
            move_x, move_y, move_z = limit_length(move, _FASTEST_RAD_S[known] * dt_s)
        gain = VERGENCE_GAIN_1_S if near_before > near else DIVERGENCE_GAIN_1_S
        near += near_now - near_before + (near_before - near) * (1.0 - exp(-gain * dt_s))
        if not _FARTHEST_1_M <= near <= _NEAREST_1_M:
            near = min(max(near, _FARTHEST_1_M), _NEAREST_1_M)
        x, y, z = x + move_x, y + move_y, z + move_z
        length, distance = sqrt(x * x + y * y + z * z), 1.0 / near
        if length == 0.0:  # reversed within one step
            x = length = 1.0
        return (
            eye[0] + x / length * distance,
            eye[1] + y / length * distance,
            eye[2] + z / length * distance,
        )


def _adopted_speed(speed_rad_s: Vec3, known: bool) -> Vec3:
    """Return the angular velocity that is adopted from a target's."""
    x, y, z = speed_rad_s
    size = sqrt(x * x + y * y + z * z)
    if size > REJECT_RAD_S:
        return (0.0, 0.0, 0.0)
    gain = VELOCITY_GAIN * min(1.0, _FASTEST_RAD_S[known] / max(size, 1e-9))
    return (x * gain, y * gain, z * gain)


def _limit_speed(close: Vec3, way: Vec3, least: float, dt_s: float) -> Vec3:
    """Return the closing of an error, along a target's motion no faster than the missing speed.

    close: closing in this step; way: the target's motion in it; least: share of that motion which
        pursuit leaves; there is no limit for a slow target
    """
    size = norm(way)
    along = dot(close, way) / size if size > 0.0 else 0.0
    free = max(0.0, 1.0 - size / (_SLOW_RAD_S * dt_s))
    most = max(least * size, free * along)
    return close if along <= most else sub(close, scale(way, (along - most) / size))


def line_of_sight_to(point: Vec3, eye: Vec3) -> Sight:
    """Return the direction of a point and its nearness; straight ahead for the eye itself."""
    x, y, z = point[0] - eye[0], point[1] - eye[1], point[2] - eye[2]
    length = sqrt(x * x + y * y + z * z)
    if length > _NEAREST_M:
        return x / length, y / length, z / length, 1.0 / length
    if length == 0.0:
        return 1.0, 0.0, 0.0, 1.0 / _NEAREST_M
    return x / length, y / length, z / length, 1.0 / _NEAREST_M
