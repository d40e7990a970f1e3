"""Smooth pursuit of moving targets: gain and lag between saccades."""

from math import nan

import numpy as np
from numpy.typing import NDArray

from gazerig.features.lab.report.eye_head import angular_rates, stable_stretches
from gazerig.features.lab.report.gaze_trace import PHASES, GazeTrace
from gazerig.features.lab.report.statistics import MeasuredValue, longest, median
from gazerig.gaze.types import Floats

SLOWEST_DEG_S, FASTEST_DEG_S = 5.0, 40.0
_STRETCH_S = 0.15
_WINDOW_S = 10.0
_LOWEST_HZ, _HIGHEST_HZ, _COHERENT = 0.08, 1.0, 0.6


def pursuit_stretches(run: GazeTrace) -> Floats:
    """Return (n, 3) target speed in deg/s, gain, and lag in ms: one row a stretch."""
    t = run.column("t")
    if len(t) < 20:
        return np.zeros((0, 3))
    at = run.columns("target_yaw_rate", "target_pitch_rate")
    gaze = np.column_stack(
        [angular_rates(t, run.column("gaze_yaw")), angular_rates(t, run.column("gaze_pitch"))]
    )
    error = run.columns("target_yaw", "target_pitch") - run.columns("gaze_yaw", "gaze_pitch")
    speed = np.hypot(at[:, 0], at[:, 1])
    mask = run.slow(0.02, 0.06) & (speed > SLOWEST_DEG_S) & (speed < FASTEST_DEG_S)
    rows = []
    for part in stable_stretches(mask, t, run.column("shift"), _STRETCH_S):
        power = float((at[part] ** 2).sum())
        gain = float((gaze[part] * at[part]).sum()) / power
        lag = float((error[part] * at[part]).sum()) / power
        rows.append((float(speed[part].mean()), gain, 1e3 * lag))
    return np.array(rows).reshape(-1, 3)


def speed_spectra(run: GazeTrace) -> tuple[Floats, Floats]:
    """Return frequencies (k,) in Hz, and (n, 4 k) spectra of both sideways speeds, by window.

    Columns: cross spectrum of target and slow gaze, real and imaginary, power of the target, power
    of the gaze; saccades are bridged. Windows of 10 s overlap by half.
    """
    t, clear = run.column("t"), run.slow()
    rate_hz = run.rate_hz
    window = int(_WINDOW_S * rate_hz)
    if len(t) < max(20, 2 * window) or clear.sum() < window:
        return np.zeros(0), np.zeros((0, 0))
    even = np.arange(t[0], t[-1], 1.0 / rate_hz)
    gaze = np.interp(even, t[clear], angular_rates(t, run.column("gaze_yaw"))[clear])
    target = np.interp(even, t, run.column("target_yaw_rate"))
    every_hz = np.arange(window // 2 + 1, dtype=np.float64) * (rate_hz / window)
    here = (every_hz >= _LOWEST_HZ) & (every_hz <= _HIGHEST_HZ)
    bell = np.hanning(window)
    rows = []
    for first in range(0, len(even) - window + 1, window // 2):
        part = slice(first, first + window)
        x, y = (np.fft.rfft(bell * (v[part] - v[part].mean()))[here] for v in (target, gaze))
        cross = np.conj(x) * y
        rows.append(np.concatenate([cross.real, cross.imag, np.abs(x) ** 2, np.abs(y) ** 2]))
    every = np.array(rows)
    whole: Floats = every[np.isfinite(every).all(axis=1)]
    return every_hz[here], whole


def pursuit_response(run: GazeTrace) -> Floats:
    """Return (n, 3) frequency in Hz, gain, and phase in deg of the slow gaze against its target.

    Only coherent frequencies are returned: a frequency without target motion has no response.
    """
    f, rows = speed_spectra(run)
    if not len(rows):
        return np.zeros((0, 3))
    transfer, coherent = _transfer(rows)
    here = coherent > _COHERENT
    return np.column_stack([f, np.abs(transfer), np.degrees(np.angle(transfer))])[here]


def highest_gain(rows: Floats) -> float:
    """Return the largest coherent gain of (n, 4 k) spectra, nan without coherent frequencies."""
    transfer, coherent = _transfer(rows)
    gains = np.abs(transfer[coherent > _COHERENT])
    return float(gains.max()) if len(gains) else nan


def _transfer(rows: Floats) -> tuple[NDArray[np.complex128], Floats]:
    """Return the transfer function (k,) and the coherence (k,) of the windows together."""
    real, imaginary, target, gaze = rows.sum(axis=0).reshape(4, -1)
    cross = real + 1j * imaginary
    most = np.maximum(target * gaze, 1e-30)
    return cross / np.maximum(target, 1e-15), np.abs(cross) ** 2 / most


def smooth_speeds(run: GazeTrace) -> Floats:
    """Return (n,) the highest speed of the gaze in each stretch of smooth pursuit."""
    t = run.column("t")
    if len(t) < 20:
        return np.zeros(0)
    speed = np.hypot(
        angular_rates(t, run.column("gaze_yaw")), angular_rates(t, run.column("gaze_pitch"))
    )
    mask = run.slow(0.03, 0.08) & (run.column("phase") == PHASES.index("pursue"))
    flying = np.flatnonzero(run.column("phase") == PHASES.index("saccade"))
    since = np.searchsorted(flying, np.arange(len(t)), side="right") - 1
    # Plans reach the joints later, and the speed criterion misses small saccades.
    mask &= (since < 0) | (t - t[flying[np.maximum(since, 0)]] > 0.08) if len(flying) else True
    parts = stable_stretches(mask, t, run.column("shift"), _STRETCH_S)
    return np.array([speed[part].max() for part in parts])


def measures(run: GazeTrace) -> list[MeasuredValue]:
    """Return the measures of pursuit."""
    rows, smooth = pursuit_stretches(run), smooth_speeds(run)
    return [
        MeasuredValue("pursuit_gain", rows[:, 1], median),
        MeasuredValue("pursuit_lag", rows[:, 2], median),
        MeasuredValue(
            "pursuit_most", speed_spectra(run)[1], highest_gain, count=len(pursuit_response(run))
        ),
        MeasuredValue("smooth_peak", smooth, longest),
    ]
