"""Which bodies an eye can see (Mitake et al. 3.3.2): those whose centre lies in its field.

The paper's figure 4 holds the field's angles but not in print; the defaults are the
limits of human perimetry. Radians and metres inside, degrees in the parameters.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gaze.angles import compose, direction, rotate, rotation
from gaze.types import Angles2, Bodies, Floats, GazeState, Mat3, Vec3


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
        left = self._in_field(bodies.p_world_m, state, left=True)
        right = self._in_field(bodies.p_world_m, state, left=False)
        return left | right

    def _in_field(self, p_world_m: Floats, state: GazeState, left: bool) -> NDArray[np.bool_]:
        """Compare each body's eccentricity with the field's limit on its meridian."""
        p_eye = state.p_world_eye_left_m if left else state.p_world_eye_right_m
        R_world_eye = eye_axes(state, left)
        rel = (p_world_m - np.asarray(p_eye)) @ np.asarray(R_world_eye)
        side = rel[:, 1] if left else -rel[:, 1]  # + towards the temple
        off_axis = np.hypot(side, rel[:, 2])
        eccentricity = np.arctan2(off_axis, rel[:, 0])
        horizontal = np.where(side >= 0.0, self._temporal, self._nasal)
        vertical = np.where(rel[:, 2] >= 0.0, self._up, self._down)
        # Each quadrant is bounded by a quarter ellipse between its two limits.
        safe = np.where(off_axis > 0.0, off_axis, 1.0)
        cos_m, sin_m = side / safe, rel[:, 2] / safe
        limit = 1.0 / np.sqrt((cos_m / horizontal) ** 2 + (sin_m / vertical) ** 2 + 1e-12)
        inside: NDArray[np.bool_] = (off_axis == 0.0) & (rel[:, 0] > 0.0)
        inside |= (off_axis > 0.0) & (eccentricity <= limit)
        return inside


def eye_axes(state: GazeState, left: bool) -> Mat3:
    """Give R_world_eye of one eye: x along its line of sight, y left, z up."""
    angles: Angles2 = state.eye_left_rad if left else state.eye_right_rad
    return compose(state.R_world_head, rotation((angles[0], angles[1], 0.0)))


def line_of_sight(state: GazeState, left: bool) -> Vec3:
    """Give the unit vector along which one eye looks, in the world."""
    return rotate(
        state.R_world_head, direction(state.eye_left_rad if left else state.eye_right_rad)
    )
