"""Opening of a mouth from the sound of speech, which may arrive in pieces.

The opening is the loudness in relation to the loudest parts of the last seconds. The lips close on
b, m and p, because a mouth that is open there is the first error that people notice: at the times
of spoken phonemes, or else where the loudness has a short deep dip. The level that opens the mouth
(``gazerig.gaze.track.level``) smooths the openings within what its joint can follow.
"""

from collections import deque
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from gazerig.gaze.mouth.loudness import FRAME_S, WINDOW_S, band_pressures, frame_start, opening
from gazerig.gaze.types import Floats

_SIZE = 0.9
"""Opening at the loudest parts."""
_LOUD_DECAY = float(np.exp(-FRAME_S / 8.0))
"""Decay of the loudest parts, whose time constant is 8 s, in a frame."""
_FIRST_LOUD = 0.02
_DIP_SHARE, _DIP_FRAMES, _DIP_MARGIN = 0.4, 10, 2
_KEY_S = 0.02
_LEAST_CLOSED_S, _LONGEST_CLOSURE_S = 0.08, 0.12
"""A level that is smoothed within 80 ms closes in the shortest closure. Lips part between an m and
the next b; a person holds neither longer than the longest."""
_LEAST_OPEN_S = 0.05
_P_CLOSED_S = 0.055
_CLOSED_SHARE = {"b": 0.5, "m": 0.65}
_LONGEST_S = 1200.0


class Closure(NamedTuple):
    """Time in which the lips are closed, seconds."""

    begin_s: float
    end_s: float


def phoneme_closures(spoken: Sequence[tuple[str, float]], end_s: float) -> tuple[Closure, ...]:
    """Return the closures of spoken phonemes.

    A p is reported at its release, which the closure precedes; b and m begin with it.

    Args:
        spoken: (name, begin in s): phonemes in the names of espeak-ng or IPA.
        end_s: End of the last one.
    """
    closures = []
    for (name, begin_s), (_, next_s) in pairwise([*spoken, ("", end_s)]):
        letter = name[:1].lower()
        if letter == "p":
            closures.append(Closure(max(0.0, begin_s - _P_CLOSED_S), begin_s))
        elif share := _CLOSED_SHARE.get(letter):
            closures.append(Closure(begin_s, begin_s + share * (next_s - begin_s)))
    joined: list[Closure] = []
    for begin_s, last_s in closures:
        if joined and begin_s - joined[-1].end_s < _LEAST_OPEN_S:
            begin_s = joined.pop().begin_s
        joined.append(Closure(max(begin_s, last_s - _LONGEST_CLOSURE_S), last_s))
    return tuple(joined)


class Mouth:
    """Openings of a mouth in the order of the arriving samples.

    Args:
        rate_hz: Rate of the samples.
    """

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._rest: Floats = np.zeros(0)
        self._loud = _FIRST_LOUD
        self._values: deque[float] = deque(maxlen=round(_LONGEST_S / FRAME_S))
        self._count = 0
        self._dips = _DIP_SHARE

    def add(self, samples: Floats) -> None:
        """Add samples (n,) of one channel, -1..1."""
        self._rest = np.concatenate((self._rest, samples))
        pressures = band_pressures(self._rest, self._rate_hz, self._count)
        next_start = frame_start(self._count + len(pressures), self._rate_hz)
        self._rest = self._rest[next_start - frame_start(self._count, self._rate_hz) :]
        for pressure in pressures.tolist():
            self._loud = max(_FIRST_LOUD, pressure, self._loud * _LOUD_DECAY)
            self._values.append(_SIZE * opening(pressure, self._loud))
        self._count += len(pressures)

    def close(self, closures: Iterable[Closure]) -> None:
        """Close the lips at these times of what has been added, instead of in its dips."""
        self._dips = 0.0
        for begin_s, end_s in closures:
            more_s = 0.5 * max(0.0, _LEAST_CLOSED_S - (end_s - begin_s))
            first, last = (
                (at - 0.5 * WINDOW_S) / FRAME_S for at in (begin_s - more_s, end_s + more_s)
            )
            for i in range(max(0, round(first)), min(round(last) + 1, len(self._values))):
                self._values[i] = 0.0

    def opening_at(self, t_s: float) -> float:
        """Return the opening at a time since the beginning; 0 if it is not known."""
        i = round((t_s - 0.5 * WINDOW_S) / FRAME_S) - (self._count - len(self._values))
        if not 0 <= i < len(self._values):
            return 0.0
        first, last = max(0, i - _DIP_FRAMES), min(i + _DIP_FRAMES + 1, len(self._values))
        near = [self._values[j] for j in range(first, last)]
        middle = i - first
        dip = min(near[max(0, middle - _DIP_MARGIN) : middle + _DIP_MARGIN + 1])
        if dip < self._dips * min(max(near[: middle + 1]), max(near[middle:])):
            return 0.0
        around = near[max(0, middle - 1) : middle + 2]
        return sum(around) / len(around)

    def keys(self, end_s: float) -> tuple[tuple[float, float], ...]:
        """Return (time, opening) pairs from the beginning to a time, at which it is shut."""
        times = np.arange(0.0, end_s, _KEY_S).tolist()
        return (*((t_s, self.opening_at(t_s)) for t_s in times), (end_s, 0.0))
