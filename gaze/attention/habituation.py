"""Habituation to the attended body, inhibition of return, and sharing of the gaze.

Habituation, as in Pan et al. 2020 ("Realistic and interactive robot gaze"): a factor h of the
attended body falls, that of the others recovers, and h times the salience is compared. Without it
the gaze stares. It is stored per identity and continues while the body is absent: a person who
returns immediately is not new.

Inhibition of return: for a moment the gaze avoids the place it has just left, as in
Ruesch et al. 2008 (a Gaussian about that place that decays).

Several bodies that one rule selects share the gaze instead. With habituation alone, the two or
three nearest of several people would alternate permanently, as each recovers within a second, and a
person who was not looked at for half a minute gains nothing more. So every body has a surplus: its
viewing time divided by its weight, minus that of the least viewed body (weighted fair queueing, as
in process schedulers). The larger the surplus, the lower the factor. Looks then last longer for
heavier bodies, are shorter for more bodies, and total times are in proportion to the weights: the
matching law (Herrnstein 1961).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import acos, exp, radians
from typing import Annotated, Literal, NamedTuple

import numpy as np

from gazerig.gaze.angles import dot, sub, unit
from gazerig.gaze.draws import draw_lognormal
from gazerig.gaze.types import BodyRows, Vec3
from gazerig.params import Bounds

_RECOVERY_1_S = 1.0
"""Rate at which the factors of all other bodies recover to 1."""
_RETURN, _RETURN_RAD, _RETURN_S = 0.5, radians(4.0), 1.5
"""Inhibition of return: strength, standard deviation around the point, time constant of decay."""

_STAY_S, _STAY_SPREAD = 2.0, 1.2
"""Mean of the random additional time of each look at one of several people, and its standard
deviation / mean: many short looks and some long ones.
"""
_LONGEST_STAY_S = 6.0  # beyond 15 s on one face a look is a stare
_STAYS_S, _FEW = 0.6, 3
"""Additional time of every look, and number of people up to which it has a random one as well; in a
larger group everyone gets a look.
"""

_FADES_S = 10.0
"""Time constant with which a surplus decays: a minute of looks need not be compensated."""
_LARGEST_S = 8.0
_KEPT_S = 60.0
_FIRST_S = 0.1
"""Initial surplus of a body of weight 0, so that the heaviest of several new bodies comes first."""


@dataclass(frozen=True)
class HabituationParams:
    """Rate of habituation, and its effect among several targets of a rule."""

    # fmt: off
    decay_rate_1_s: Annotated[float, Bounds(0, 10),
        "rate at which the salience factor of the present target decreases from 1; 0: never"] = 0.2
    rule_floor: Annotated[float, Bounds(0, 1),
        "lowest salience factor of one of several targets of a rule; lower: the gaze changes sooner between people"] = 0.0
    # fmt: on


class _LeftPoint(NamedTuple):
    """A point that the gaze has left, and when."""

    p_world_m: Vec3
    at_s: float


class _Surplus(NamedTuple):
    """A surplus in seconds, and the body's last time in the group."""

    surplus_s: float
    at_s: float


