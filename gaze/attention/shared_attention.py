"""Shared attention: the bodies of one rule share the gaze by their weights.

With habituation alone, the two or three nearest of several people would alternate permanently, as
each recovers within a second, and a person who was not looked at for half a minute gains nothing
more. So every body has a
surplus: its viewing time divided by its weight, minus that of the least viewed body (weighted fair
queueing, as in process schedulers). The larger the surplus, the lower the factor. Looks then last
longer for heavier bodies, are shorter for more bodies, and total times are in proportion to the
weights: the matching law (Herrnstein 1961).
"""

from collections.abc import Sequence
from math import exp
from typing import NamedTuple

_FADES_S = 10.0
"""Time constant with which a surplus decays: a minute of looks need not be compensated."""
_LARGEST_S = 8.0
_KEPT_S = 60.0
_FIRST_S = 0.1
"""Initial surplus of a body of weight 0, so that the heaviest of several new bodies comes first."""


class _Surplus(NamedTuple):
    """A surplus in seconds, and the body's last time in the group."""

    surplus_s: float
    at_s: float


class SharedAttention:
    """Surpluses of the bodies that share the gaze."""

    def __init__(self) -> None:
        self.reset(0.0)

    def reset(self, t_s: float) -> None:
        """Forget all bodies."""
        self._surpluses: dict[int, _Surplus] = {}
        self._at_s = t_s

    def step(
        self, ids: Sequence[int], weights: Sequence[float], attended_id: int, t_s: float
    ) -> list[float]:
        """Return the surplus of each body in seconds, 0 for the least viewed one.

        Args:
            ids: the bodies that share the gaze now. A new one starts without a deficit.
            weights: weight of each, above 0; only their ratios matter.
            attended_id: the target since the last step; -1 for none.
            t_s: present time, seconds.
        """
        dt_s, self._at_s = max(0.0, t_s - self._at_s), t_s
        if len(ids) <= 1:
            return [0.0] * len(ids)
        most = max(*weights, 1e-9)
        surpluses = []
        for id, weight in zip(ids, weights, strict=True):
            share = max(weight / most, 1e-3)
            known = self._surpluses.get(id)
            if known is None:
                surplus = _FIRST_S * (1.0 - share)
            else:
                surplus = known.surplus_s * exp((known.at_s - t_s) / _FADES_S)
            surpluses.append(surplus + (dt_s / share if id == attended_id else 0.0))
        least = min(surpluses)
        surpluses = [min(surplus - least, _LARGEST_S) for surplus in surpluses]
        self._surpluses.update(
            (id, _Surplus(surplus, t_s)) for id, surplus in zip(ids, surpluses, strict=True)
        )
        if len(self._surpluses) > 2 * len(ids):
            self._surpluses = {
                k: one for k, one in self._surpluses.items() if t_s - one.at_s < _KEPT_S
            }
        return surpluses
