"""Time profiles of motions, for whole arrays of times: from 0 to 1, there and back."""

from collections.abc import Sequence

import numpy as np

from gazerig.gaze.types import Floats


def smooth_rise(share: Floats) -> Floats:
    """Return a minimum-jerk path from 0 to 1 over fractions of its time, constant outside."""
    s = np.clip(share, 0.0, 1.0)
    return np.asarray(s * s * s * (10.0 + s * (6.0 * s - 15.0)))


def there_and_back(
    t_s: Floats, start_s: float, out_s: float, hold_s: float, back_s: float
) -> Floats:
    """Return 0, a smooth rise to 1 within ``out_s`` of the start, a hold, and a smooth fall."""
    down_s = start_s + out_s + hold_s
    return np.asarray(smooth_rise((t_s - start_s) / out_s) - smooth_rise((t_s - down_s) / back_s))


def smooth_bump(share: Floats) -> Floats:
    """Return a smooth bump over fractions 0..1: 0 with zero slope at its ends, 1 in its middle."""
    s = np.clip(share, 0.0, 1.0)
    return np.asarray(16.0 * s * s * (1.0 - s) ** 2)


def moving_average(values: Floats, width: int) -> Floats:
    """Return averages over ``width`` rows with bell-shaped weights; the end values are repeated."""
    if width < 2:
        return values
    bell = np.hanning(width + 2)[1:-1]
    bell /= bell.sum()
    half = width // 2
    flat = values.reshape(len(values), -1)
    padded = np.concatenate(
        (np.repeat(flat[:1], half, 0), flat, np.repeat(flat[-1:], width - 1 - half, 0))
    )
    out = np.stack([np.convolve(column, bell, "valid") for column in padded.T], axis=1)
    return np.asarray(out.reshape(values.shape))


def blend(before: Floats, after: Floats, share: Floats) -> Floats:
    """Return rows interpolated between two, with a fraction per row."""
    part = share.reshape(-1, *([1] * (max(before.ndim, after.ndim) - 1)))
    return np.asarray(before + part * (after - before))


def periodic(
    t_s: Floats, round_s: float, rates_hz: Sequence[float], phases: Sequence[float]
) -> Floats:
    """Return a sum of sines that repeats after the round; rates are rounded to fit it."""
    total = np.zeros_like(t_s)
    for rate_hz, phase in zip(rates_hz, phases, strict=True):
        turns = max(1, round(rate_hz * round_s))
        total = total + np.sin(2.0 * np.pi * turns / round_s * t_s + phase)
    return np.asarray(total / len(rates_hz))
