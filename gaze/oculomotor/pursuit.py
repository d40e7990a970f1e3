"""Smooth pursuit of a moving target between saccades, in gaze space.

It has two controls, conjugate and vergence, like the binocular controller (binocular.py, which
replaces it with ``model: binocular``). They act on the predicted present position of the target
(target_prediction.py): no visual delay remains, a jump of the position never enters the speed, and
motion of the head changes nothing, near targets included.

The direction adopts the share Gp of the target's angular speed and closes the error at the rate Kc,
both together no faster than human pursuit; the nearness closes its own error at Kd, or at the
slower Kdiv for a receding target. Saccades close larger errors of direction.
"""

from math import exp, radians, sqrt
from typing import NamedTuple, Protocol

from gazerig.gaze.angles import dot, norm, perpendicular, scale, sub
from gazerig.gaze.oculomotor.binocular import (
    BinocularController,
    EyeGeometry,
    Eyes,
    OppositeAngles,
    SaccadeState,
)
from gazerig.gaze.oculomotor.params import PursuitParams
from gazerig.gaze.types import Target, Vec3

Sight = tuple[float, float, float, float]
"""A point as seen from the eyes: its direction x, y, z, and its nearness, 1 / distance in 1/m."""

_FARTHEST_1_M = 0.01
"""Nearness below which the lines of sight are practically parallel (100 m)."""
_NEAREST_1_M = 20.0
"""Nearness of a point at the eyes themselves (0.05 m); the direction of a nearer point is
undefined.
"""
_PEAK_SHARE = 1.2
"""Largest peak speed of a followed swing, over the fastest pursuit: motion at its ends compensates
for the part cut off in its middle.
"""
_NEAREST_M = 1.0 / _NEAREST_1_M
_SLOW_RAD_S = radians(5.0)
"""Up to this speed of the target, the gaze may exceed its speed less and less to catch up."""


class Slip(NamedTuple):
    """Position error and retinal slip of the target, as seen from the eyes.

    error_rad: angle from the gaze to the target, as a vector across the line of sight
    slip_rad_s: speed of the target minus that of pursuit, without the closing of the error
    """

    error_rad: Vec3
    slip_rad_s: Vec3


class EyeController(Protocol):
    """Controller of both eyes between saccades, which replaces pursuit by the gaze point."""

    def reset(self) -> None:
        """Forget target, eyes and head."""
        ...

    def fixate(
        self,
        target: Target,
        gaze: Vec3,
        prescribed: Eyes | None,
        saccades: SaccadeState,
        view: EyeGeometry,
        t_s: float,
        dt_s: float,
    ) -> tuple[Eyes, Vec3]:
        """Return the eye angles for the next period, and the point that they fixate."""
        ...


class Pursuit:
    """Smooth pursuit of a target point by the gaze point.

    controller: moves the eyes instead; None: no controller
    """

    def __init__(self, params: PursuitParams) -> None:
        self.binocular = BinocularController(params)
        self._opposite = OppositeAngles()
        self._params = params
        self.retune(params)
        self.reset()

    def reset(self) -> None:
        """Begin without a target."""
        self.binocular.reset()
        self._opposite.reset()

    def retune(self, params: PursuitParams) -> None:
        """Change gains and limits."""
        if params.model != self._params.model:
            self.reset()
        self._params = params
        self.binocular.retune(params)
        self.controller: EyeController | None = None
        if params.model != "gaze_space":
            self.controller = self.binocular if params.model == "binocular" else self._opposite
        self._max_rad_s = radians(params.max_speed_deg_s)
        self._reject_rad_s = radians(params.reject_deg_s)
        self._max_error_rad = radians(params.max_error_deg)
        self.fastest_swing_rad_s = _PEAK_SHARE * self._max_rad_s

    def slip(self, gaze: Vec3, target: Vec3, v_target: Vec3, eye: Vec3) -> Slip:
        """Return error and retinal slip; all points in the world, metres."""
        (x, y, z, _), (to_x, to_y, to_z, near) = (
            line_of_sight_to(gaze, eye),
            line_of_sight_to(target, eye),
        )
        across = perpendicular(scale(v_target, near), (to_x, to_y, to_z))
        return Slip((to_x - x, to_y - y, to_z - z), sub(across, self._adopted_speed(across)))

    def step(
        self, gaze: Vec3, target: Vec3, v_target: Vec3, eye: Vec3, dt_s: float, closing: bool = True
    ) -> Vec3:
        """Return the gaze point ``dt_s`` later; all points in the world, metres.

        target, v_target: the target's present position and velocity
        eye: midpoint between the eyes, the origin of directions and nearness
        closing: whether the error of direction is closed; False leaves it to a saccade
        """
        if dt_s <= 0.0:
            return gaze
        return self.follow(
            line_of_sight_to(gaze, eye),
            line_of_sight_to(target, eye),
            target,
            v_target,
            eye,
            dt_s,
            closing,
        )

    def follow(
        self,
        gaze: Sight,
        now: Sight,
        target: Vec3,
        v_target: Vec3,
        eye: Vec3,
        dt_s: float,
        closing: bool,
        outruns: bool = True,
    ) -> Vec3:
        """Return the result of ``step``, given both points as seen from the eye.

        gaze, now: gaze point and target as seen from ``eye``
        dt_s: above 0
        outruns: whether a gaze that is behind may be faster than the target; False leaves the rest
            to catch-up saccades, as people do unless the motion is predictable
        """
        par = self._params
        (x, y, z, near), (to_x, to_y, to_z, near_now) = gaze, now
        vx, vy, vz = v_target
        # The target one step ago, and the change of its direction since then.
        was_x, was_y, was_z, near_before = line_of_sight_to(
            (target[0] - vx * dt_s, target[1] - vy * dt_s, target[2] - vz * dt_s), eye
        )
        rate = 1.0 / dt_s
        move_x, move_y, move_z = self._adopted_speed(
            ((to_x - was_x) * rate, (to_y - was_y) * rate, (to_z - was_z) * rate)
        )
        move_x, move_y, move_z = move_x * dt_s, move_y * dt_s, move_z * dt_s
        if closing:
            off_x, off_y, off_z = was_x - x, was_y - y, was_z - z
            size, most = sqrt(off_x * off_x + off_y * off_y + off_z * off_z), self._max_error_rad
            if size > most:
                off_x, off_y, off_z = scale((off_x, off_y, off_z), most / size)
            share = 1.0 - exp(-par.gain_1_s * dt_s)
            close = off_x * share, off_y * share, off_z * share
            if not outruns:
                way = to_x - was_x, to_y - was_y, to_z - was_z
                close = _limit_speed(close, way, 1.0 - par.velocity_gain, dt_s)
            move_x, move_y, move_z = move_x + close[0], move_y + close[1], move_z + close[2]
            size = sqrt(move_x * move_x + move_y * move_y + move_z * move_z)
            most = self._max_rad_s * dt_s
            if size > most:
                move_x, move_y, move_z = scale((move_x, move_y, move_z), most / size)
        gain = par.vergence_gain_1_s if near_before > near else par.divergence_gain_1_s
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

    def _adopted_speed(self, speed_rad_s: Vec3) -> Vec3:
        """Return the angular velocity that is adopted from a target's."""
        x, y, z = speed_rad_s
        size, gain = sqrt(x * x + y * y + z * z), self._params.velocity_gain
        if size > self._reject_rad_s:
            return (0.0, 0.0, 0.0)
        if size > self._max_rad_s:
            share = self._max_rad_s / size
            x, y, z = x * share, y * share, z * share
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
