"""How smoothly the gaze follows what moves: gain and lag between saccades."""

import numpy as np

from gazerig.gaze.types import Floats
from gazerig.robot.report.eye_head import rate, stretches
from gazerig.robot.report.gaze_trace import PHASES, GazeTrace
from gazerig.robot.report.statistics import MeasuredValue, longest, median

SLOWEST_DEG_S, FASTEST_DEG_S = 5.0, 40.0
_STRETCH_S = 0.15
_WINDOW_S = 10.0
_LOWEST_HZ, _HIGHEST_HZ, _COHERENT = 0.08, 1.0, 0.6


def followed(run: GazeTrace) -> Floats:
    """Return (n, 3) target speed in deg/s, gain, and lag in ms: one row a stretch."""
    t = run.column("t")
    if len(t) < 20:
        return np.zeros((0, 3))
    at = np.column_stack([run.column("target_yaw_rate"), run.column("target_pitch_rate")])
    gaze = np.column_stack([rate(t, run.column("gaze_yaw")), rate(t, run.column("gaze_pitch"))])
    error = np.column_stack(
        [
            run.column("target_yaw") - run.column("gaze_yaw"),
            run.column("target_pitch") - run.column("gaze_pitch"),
        ]
    )
    speed = np.hypot(at[:, 0], at[:, 1])
    mask = run.slow(0.02, 0.06) & (speed > SLOWEST_DEG_S) & (speed < FASTEST_DEG_S)
    rows = []
    for part in stretches(mask, t, run.column("shift"), _STRETCH_S):
        power = float((at[part] ** 2).sum())
        gain = float((gaze[part] * at[part]).sum()) / power
        lag = float((error[part] * at[part]).sum()) / power
        rows.append((float(speed[part].mean()), gain, 1e3 * lag))
    return np.array(rows).reshape(-1, 3)


def response(run: GazeTrace) -> Floats:
    """Return (n, 3) frequency in Hz, gain, and phase in deg of the slow gaze against its target.

    By cross spectra of both speeds, sideways; what saccades did is bridged. Only where the
    two go together: a frequency that the target does not have tells nothing.
    """
    from scipy import signal  # nearly a second of processor, which other commands need not wait for

    t, clear = run.column("t"), run.slow()
    rate_hz = run.rate_hz
    window = int(_WINDOW_S * rate_hz)
    if len(t) < max(20, 2 * window) or clear.sum() < window:
        return np.zeros((0, 3))
    even = np.arange(t[0], t[-1], 1.0 / rate_hz)
    gaze = np.interp(even, t[clear], rate(t, run.column("gaze_yaw"))[clear])
    target = np.interp(even, t, run.column("target_yaw_rate"))
    f, cross = signal.csd(target, gaze, rate_hz, nperseg=window)
    _, power = signal.welch(target, rate_hz, nperseg=window)
    _, coherent = signal.coherence(target, gaze, rate_hz, nperseg=window)
    here = (f >= _LOWEST_HZ) & (f <= _HIGHEST_HZ) & (coherent > _COHERENT)
    transfer = cross[here] / power[here]
    return np.column_stack([f[here], np.abs(transfer), np.degrees(np.angle(transfer))])


def smooth_speeds(run: GazeTrace) -> Floats:
    """Return (n,) how fast the gaze was at the most in each stretch of smooth following."""
    t = run.column("t")
    if len(t) < 20:
        return np.zeros(0)
    speed = np.hypot(rate(t, run.column("gaze_yaw")), rate(t, run.column("gaze_pitch")))
    mask = run.slow(0.03, 0.08) & (run.column("phase") == PHASES.index("pursue"))
    flying = np.flatnonzero(run.column("phase") == PHASES.index("saccade"))
    since = np.searchsorted(flying, np.arange(len(t)), side="right") - 1
    # What is planned arrives later at the joints, and small saccades are not found by their speed.
    mask &= (since < 0) | (t - t[flying[np.maximum(since, 0)]] > 0.08) if len(flying) else True
    parts = stretches(mask, t, run.column("shift"), _STRETCH_S)
    return np.array([speed[part].max() for part in parts])


def measures(run: GazeTrace) -> list[MeasuredValue]:
    """Return what there is to say about following."""
    rows, smooth = followed(run), smooth_speeds(run)
    return [
        MeasuredValue("pursuit_gain", rows[:, 1], median),
        MeasuredValue("pursuit_lag", rows[:, 2], median),
        MeasuredValue("pursuit_most", response(run)[:, 1], longest),
        MeasuredValue("smooth_peak", smooth, longest),
    ]
