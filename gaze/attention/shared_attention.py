"""How several bodies of one rule share the gaze: each by its weight, and none is left out.

Of several people whom a rule points at, habituation to each by itself forgets within a second who
has not been looked at for half a minute: the two or three nearest would take turns for ever. So
every body has a lead: the time for which it was looked at, divided by its weight, over that of the
body that was looked at least (weighted fair queueing, as schedulers of processes do it). The larger
the lead, the lower the factor. Looks then last the longer the heavier the body is, they are shorter
the more bodies there are, and times are as the weights: the matching law (Herrnstein 1961).
"""

from collections.abc import Sequence
from math import exp
from typing import NamedTuple

_FADES_S = 10.0
"""Time constant with which leads fade: a minute of being looked at is not made up for."""
_LARGEST_S = 5.0
_KEPT_S = 60.0
_FIRST_S = 0.1
"""Of those who come the heaviest is looked at first: a body of weight 0 starts so far ahead."""


class _Lead(NamedTuple):
    """A lead in seconds, and when the body shared the gaze last."""

    lead_s: float
    at_s: float


class SharedAttention:
    """Leads of the bodies that share the gaze."""

    def __init__(self) -> None:
        self.reset(0.0)

    def reset(self, t_s: float) -> None:
        """Forget all bodies."""
        self._leads: dict[int, _Lead] = {}
        self._at_s = t_s

    def step(
        self, ids: Sequence[int], weights: Sequence[float], attended_id: int, t_s: float
    ) -> list[float]:
        """Return the lead of each body in seconds, 0 for the one that was looked at least.

        Args:
            ids: the bodies that share the gaze now. Who joins them is behind nobody.
            weights: of each, above 0; only their ratios matter.
            attended_id: what was looked at since the step before; -1 for nothing.
            t_s: now.
        """
        dt_s, self._at_s = max(0.0, t_s - self._at_s), t_s
        if len(ids) <= 1:
            return [0.0] * len(ids)
        most = max(*weights, 1e-9)
        leads = []
        for id, weight in zip(ids, weights, strict=True):
            share = max(weight / most, 1e-3)
            known = self._leads.get(id)
            if known is None:
                lead = _FIRST_S * (1.0 - share)
            else:
                lead = known.lead_s * exp((known.at_s - t_s) / _FADES_S)
            leads.append(lead + (dt_s / share if id == attended_id else 0.0))
        least = min(leads)
        leads = [min(lead - least, _LARGEST_S) for lead in leads]
        self._leads.update((id, _Lead(lead, t_s)) for id, lead in zip(ids, leads, strict=True))
        if len(self._leads) > 2 * len(ids):
            self._leads = {k: one for k, one in self._leads.items() if t_s - one.at_s < _KEPT_S}
        return leads
