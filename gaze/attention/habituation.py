"""Habituation to the attended body, and inhibition of return.

Habituation, as in Pan et al. 2020 ("Realistic and interactive robot gaze"): a factor h of the
attended body falls, that of the others recovers, and h times the salience is compared. Without it
the gaze stares. It is stored per identity and continues while the body is absent: a person who
returns immediately is not new. Several bodies that one rule selects share the gaze instead
(gazerig.gaze.attention.shared_attention).

Inhibition of return: for a moment the gaze avoids the place it has just left, as in
Ruesch et al. 2008 (a Gaussian about that place that decays).
"""

from collections.abc import Sequence
from math import acos, exp, radians
from typing import NamedTuple

from gazerig.gaze.angles import dot, sub, unit
from gazerig.gaze.attention.params import HabituationParams
from gazerig.gaze.attention.shared_attention import SharedAttention
from gazerig.gaze.types import BodyRows, Vec3


class _LeftPoint(NamedTuple):
    """A point that the gaze has left, and when."""

    p_world_m: Vec3
    at_s: float


class Stay(NamedTuple):
    """A look at one of several bodies: its id, and the additional surplus that it may reach."""

    id: int
    extra_s: float


NO_STAY = Stay(-1, 0.0)
_FEW = 3
"""Number of people up to which looks have an additional time."""


class Habituation:
    """State of habituation of every identity, and the points left."""

    def __init__(self, params: HabituationParams) -> None:
        self._params = params
        self._shared = SharedAttention()
        self.reset(0.0)

    def retune(self, params: HabituationParams) -> None:
        """Change the rates; the state stays."""
        self._params = params

    def reset(self, t_s: float) -> None:
        """Forget all habituation and the points left."""
        # Only factors below 1 are stored: those of bodies attended in the last 1/recovery_rate_1_s
        # seconds, which are few.
        self._habituation: dict[int, float] = {}
        self._left: list[_LeftPoint] = []
        self._shared.reset(t_s)
        self._at_s = t_s

    def record_left(self, p_world_m: Vec3, t_s: float) -> None:
        """Record a point that the gaze has left."""
        if self._params.inhibition_of_return_strength > 0.0:
            self._left.append(_LeftPoint(p_world_m, t_s))

    def step(
        self, rows: BodyRows, p_world_eye_m: Vec3, attended_id: int, t_s: float
    ) -> list[float]:
        """Return the factor 0..1 of each body's salience.

        attended_id: id of the gaze target since the previous step; -1 for none
        """
        self._advance(attended_id, t_s)
        if not self._left:
            return [self._habituation.get(id, 1.0) for id in rows.ids]
        return [
            self._habituation.get(id, 1.0)
            * (1.0 if id == attended_id else self._return_factor(p, p_world_eye_m, t_s))
            for id, p in zip(rows.ids, rows.p_world_m, strict=True)
        ]

    def share(
        self,
        ids: Sequence[int],
        weights: Sequence[float],
        attended_id: int,
        t_s: float,
        stays: Stay = NO_STAY,
    ) -> list[float]:
        """Return the factor 0..1 of each of several bodies that a rule selects.

        A single body keeps 1: habituation does not make the gaze leave a rule's only body.

        Args:
            ids: the bodies that share the gaze.
            weights: weight of each; viewing times are in proportion to them.
            attended_id: id of the gaze target since the previous step; -1 for none.
            t_s: present time, seconds.
            stays: the present look at one of them, and its additional time.
        """
        floor, rate = self._params.rule_floor, self._params.decay_rate_1_s
        if rate == 0.0 or floor == 1.0:
            return [1.0] * len(ids)
        surpluses = self._shared.step(ids, weights, attended_id, t_s)
        extra_s = (
            stays.extra_s if len(ids) <= _FEW else 0.0
        )  # in a larger group everyone gets a look
        extra = [extra_s if id == stays.id else 0.0 for id in ids]
        return [
            floor + (1.0 - floor) * exp(-rate * max(0.0, one - more))
            for one, more in zip(surpluses, extra, strict=True)
        ]

    def _advance(self, attended_id: int, t_s: float) -> None:
        """Update all factors and the points left to the present time."""
        self._habituate(attended_id, max(0.0, t_s - self._at_s))
        self._at_s = t_s
        if self._left:
            lasts_s = 4.0 * self._params.inhibition_of_return_s
            self._left = [one for one in self._left if t_s - one.at_s < lasts_s]

    def _habituate(self, attended_id: int, dt_s: float) -> None:
        """Lower the factor of the attended body and raise those of the rest."""
        risen = self._params.recovery_rate_1_s * dt_s
        attended = self._habituation.pop(attended_id, 1.0)
        self._habituation = {
            id: left + risen for id, left in self._habituation.items() if left + risen < 1.0
        }
        attended = max(0.0, attended - self._params.decay_rate_1_s * dt_s)
        if attended_id >= 0 and attended < 1.0:
            self._habituation[attended_id] = attended

    def _return_factor(self, p_world_m: list[float], p_eye: Vec3, t_s: float) -> float:
        """Return the factor of one body near the points left."""
        par = self._params
        x, y, z = p_world_m
        way = unit(sub((x, y, z), p_eye))
        factor = 1.0
        for left in self._left:
            cosine = dot(way, unit(sub(left.p_world_m, p_eye)))
            sigmas = acos(max(-1.0, min(1.0, cosine))) / radians(par.inhibition_of_return_sigma_deg)
            age = (t_s - left.at_s) / par.inhibition_of_return_s
            factor *= 1.0 - par.inhibition_of_return_strength * exp(-0.5 * sigmas * sigmas - age)
        return factor
