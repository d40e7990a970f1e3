"""Visibility of bodies (Mitake et al. 3.3.2): a body is visible if its centre is in an eye's field.

The paper's figure 4 shows the field's angles without numbers; the defaults are the limits of human
perimetry. Radians and metres inside, degrees in the parameters.

By the paper's rule a body behind another one is visible too, and so is the robot's own moving fist.
Own bodies are therefore excluded, and hidden ones optionally.
"""

from dataclasses import dataclass
from math import atan2, radians, sqrt
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from gazerig.gaze.angles import angles_of, compose, direction, rotate, rotation
from gazerig.gaze.types import Angles2, Angles3, Bodies, BodyRows, Floats, GazeState, Mat3, Vec3
from gazerig.params import Bounds

_PAIRS_AT_ONCE = 1_000_000


@dataclass(frozen=True)
class FieldOfViewParams:
    """Limits of one eye's field, from its line of sight, and exclusions inside it."""

    # fmt: off
    temporal_deg: Annotated[float, Bounds(5, 120), "extent of the visual field towards the temple"] = 100.0
    nasal_deg: Annotated[float, Bounds(5, 120), "extent of the visual field towards the nose"] = 60.0
    up_deg: Annotated[float, Bounds(5, 90), "extent of the visual field upwards"] = 60.0
    down_deg: Annotated[float, Bounds(5, 90), "extent of the visual field downwards"] = 75.0
    occlusion: Annotated[bool,
        "a body behind another one cannot be seen; computing time grows with the square of the number of bodies"] = False
    own_kinds: Annotated[tuple[str, ...], "kinds of bodies that belong to the robot itself and are never targets"] = ("own",)
    # fmt: on


class FieldOfView:
    """The fields of view of both eyes."""

    def __init__(self, params: FieldOfViewParams) -> None:
        self.retune(params)

    def retune(self, params: FieldOfViewParams) -> None:
        """Change the limits."""
        self._temporal = radians(params.temporal_deg)
        self._nasal = radians(params.nasal_deg)
        self._up = radians(params.up_deg)
        self._down = radians(params.down_deg)
        self._occlusion = params.occlusion
        self._own = frozenset(params.own_kinds)

    def are_visible(self, bodies: Bodies, rows: BodyRows, state: GazeState) -> list[bool]:
        """Return whether each body's centre is in the field of at least one eye.

        Own bodies are never visible; with occlusion neither are bodies behind another one, own
        bodies included, as seen from the head.

        Args:
            bodies: the bodies.
            rows: the bodies as plain numbers.
            state: head and eyes.
        """
        left, right = eye_axes(state, left=True), None
        seen = []
        for p, kind in zip(rows.p_world_m, rows.kinds, strict=True):
            inside = kind not in self._own
            if inside and not self._is_inside(p, state.p_world_eye_left_m, left, left=True):
                right = right or eye_axes(state, left=False)
                inside = self._is_inside(p, state.p_world_eye_right_m, right, left=False)
            seen.append(inside)
        if self._occlusion:
            rel = bodies.p_world_m - np.asarray(state.p_world_head_m)
            found = np.flatnonzero(seen)
            for row in found[are_occluded(rel, bodies.radius_m, found)].tolist():
                seen[row] = False
        return seen

    def _is_inside(self, p: list[float], p_eye: Vec3, axes: Mat3, left: bool) -> bool:
        """Return whether a point is in the field of one eye."""
        x, y, z = p[0] - p_eye[0], p[1] - p_eye[1], p[2] - p_eye[2]
        (a, b, c), (d, e, f), (g, h, i) = axes
        ahead, side, up = a * x + d * y + g * z, b * x + e * y + h * z, c * x + f * y + i * z
        off_axis2 = side * side + up * up
        if off_axis2 == 0.0:
            return ahead > 0.0
        # Each quadrant is bounded by a quarter ellipse between its two limits.
        eccentricity = atan2(sqrt(off_axis2), ahead)
        side /= self._temporal if (side > 0.0) is left else self._nasal
        up /= self._up if up > 0.0 else self._down
        return eccentricity * eccentricity * (side * side + up * up) <= off_axis2


def are_occluded(rel_m: Floats, radius_m: Floats, rows: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Return for each of ``rows`` whether any body's sphere is wholly in front of its centre.

    rel_m:    (n, 3) centres seen from the eye
    radius_m: (n,) radii

    A centre inside another sphere is not hidden by it (a place on a body, a body in a hand). A
    sphere around the eye hides nothing.
    """
    distance2 = (rel_m * rel_m).sum(axis=1)
    radius2 = radius_m * radius_m
    hides = (radius_m > 0.0) & (distance2 > radius2)
    screens, screens_d2, screens_r2 = rel_m[hides].T, distance2[hides], radius2[hides]
    out = np.zeros(len(rows), dtype=np.bool_)
    step = max(1, _PAIRS_AT_ONCE // max(1, screens_d2.size))
    for start in range(0, len(rows), step):  # in blocks, to bound the memory of the pairs
        some = rows[start : start + step]
        distance = np.sqrt(distance2[some])[:, None]
        ways = rel_m[some] / np.maximum(distance, 1e-9)
        along = ways @ screens
        chord2 = screens_r2 - (screens_d2 - along * along)
        # The line of view leaves the sphere at along + sqrt(chord2), which must be before the
        # centre.
        before = (along > 0.0) & (along < distance) & (chord2 > 0.0)
        before &= chord2 < (distance - along) ** 2
        out[start : start + step] = before.any(axis=1)
    return out


def eye_axes(state: GazeState, left: bool) -> Mat3:
    """Return R_world_eye of one eye: x along its line of sight, y left, z up."""
    angles: Angles2 = state.eye_left_rad if left else state.eye_right_rad
    return compose(state.R_world_head, rotation((angles[0], angles[1], 0.0)))


def head_in_space(state: GazeState) -> Angles3:
    """Return the head's (yaw, pitch, roll) in the world: the neck's if no lower neck is bent."""
    return state.head_rad if state.base_rad == (0.0, 0.0) else angles_of(state.R_world_head)


def line_of_sight(state: GazeState, left: bool) -> Vec3:
    """Return the unit vector of one eye's line of sight, in the world."""
    return rotate(
        state.R_world_head, direction(state.eye_left_rad if left else state.eye_right_rad)
    )
