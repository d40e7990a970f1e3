"""Sway of the head of a speaker: three slow oscillations, larger where the speech is louder.

Heads of speakers move all the time, more with the voice (Hadar et al. 1983). The rates of pitch,
yaw and roll and the ratio of their sizes are those of a shipped conversational robot.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gazerig.gaze.mouth.mouth_keys import MouthKey
from gazerig.gaze.types import Floats

_PART_OF_YAW = {"head_pitch": (2.2, 0.6), "head_yaw": (0.6, 1.0), "head_roll": (1.3, 0.3)}
"""Rate in Hz and size relative to yaw of each axis."""
_AVERAGED_S = 0.5
_LEAST_SHARE = 0.3


class SwayKey(NamedTuple):
    """Offset of one axis of the head at a time."""

    time_s: float
    axis: str
    offset_deg: float


def sway_keys(mouth: Sequence[MouthKey], duration_s: float, size_deg: float) -> tuple[SwayKey, ...]:
    """Return the turning points of the sway, in the order of their times.

    Args:
        mouth: Keys of the mouth, whose mean opening sets the size; without keys it is full.
        duration_s: Time until the head is at rest again.
        size_deg: Largest yaw.
    """
    keys = []
    for axis, (rate_hz, part) in _PART_OF_YAW.items():
        times_s = np.arange(1, int(duration_s * 2.0 * rate_hz)) / (2.0 * rate_hz)
        shares = _loud_shares(mouth, times_s)
        for k, (time_s, share) in enumerate(zip(times_s, shares, strict=True)):
            keys.append(SwayKey(float(time_s), axis, (-1) ** k * part * size_deg * float(share)))
    return tuple(sorted(keys))


def _loud_shares(mouth: Sequence[MouthKey], times_s: Floats) -> Floats:
    """Return the sizes of the sway at times, at most 1."""
    if not mouth:
        return np.ones(len(times_s))
    around_s = times_s[:, None] + np.linspace(-_AVERAGED_S, _AVERAGED_S, 11)
    opening = np.interp(around_s, [key.time_s for key in mouth], [key.opening for key in mouth])
    shares: Floats = np.minimum(1.0, _LEAST_SHARE + 2.0 * opening.mean(axis=1))
    return shares
