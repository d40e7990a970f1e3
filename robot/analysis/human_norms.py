"""Published curves and tables of people, which a trace is compared with."""

import numpy as np
from numpy.typing import ArrayLike

from gazerig.gaze.types import Floats

BAHILL_DEG_S, BALOH_DEG_S, ROUND_DEG = 551.0, 420.0, 14.0
"""Peak speed V (1 - exp(-A / 14 deg)): Bahill et al. 1975 and Baloh et al. 1975."""

COLLEWIJN_DEG_S, COLLEWIJN_ROUND_DEG = 502.0, 11.0
"""Where it saturates beyond 40 deg (Collewijn et al. 1988: 502 +- 32), and how soon."""

STAHL_FREE_DEG, STAHL_FREE_SD_DEG = 17.9, 16.0
"""Half of the range of 35.8 +- 31.9 deg that people cover with the eyes alone (Stahl 1999)."""

STAHL_SLOPE, STAHL_SLOPE_SD = 0.77, 0.16
"""Head movement for each degree beyond that range (Stahl 1999)."""

CONE_DEG = 5.2
"""Diameter of the cone in which a gaze is taken for a direct one (Horstmann & Linke 2021)."""

# Nakamoto & Tsuruno, eq 1 as printed: rows from, columns to, in the order of PARTS.
_PRINTED = (
    (0.2, 0.2, 0.0, 0.4, 0.0, 0.1, 0.0, 0.0),
    (0.1, 0.4, 0.0, 0.2, 0.0, 0.0, 0.1, 0.0),
    (0.0, 0.1, 0.4, 0.0, 0.3, 0.1, 0.2, 0.0),
    (0.3, 0.0, 0.1, 0.3, 0.3, 0.0, 0.1, 0.0),
    (0.0, 0.0, 0.1, 0.1, 0.4, 0.0, 0.3, 0.0),
    (0.1, 0.0, 0.0, 0.0, 0.1, 0.3, 0.4, 0.1),
    (0.0, 0.0, 0.1, 0.0, 0.2, 0.2, 0.3, 0.2),
    (0.0, 0.2, 0.0, 0.0, 0.1, 0.0, 0.3, 0.3),
)
DWELL_MEAN_S = (0.19, 0.24, 0.11, 0.19, 0.16, 0.20, 0.20, 0.11)
"""Nakamoto & Tsuruno, table 1, in the order of PARTS."""
DWELL_SD_S = (0.35, 0.25, 0.14, 0.22, 0.30, 0.30, 0.38, 0.15)


def matrix() -> Floats:
    """Return Nakamoto & Tsuruno's eq 1 with every row summing to 1, (8, 8), rows from."""
    printed = np.array(_PRINTED)
    out: Floats = printed / printed.sum(axis=1, keepdims=True)
    return out


def visit_matrix(steps: Floats) -> Floats:
    """Return the chain of visits of a chain of steps: without staying, (n, n)."""
    away = steps * (1.0 - np.eye(len(steps)))
    total = away.sum(axis=1, keepdims=True)
    out: Floats = np.divide(away, total, out=np.zeros_like(away), where=total > 0.0)
    return out


def stationary(steps: Floats) -> Floats:
    """Return the share of steps that a chain spends in each of its states, (n,)."""
    values, vectors = np.linalg.eig(steps.T)
    share = np.real(vectors[:, np.argmin(np.abs(values - 1.0))])
    out: Floats = share / share.sum()
    return out


def time_share(steps: Floats, dwell_s: ArrayLike) -> Floats:
    """Return the share of time in each state when a step in it lasts for ``dwell_s``, (n,)."""
    time = stationary(steps) * np.asarray(dwell_s)
    out: Floats = time / time.sum()
    return out


def visit_s(steps: Floats, dwell_s: ArrayLike) -> Floats:
    """Return the mean length of a visit, its refixations merged, (n,)."""
    out: Floats = np.asarray(dwell_s) / (1.0 - np.diag(steps))
    return out


def slowest_peak(amplitude_deg: ArrayLike) -> Floats:
    """Return the lower edge of human peak speeds: Baloh's curve less 15 % between people."""
    a = np.asarray(amplitude_deg, dtype=float)
    out: Floats = 0.85 * BALOH_DEG_S * (1.0 - np.exp(-a / ROUND_DEG))
    return out


def fastest_peak(amplitude_deg: ArrayLike) -> Floats:
    """Return the upper edge: the higher of Bahill's and Collewijn's curves and 15 %."""
    a = np.asarray(amplitude_deg, dtype=float)
    bahill = BAHILL_DEG_S * (1.0 - np.exp(-a / ROUND_DEG))
    collewijn = COLLEWIJN_DEG_S * (1.0 - np.exp(-a / COLLEWIJN_ROUND_DEG))
    out: Floats = 1.15 * np.maximum(bahill, collewijn)
    return out


def shortest_ms(amplitude_deg: ArrayLike) -> Floats:
    """Return the lower edge of human durations, 21 ms + 2.2 ms a degree less a quarter."""
    out: Floats = 0.75 * (21.0 + 2.2 * np.asarray(amplitude_deg, dtype=float))
    return out


def longest_ms(amplitude_deg: ArrayLike) -> Floats:
    """Return the upper edge of human durations.

    The higher of 25 ms + 2.4 ms a degree (Lee, Badler & Badler 2002) and a quarter, and the mean of
    Baloh et al. 1975, 37 ms + 2.7 ms a degree.
    """
    a = np.asarray(amplitude_deg, dtype=float)
    out: Floats = np.maximum(1.25 * (25.0 + 2.4 * a), 37.0 + 2.7 * a)
    return out


def peak_at(amplitude_deg: ArrayLike) -> Floats:
    """Return the share of acceleration: .45 up to 10 deg, .20 from 50 (Collewijn et al. 1988)."""
    over = (np.asarray(amplitude_deg, dtype=float) - 10.0) / 40.0
    out: Floats = 0.45 - 0.25 * np.clip(over, 0.0, 1.0)
    return out


def head_deg(eccentricity_deg: ArrayLike) -> Floats:
    """Return the mean head movement for a gaze shift (Stahl 1999)."""
    beyond = np.abs(np.asarray(eccentricity_deg, dtype=float)) - STAHL_FREE_DEG
    out: Floats = STAHL_SLOPE * np.maximum(0.0, beyond)
    return out


def evoked_blink(amplitude_deg: ArrayLike) -> Floats:
    """Return the chance of a blink with a gaze shift: .5 at 17, .97 at 33 deg (Evinger 1994)."""
    a = np.asarray(amplitude_deg, dtype=float)
    out: Floats = 1.0 / (1.0 + np.exp(-0.217 * (a - 17.0)))
    return out
