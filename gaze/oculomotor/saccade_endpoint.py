"""Landing points of saccades: short of a far target, and scattered (Harris & Wolpert 1998)."""

from math import degrees

import numpy as np

from gazerig.gaze.angles import add, angle_between, beside, norm, scale, sub, unit
from gazerig.gaze.oculomotor.params import OculomotorParams
from gazerig.gaze.types import Vec3

_FULL_DEG, _NONE_DEG = 10.0, 5.0
"""Saccades fall short by the whole share from the first amplitude on, not up to the second."""


def endpoint(
    end: Vec3, start: Vec3, eye: Vec3, params: OculomotorParams, rng: np.random.Generator | None
) -> Vec3:
    """Return the landing point of a saccade from a point to another one, all in the world."""
    a, b = sub(start, eye), sub(end, eye)
    amplitude = angle_between(a, b)
    far = (degrees(amplitude) - _NONE_DEG) / (_FULL_DEG - _NONE_DEG)
    along, across = -params.undershoot * min(1.0, max(0.0, far)), 0.0
    if rng is not None and params.scatters:
        further, aside = (float(n) for n in rng.standard_normal(2))
        along += params.endpoint_scatter_along * further
        across = params.endpoint_scatter_across * aside
    way = beside(unit(b), unit(a), along * amplitude, across * amplitude)
    return add(eye, scale(way, norm(b)))
