"""Where a saccade lands: short of a far target, and scattered (Harris & Wolpert 1998)."""

from dataclasses import dataclass
from math import degrees
from typing import Annotated

import numpy as np

from gazerig.gaze.angles import add, angle_between, beside, norm, scale, sub, unit
from gazerig.gaze.types import Vec3
from gazerig.params import Bounds

_FULL_DEG, _NONE_DEG = 10.0, 5.0
"""Saccades fall short by the whole share from the first amplitude on, not up to the second."""


@dataclass(frozen=True)
class EndpointParams:
    """Undershoot and scatter of saccade endpoints."""

    # fmt: off
    undershoot: Annotated[float, Bounds(0, 0.3),
        "share of its amplitude by which a saccade of 10 deg or more falls short, none up to 5 deg; people .05-.10"] = 0.08
    endpoint_scatter_along: Annotated[float, Bounds(0, 0.2),
        "scatter of saccade endpoints along the path, standard deviation as a share of the amplitude; people .03-.05"] = 0.04
    endpoint_scatter_across: Annotated[float, Bounds(0, 0.2),
        "scatter of saccade endpoints across the path, standard deviation as a share of the amplitude; people .02"] = 0.02
    # fmt: on

    @property
    def errs(self) -> bool:
        """Return whether saccades land anywhere else than on their targets."""
        return self.undershoot > 0.0 or self.scatters

    @property
    def scatters(self) -> bool:
        """Return whether endpoints are random."""
        return self.endpoint_scatter_along > 0.0 or self.endpoint_scatter_across > 0.0


def endpoint(
    end: Vec3, start: Vec3, eye: Vec3, params: EndpointParams, rng: np.random.Generator | None
) -> Vec3:
    """Return where a saccade from a point to another one lands, all points in the world."""
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
