"""Blinks of a whole run, separated from the lids' motion with the gaze.

Upper lids move up and down with the eyes. A gaze shift with a blink also moves the lids to another
opening. So a blink found in the opening itself would begin with the shift rather than at its own
onset, or never end because the lid does not return to its old opening. The share of the opening of
lids at rest with the same gaze has neither fault.
"""

import numpy as np

from gazerig.features.lab.analysis.blink_finder import BlinkEvent, BlinkFinder
from gazerig.gaze.types import Floats

_BIN_DEG = 2.0
_LEAST_SHARE = 0.002
"""Least share of samples near a gaze for an estimate of the lids' opening at rest."""

_LEAST_OPEN = 0.15
_GAP_S = 0.1


def resting_opening(opening: Floats, pitch_deg: Floats) -> Floats:
    """Return (n,) the opening of the lids without blinks, estimated from the run.

    Args:
        opening: (n,) of the upper lids, 0 shut .. 1 open.
        pitch_deg: (n,) of the eyes in the head, + up.
    """
    bins = np.floor(pitch_deg / _BIN_DEG).astype(int)
    bins -= bins.min()
    counts = np.bincount(bins)
    often = np.flatnonzero(counts >= max(1.0, _LEAST_SHARE * len(opening)))
    order = np.argsort(bins, kind="stable")
    pieces = np.split(order, np.cumsum(counts)[:-1])
    # Lids are shut for less than half of the time, whatever the gaze.
    rest = [float(np.median(opening[pieces[at]])) for at in often]
    middle = [float(np.median(pitch_deg[pieces[at]])) for at in often]
    return np.asarray(np.interp(pitch_deg, middle, rest))


def blinks_of(t_s: Floats, opening: Floats, pitch_deg: Floats) -> tuple[BlinkEvent, ...]:
    """Return the blinks of a run; depths and speeds are shares of the opening at rest.

    Args:
        t_s: (n,) times.
        opening: (n,) the wider one of both upper lids, 0 shut .. 1 open; nan without lids.
        pitch_deg: (n,) of the eyes in the head, + up.
    """
    known = np.isfinite(opening) & np.isfinite(pitch_deg)
    if not known.any():
        return ()
    t_s, opening, pitch_deg = t_s[known], opening[known], pitch_deg[known]
    share = opening / np.maximum(resting_opening(opening, pitch_deg), _LEAST_OPEN)
    finder, found, last_s = BlinkFinder(), [], float(t_s[0])
    for now_s, one in zip(t_s.tolist(), share.tolist(), strict=True):
        if now_s - last_s > _GAP_S:
            finder.clear()
        last_s = now_s
        blink = finder.update(now_s, one, one)
        if blink is not None:
            found.append(blink)
    return tuple(found)
