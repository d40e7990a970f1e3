"""Which bodies an eye can see (Mitake et al. 3.3.2): those whose centre lies in its field.

The paper's figure 4 holds the field's angles but not in print; the defaults are the
limits of human perimetry. Radians and metres inside, degrees in the parameters.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gaze.angles import compose, direction, rotate, rotation
from gaze.types import Angles2, Bodies, GazeState, Mat3, Vec3

_TO_THE_TEMPLE = np.array([[1.0], [-1.0]])
"""Left eye: + is left; right eye: + is right."""


@dataclass(frozen=True)
class FieldOfViewParams:
    """Limits of one eye's field, from its line of sight."""

    temporal_deg: float = field(
        default=100.0,
        metadata={"low": 5.0, "high": 120.0, "unit": "deg", "says": "towards the temple"},
    )
    nasal_deg: float = field(
        default=60.0,
        metadata={"low": 5.0, "high": 120.0, "unit": "deg", "says": "towards the nose"},
    )
    up_deg: float = field(
        default=60.0, metadata={"low": 5.0, "high": 90.0, "unit": "deg", "says": "upwards"}
    )
    down_deg: float = field(
        default=75.0, metadata={"low": 5.0, "high": 90.0, "unit": "deg", "says": "downwards"}
    )


class FieldOfView:
    """Tells which bodies either eye sees."""

    def __init__(self, params: FieldOfViewParams) -> None:
        """Take the limits in degrees."""
        self._temporal = np.radians(params.temporal_deg)
        self._nasal = np.radians(params.nasal_deg)
        self._up = np.radians(params.up_deg)
        self._down = np.radians(params.down_deg)

    def visible(self, bodies: Bodies, state: GazeState) -> NDArray[np.bool_]:
        """Give (n,) whether each body's centre is in the field of at least one eye."""
        p_eyes = np.array([state.p_world_eye_left_m, state.p_world_eye_right_m])
        R_world_eyes = np.array([eye_axes(state, left=True), eye_axes(state, left=False)])
        rel = (bodies.p_world_m - p_eyes[:, None, :]) @ R_world_eyes  # (2, n, 3), in each eye
        ahead, side, up = rel[..., 0], rel[..., 1] * _TO_THE_TEMPLE, rel[..., 2]
        off_axis2 = side * side + up * up
        eccentricity = np.arctan2(np.sqrt(off_axis2), ahead)
        horizontal = np.where(side >= 0.0, self._temporal, self._nasal)
        vertical = np.where(up >= 0.0, self._up, self._down)
        # Each quadrant is bounded by a quarter ellipse between its two limits; multiplied
        # out, so that a body right on the axis needs no division.
        reach2 = (side / horizontal) ** 2 + (up / vertical) ** 2
        inside = eccentricity * eccentricity * reach2 <= off_axis2
        inside &= (off_axis2 > 0.0) | (ahead > 0.0)
        either: NDArray[np.bool_] = inside[0] | inside[1]
        return either


def eye_axes(state: GazeState, left: bool) -> Mat3:
    """Give R_world_eye of one eye: x along its line of sight, y left, z up."""
    angles: Angles2 = state.eye_left_rad if left else state.eye_right_rad
    return compose(state.R_world_head, rotation((angles[0], angles[1], 0.0)))


def line_of_sight(state: GazeState, left: bool) -> Vec3:
    """Give the unit vector along which one eye looks, in the world."""
    return rotate(
        state.R_world_head, direction(state.eye_left_rad if left else state.eye_right_rad)
    )