class Habituation:
    """State of habituation of every identity, the points left, and the shares of the gaze.

    Args:
        params: the rates; "none": neither habituation nor inhibition of return.
        rng: draws the additional times of looks at one of several bodies.
    """

    def __init__(
        self, params: HabituationParams | Literal["none"], rng: np.random.Generator
    ) -> None:
        self.params = params
        self._rng = rng
        self.reset(0.0)

    def reset(self, t_s: float) -> None:
        """Forget all habituation and the points left."""
        # Only factors below 1 are stored: those of bodies attended in the last second, which are
        # few.
        self._habituation: dict[int, float] = {}
        self._left: list[_LeftPoint] = []
        self._surpluses: dict[int, _Surplus] = {}
        self.stays_at, self._stay_s = -1, 0.0
        self._at_s = self._shared_s = t_s

    def record_left(self, p_world_m: Vec3, t_s: float) -> None:
        """Record a point that the gaze has left."""
        if self.params != "none":
            self._left.append(_LeftPoint(p_world_m, t_s))

    def start_stay(self, id: int) -> None:
        """Draw the additional time of a look, if it is at another one of several bodies."""
        if id != self.stays_at:
            drawn_s = draw_lognormal(self._rng, _STAY_S, _STAY_SPREAD)
            self._stay_s = min(drawn_s, _LONGEST_STAY_S)
            self.stays_at = id

    def step(
        self, rows: BodyRows, p_world_eye_m: Vec3, attended_id: int, t_s: float
    ) -> dict[int, float]:
        """Return the factor 0..1 of each body's salience by its id.

        attended_id: id of the gaze target since the previous step; -1 for none
        """
        par, dt_s, self._at_s = self.params, max(0.0, t_s - self._at_s), t_s
        if isinstance(par, str):
            return dict.fromkeys(rows.ids, 1.0)
        # The factor of the attended body falls, those of the rest rise.
        risen = _RECOVERY_1_S * dt_s
        attended = max(0.0, self._habituation.pop(attended_id, 1.0) - par.decay_rate_1_s * dt_s)
        self._habituation = {
            id: left + risen for id, left in self._habituation.items() if left + risen < 1.0
        }
        if attended_id >= 0 and attended < 1.0:
            self._habituation[attended_id] = attended
        self._left = [one for one in self._left if t_s - one.at_s < 4.0 * _RETURN_S]
        return {
            id: self._habituation.get(id, 1.0)
            * (1.0 if id == attended_id else self._return_factor(p, p_world_eye_m, t_s))
            for id, p in zip(rows.ids, rows.p_world_m, strict=True)
        }

    def share(self, weights: Mapping[int, float], attended_id: int, t_s: float) -> dict[int, float]:
        """Return the factor 0..1 of each of several bodies that a rule selects.

        A single body keeps 1: habituation does not make the gaze leave a rule's only body.

        Args:
            weights: weight of each by its id; viewing times are in proportion to them.
            attended_id: id of the gaze target since the previous step; -1 for none.
            t_s: present time, seconds.
        """
        par = self.params
        if isinstance(par, str):
            return dict.fromkeys(weights, 1.0)
        surpluses = self.surpluses(weights, attended_id, t_s)
        if self.stays_at in weights:
            surpluses[self.stays_at] -= _STAYS_S + (self._stay_s if len(weights) <= _FEW else 0.0)
        return {
            id: par.rule_floor + (1.0 - par.rule_floor) * exp(-par.decay_rate_1_s * max(0.0, one))
            for id, one in surpluses.items()
        }

    def surpluses(
        self, weights: Mapping[int, float], attended_id: int, t_s: float
    ) -> dict[int, float]:
        """Return the surplus of each body in seconds, 0 for the least viewed one.

        Args:
            weights: weight of each body that shares the gaze now, above 0; only their ratios
                matter. A new body starts without a deficit.
            attended_id: the target since the last step; -1 for none.
            t_s: present time, seconds.
        """
        dt_s, self._shared_s = max(0.0, t_s - self._shared_s), t_s
        if len(weights) <= 1:
            return dict.fromkeys(weights, 0.0)
        most = max(*weights.values(), 1e-9)
        surpluses = {}
        for id, weight in weights.items():
            share = max(weight / most, 1e-3)
            known = self._surpluses.get(id)
            if known is None:
                surplus = _FIRST_S * (1.0 - share)
            else:
                surplus = known.surplus_s * exp((known.at_s - t_s) / _FADES_S)
            surpluses[id] = surplus + (dt_s / share if id == attended_id else 0.0)
        least = min(surpluses.values())
        surpluses = {id: min(one - least, _LARGEST_S) for id, one in surpluses.items()}
        self._surpluses |= {id: _Surplus(one, t_s) for id, one in surpluses.items()}
        self._surpluses = {k: one for k, one in self._surpluses.items() if t_s - one.at_s < _KEPT_S}
        return surpluses

    def _return_factor(self, p_world_m: Vec3, p_eye: Vec3, t_s: float) -> float:
        """Return the factor of one body near the points left."""
        way, factor = unit(sub(p_world_m, p_eye)), 1.0
        for left in self._left:
            cosine = dot(way, unit(sub(left.p_world_m, p_eye)))
            sigmas = acos(max(-1.0, min(1.0, cosine))) / _RETURN_RAD
            age = (t_s - left.at_s) / _RETURN_S
            factor *= 1.0 - _RETURN * exp(-0.5 * sigmas * sigmas - age)
        return factor
