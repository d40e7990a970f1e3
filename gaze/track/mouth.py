"""Opening of a mouth from the sound of speech, which may arrive in pieces.

The opening is the loudness in relation to the loudest parts of the last seconds. Loudness is a
power function of the sound pressure with the exponent 0.6 (Stevens 1956, "The direct estimation of
sensory magnitudes: loudness"): 10 dB more are heard as twice as loud. The pressure is that between
0.5 and 4 kHz. There are the resonances of an open mouth; the murmur of m, the voice bar of b and
most of an s are outside, so that a closed mouth is quiet although its sound is not.

The lips close on b, m and p, because a mouth that is open there is the first error that people
notice: at the times of spoken phonemes, or else where the loudness has a short deep dip. The level
that opens the mouth (``gazerig.gaze.track.animation``) smooths the openings within what its joint
can follow.
"""

from collections.abc import Iterable
from itertools import pairwise

import numpy as np

from gazerig.gaze.types import Floats

FRAME_S = 0.01
"""Time between two values; at some rates a little more or less, as it is whole samples."""
WINDOW_S = 0.02
"""Length of the sound that a value describes, centred at its time."""
_EXPONENT = 0.6
_BAND_HZ = 500.0, 4000.0
_SHUT = 10.0 ** (-30.0 / 20.0 * _EXPONENT)
"""Loudness at which the mouth is shut: 30 dB below the loudest parts."""
_SIZE = 0.9
"""Opening at the loudest parts."""
_LOUD_DECAY = float(np.exp(-FRAME_S / 8.0))
"""Decay of the loudest parts, whose time constant is 8 s, in a frame."""
_FIRST_LOUD = 0.02
_DIP_SHARE, _DIP_FRAMES, _DIP_MARGIN = 0.4, 10, 2
_KEY_S = 0.02
_LEAST_CLOSED_S = 0.08
"""A level that is smoothed within 80 ms closes in the shortest closure."""
_P_CLOSED_S, _B_CLOSED, _M_CLOSED = 0.055, 0.5, 0.65
"""Closure before the release of p in s, and as a share of b and m."""
_BLOCK_S = 10.0


class Mouth:
    """Openings of a mouth in the order of the arriving samples.

    Args:
        rate_hz: Rate of the samples.
    """

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz, self._step = rate_hz, round(FRAME_S * rate_hz)
        self._taper = np.hanning(round(WINDOW_S * rate_hz))
        frequencies = np.fft.rfftfreq(len(self._taper), 1.0 / rate_hz)
        self._band = (frequencies >= _BAND_HZ[0]) & (frequencies <= _BAND_HZ[1])
        self._rest: Floats = np.zeros(0)
        self._loud = _FIRST_LOUD
        self._values: list[float] = []
        self._dips = _DIP_SHARE

    def band_pressures(self, samples: Floats) -> Floats:
        """Return the root mean squares of speech in the frames of sound, -1..1."""
        length = len(self._taper)
        if len(samples) < length:
            return np.zeros(0)
        frames = np.lib.stride_tricks.sliding_window_view(samples, length)[:: self._step]
        spectra = np.fft.rfft(frames * self._taper, axis=1)[:, self._band]
        powers = 2.0 * (np.abs(spectra) ** 2).sum(axis=1) / (length * (self._taper**2).sum())
        return np.asarray(np.sqrt(powers))

    def add(self, samples: Floats) -> None:
        """Add samples (n,) of one channel, -1..1."""
        blocks = 1 + int(len(samples) / self._rate_hz / _BLOCK_S)
        for block in np.array_split(samples, blocks):
            self._rest = np.concatenate((self._rest, block))
            pressures = self.band_pressures(self._rest).tolist()
            self._rest = self._rest[len(pressures) * self._step :]
            for pressure in pressures:
                self._loud = max(_FIRST_LOUD, pressure, self._loud * _LOUD_DECAY)
                share = (pressure / self._loud) ** _EXPONENT
                self._values.append(_SIZE * max(share - _SHUT, 0.0) / (1.0 - _SHUT))

    def close(self, spoken: Iterable[tuple[str, float]], end_s: float) -> None:
        """Close the lips at the phonemes of what has been added, instead of in its dips.

        A p is reported at its release, which the closure precedes; b and m begin with it.

        Args:
            spoken: (name, begin in s): phonemes in the names of espeak-ng or IPA.
            end_s: End of the last one.
        """
        self._dips = 0.0
        for (name, begin_s), (_, next_s) in pairwise([*spoken, ("", end_s)]):
            long_s = next_s - begin_s
            lips_s = {"p": -_P_CLOSED_S, "b": _B_CLOSED * long_s, "m": _M_CLOSED * long_s}
            if (closed_s := lips_s.get(name[:1].lower())) is not None:
                middle_s = begin_s + 0.5 * closed_s
                half_s = 0.5 * max(_LEAST_CLOSED_S, abs(closed_s))
                first, last = self._frame(middle_s - half_s), self._frame(middle_s + half_s)
                for i in range(max(0, first), min(last + 1, len(self._values))):
                    self._values[i] = 0.0

    def _frame(self, t_s: float) -> int:
        return round((t_s - 0.5 * WINDOW_S) * self._rate_hz / self._step)

    def opening_at(self, t_s: float) -> float:
        """Return the opening at a time since the beginning; 0 if it is not known."""
        i = self._frame(t_s)
        if not 0 <= i < len(self._values):
            return 0.0
        before = self._values[max(0, i - _DIP_FRAMES) : i + 1]
        behind = self._values[i : i + _DIP_FRAMES + 1]
        dip = min(before[-_DIP_MARGIN - 1 :] + behind[: _DIP_MARGIN + 1])
        if dip < self._dips * min(max(before), max(behind)):
            return 0.0
        around = before[-2:] + behind[1:2]
        return sum(around) / len(around)

    def keys(self, end_s: float, ahead_s: float = 0.0) -> tuple[tuple[float, float], ...]:
        """Return (time, later opening) pairs from the beginning to a time, at which it is shut."""
        times = np.arange(0.0, end_s, _KEY_S).tolist()
        return (*((t_s, self.opening_at(t_s + ahead_s)) for t_s in times), (end_s, 0.0))
