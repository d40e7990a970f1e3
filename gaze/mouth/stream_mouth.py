"""Mouth of a stream of speech, whose loudness is known only a moment ahead."""

from collections import deque

import numpy as np

from gazerig.gaze.mouth.loudness import (
    FRAME_S,
    WINDOW_S,
    band_pressures,
    frame_start,
    openings,
)
from gazerig.gaze.types import Floats

_LOUD_DECAY_S = 8.0
_FIRST_LOUD = 0.02
_KEPT = 1000
_DIP_SHARE, _DIP_FRAMES = 0.4, 10


class StreamMouth:
    """Openings of a mouth in the order of the arriving samples.

    The loudest parts are those of the last seconds.

    Args:
        rate_hz: Rate of the samples.
    """

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._rest: Floats = np.zeros(0)
        self._loud = _FIRST_LOUD
        self._values: deque[float] = deque(maxlen=_KEPT)
        self._count = 0

    def add(self, samples: Floats) -> None:
        """Add samples (n,) of one channel, -1..1."""
        self._rest = np.concatenate((self._rest, samples))
        pressures = band_pressures(self._rest, self._rate_hz, self._count)
        next_start = frame_start(self._count + len(pressures), self._rate_hz)
        self._rest = self._rest[next_start - frame_start(self._count, self._rate_hz) :]
        decay = np.exp(-FRAME_S / _LOUD_DECAY_S)
        for pressure in pressures:
            self._loud = max(_FIRST_LOUD, float(pressure), self._loud * decay)
            self._values.append(float(openings(np.array([pressure]), self._loud)[0]))
        self._count += len(pressures)

    def opening_at(self, t_s: float) -> float:
        """Return the opening at a time since the stream's start; 0 if it is not known.

        Short dips between louder parts, as on b, m and p, are closed.
        """
        i = round((t_s - 0.5 * WINDOW_S) / FRAME_S) - (self._count - len(self._values))
        if not 0 <= i < len(self._values):
            return 0.0
        near = [
            self._values[j]
            for j in range(i - _DIP_FRAMES, i + _DIP_FRAMES + 1)
            if 0 <= j < len(self._values)
        ]
        middle = min(i, _DIP_FRAMES)
        before, after = max(near[: middle + 1]), max(near[middle:])
        if near[middle] < _DIP_SHARE * min(before, after):
            return 0.0
        around = near[max(0, middle - 1) : middle + 2]
        return sum(around) / len(around)
