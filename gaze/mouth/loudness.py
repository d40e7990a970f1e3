"""Loudness of speech as a mouth shows it.

Loudness is a power function of the sound pressure with the exponent 0.6 (Stevens 1956, "The direct
estimation of sensory magnitudes: loudness"): 10 dB more are heard as twice as loud. The pressure is
that between 0.5 and 4 kHz. There are the resonances of an open mouth; the murmur of m, the voice
bar of b and most of an s are outside, so that a closed mouth is quiet although its sound is not.
"""

import numpy as np

from gazerig.gaze.types import Floats

FRAME_S = 0.01
"""Time between two values."""
WINDOW_S = 0.02
"""Length of the sound that a value describes, centred at its time."""
_EXPONENT = 0.6
_BAND_HZ = 500.0, 4000.0
_BLOCK = 2000
_SHUT = 10.0 ** (-30.0 / 20.0 * _EXPONENT)
"""Loudness at which the mouth is shut: 30 dB below the loudest parts."""


def band_pressures(samples: Floats, rate_hz: float, first: int = 0) -> Floats:
    """Return the pressure of speech in every frame.

    Args:
        samples: (n,) one channel, -1..1.
        rate_hz: Rate of the samples.
        first: Number of the frame with which the samples begin.

    Returns:
        (n / rate / FRAME_S,) root mean squares, frame 0 centred at WINDOW_S / 2.
    """
    length, begin = round(WINDOW_S * rate_hz), frame_start(first, rate_hz)
    if len(samples) < length:
        return np.zeros(0)
    views = np.lib.stride_tricks.sliding_window_view(samples, length)
    numbers = range(first, first + int(len(samples) / rate_hz / FRAME_S) + 2)
    starts = [frame_start(number, rate_hz) - begin for number in numbers]
    rows = np.array([start for start in starts if start < len(views)])
    taper = np.hanning(length)
    frequencies = np.fft.rfftfreq(length, 1.0 / rate_hz)
    band = (frequencies >= _BAND_HZ[0]) & (frequencies <= _BAND_HZ[1])
    powers = np.concatenate(
        [
            (np.abs(np.fft.rfft(views[rows[i : i + _BLOCK]] * taper, axis=1)[:, band]) ** 2).sum(1)
            for i in range(0, len(rows), _BLOCK)
        ]
    )
    pressures: Floats = np.sqrt(2.0 * powers / (length * (taper**2).sum()))
    return pressures


def frame_start(number: int, rate_hz: float) -> int:
    """Return the first sample of a frame; the length of a frame need not be whole samples."""
    return round(number * FRAME_S * rate_hz)


def opening(pressure: float, loud: float) -> float:
    """Return the opening 0..1 by loudness, 1 at the pressure of the loudest parts."""
    return float(min(max((pressure / loud) ** _EXPONENT - _SHUT, 0.0) / (1.0 - _SHUT), 1.0))
