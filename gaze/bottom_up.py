"""Bottom-up attention: how strongly each visible body's motion pulls the gaze.

Mitake et al. eq 1 sums three stimuli to which cells of the areas MT and MST respond:
translation across the line of view (slide), motion along it (loom) and rotation about
it (spin). Printed with e/|e| on a projection that is only right for |e| = 1, so e is
normalised here, and taken per body from eye to body, as the retinal image demands.
"""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from gaze.types import Bodies, Floats, Vec3


@dataclass(frozen=True)
class BottomUpParams:
    """Weights of the three terms: the motion that counts as 1."""

    slide_rad_s: float = field(
        default=0.5,
        metadata={
            "low": 0.01,
            "high": 20.0,
            "unit": "rad/s",
            "says": "sideways motion, seen from the eye, that pulls with 1",
        },
    )
    loom_1_s: float = field(
        default=0.5,
        metadata={
            "low": 0.01,
            "high": 20.0,
            "unit": "1/s",
            "says": "growth or shrinkage, in parts of the distance, that pulls with 1",
        },
    )
    spin_rad_s: float = field(
        default=3.0,
        metadata={
            "low": 0.01,
            "high": 100.0,
            "unit": "rad/s",
            "says": "rotation about the line of view that pulls with 1",
        },
    )
    smoothing_s: float = field(
        default=0.1,
        metadata={"low": 0.0, "high": 2.0, "unit": "s", "says": "time constant of the low-pass"},
    )


class Pulls(NamedTuple):
    """Amount of attention of each body, term by term: (n,) arrays."""

    slide: Floats
    loom: Floats
    spin: Floats

    @property
    def total(self) -> Floats:
        """Give A_i, the sum of the three terms."""
        return self.slide + self.loom + self.spin


def slide_loom_spin(v: Floats, w: Floats, e: Floats) -> Pulls:
    """Give the three terms of eq 1 for all bodies at once.

    v, w: (n, 3) velocities (m/s) and angular velocities (rad/s)
    e:    (n, 3) or (3,) view directions of any length
    Source: Mitake et al., eq 1, with e normalised.
    """
    length = _length(e)[..., None]
    e = e / np.where(length > 0.0, length, 1.0)
    along = (v * e).sum(axis=-1)
    across = _length(v - along[:, None] * e)
    return Pulls(across, np.abs(along), np.abs((w * e).sum(axis=-1)))


def _length(rows: Floats) -> Floats:
    """Give the lengths of (..., 3) vectors; a third of the time of numpy's own norm."""
    lengths: Floats = np.sqrt((rows * rows).sum(axis=-1))
    return lengths


class BottomUp:
    """Retinal form of eq 1 with a low-pass per body."""

    def __init__(self, params: BottomUpParams) -> None:
        """Take the weights."""
        self._params = params
        self.reset(0.0)

    def reset(self, t_s: float) -> None:
        """Forget all bodies."""
        self._smooth: dict[int, tuple[float, float, float]] = {}
        self._at_s = t_s

    def step(self, bodies: Bodies, p_world_eye_m: Vec3, t_s: float) -> Pulls:
        """Give the smoothed pulls of all bodies, in their order.

        Speeds across and along the line of view are divided by the distance, so that
        they are the rates of the retinal image.
        """
        rel = bodies.p_world_m - np.asarray(p_world_eye_m)
        distance = np.maximum(_length(rel), 0.05)
        raw = slide_loom_spin(bodies.v_world_m_s, bodies.w_world_rad_s, rel)
        par = self._params
        now = np.empty((len(bodies), 3))
        now[:, 0] = raw.slide / (distance * par.slide_rad_s)
        now[:, 1] = raw.loom / (distance * par.loom_1_s)
        now[:, 2] = raw.spin / par.spin_rad_s
        return self._low_pass(bodies.ids, now, t_s)

    def _low_pass(self, ids: tuple[int, ...], now: Floats, t_s: float) -> Pulls:
        """Blend each body's terms with its own past; a new body starts from nothing."""
        tau = self._params.smoothing_s
        elapsed = max(0.0, t_s - self._at_s)
        keep = float(np.exp(-elapsed / tau)) if tau > 0.0 else 0.0
        past = np.array([self._smooth.get(i, (0.0, 0.0, 0.0)) for i in ids]).reshape(-1, 3)
        smooth = keep * past + (1.0 - keep) * now
        self._smooth = dict(zip(ids, map(tuple, smooth.tolist()), strict=True))
        self._at_s = t_s
        return Pulls(smooth[:, 0], smooth[:, 1], smooth[:, 2])
