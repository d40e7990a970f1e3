"""Smooth following of a moving target between saccades.

The gaze takes over the target's own motion and closes what error remains: the
direction (version) at the rate Kc and up to the speed that human pursuit reaches, the
nearness (vergence) at the slower rate Kd. Larger errors of direction are saccades.
"""

from dataclasses import dataclass, field
from math import exp, radians

from gaze.angles import add, norm, scale, sub, unit
from gaze.types import Vec3

_FARTHEST_1_M = 0.01
"""Nearness below which the lines of sight are as good as parallel (100 m)."""


@dataclass(frozen=True)
class PursuitParams:
    """Gain and speed limit of the following."""

    gain_1_s: float = field(
        default=8.0,
        metadata={"low": 0.0, "high": 50.0, "unit": "1/s", "says": "rate Kc closing the error"},
    )
    vergence_gain_1_s: float = field(
        default=4.0,
        metadata={
            "low": 0.0,
            "high": 50.0,
            "unit": "1/s",
            "says": "rate Kd closing the error in depth",
        },
    )
    max_speed_deg_s: float = field(
        default=60.0,
        metadata={
            "low": 1.0,
            "high": 200.0,
            "unit": "deg/s",
            "says": "fastest smooth following; human pursuit saturates near 63 deg/s",
        },
    )


class Pursuit:
    """Moves a gaze point after a target point."""

    def __init__(self, params: PursuitParams) -> None:
        """Take gains and speed limit."""
        self._params = params
        self._max_rad_s = radians(params.max_speed_deg_s)

    def step(self, gaze: Vec3, target: Vec3, v_target: Vec3, eye: Vec3, dt_s: float) -> Vec3:
        """Give the gaze point ``dt_s`` later; all points in the world, metres.

        target, v_target: where the target is now and its velocity
        eye: centre between the eyes, from which directions and nearness are seen
        """
        now, near_now = _seen(target, eye)
        before, near_before = _seen(sub(target, scale(v_target, dt_s)), eye)
        way, near = _seen(gaze, eye)
        close = 1.0 - exp(-self._params.gain_1_s * dt_s)
        move = add(sub(now, before), scale(sub(before, way), close))
        length, longest = norm(move), self._max_rad_s * dt_s
        if length > longest:
            move = scale(move, longest / length)
        close = 1.0 - exp(-self._params.vergence_gain_1_s * dt_s)
        near += near_now - near_before + (near_before - near) * close
        return add(eye, scale(unit(add(way, move)), 1.0 / max(near, _FARTHEST_1_M)))


def _seen(point: Vec3, eye: Vec3) -> tuple[Vec3, float]:
    """Give the direction of a point and its nearness, one over its distance."""
    rel = sub(point, eye)
    distance = max(norm(rel), 1e-6)
    return scale(rel, 1.0 / distance), 1.0 / distance
