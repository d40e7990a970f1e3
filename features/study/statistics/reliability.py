"""Consistency of the items of a scale: Cronbach's alpha."""

from math import nan

import numpy as np

from gazerig.features.study.statistics.effects import bootstrap_interval
from gazerig.features.study.statistics.results import EffectSize
from gazerig.gaze.types import Floats


def cronbachs_alpha(answers: Floats) -> EffectSize:
    """Return Cronbach's alpha (1951) of a scale, with its interval over participants.

    Args:
        answers: (participants, items), with reversed items inverted.
    """
    rows = np.asarray(answers, float)
    name = "Cronbach's alpha"
    if rows.ndim != 2 or rows.shape[0] < 2 or rows.shape[1] < 2:
        return EffectSize(name, "α", nan, nan, nan, "none")

    def along(*items: Floats, axis: int = -1) -> Floats:
        return _alpha(np.stack(items))

    interval = bootstrap_interval(list(rows.T), along, paired=True)
    return EffectSize(name, "α", float(_alpha(rows.T)), *interval, "BCa bootstrap")


def _alpha(items: Floats) -> Floats:
    """Return alpha of (items, ..., participants), nan if all sums are equal."""
    k = len(items)
    parts = np.var(items, axis=-1, ddof=1).sum(axis=0)
    whole = np.asarray(np.var(items.sum(axis=0), axis=-1, ddof=1))
    share = np.divide(parts, whole, out=np.full_like(whole, nan), where=whole > 1e-12)
    alpha: Floats = k / (k - 1.0) * (1.0 - share)
    return alpha
