"""Published curves and tables of people, and measures with the range of people.

The ranges are published means with their spread, not targets. If a model of this robot differs on
purpose, a note explains it; the verdict stays the same.
"""

from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from gazerig.config.schema import load_walk
from gazerig.gaze.scanpath.scanpath import normalise
from gazerig.gaze.types import Floats

BAHILL_DEG_S, BALOH_DEG_S, ROUND_DEG = 551.0, 420.0, 14.0
"""Peak speed V (1 - exp(-A / 14 deg)): Bahill et al. 1975 and Baloh et al. 1975."""

COLLEWIJN_DEG_S, COLLEWIJN_ROUND_DEG = 502.0, 11.0
"""Saturation beyond 40 deg (Collewijn et al. 1988: 502 +- 32), and its amplitude scale."""

STAHL_FREE_DEG, STAHL_FREE_SD_DEG = 17.9, 16.0
"""Half of the range of 35.8 +- 31.9 deg that people cover with the eyes alone (Stahl 1999)."""

STAHL_SLOPE, STAHL_SLOPE_SD = 0.77, 0.16
"""Head movement per degree beyond that range (Stahl 1999)."""

CONE_DEG = 5.2
"""Diameter of the cone in which a gaze appears direct (Horstmann & Linke 2021)."""

_WALK = load_walk("nakamoto_tsuruno")
"""Nakamoto & Tsuruno, eq 1 and table 1, in the order of PARTS."""
DWELL_MEAN_S = _WALK.dwell_mean_s


def transition_matrix() -> Floats:
    """Return Nakamoto & Tsuruno's eq 1 with every row summing to 1, (8, 8), rows from."""
    return normalise(_WALK.matrix)


def visit_matrix(steps: Floats) -> Floats:
    """Return the Markov chain of visits for a chain of steps, without self-transitions, (n, n)."""
    away = steps * (1.0 - np.eye(len(steps)))
    total = away.sum(axis=1, keepdims=True)
    out: Floats = np.divide(away, total, out=np.zeros_like(away), where=total > 0.0)
    return out


def stationary_shares(steps: Floats) -> Floats:
    """Return the share of steps that a chain spends in each of its states, (n,)."""
    values, vectors = np.linalg.eig(steps.T)
    share = np.real(vectors[:, np.argmin(np.abs(values - 1.0))])
    out: Floats = share / share.sum()
    return out


def time_share(steps: Floats, dwell_s: ArrayLike) -> Floats:
    """Return the share of time in each state if a step in it lasts ``dwell_s``, (n,)."""
    time = stationary_shares(steps) * np.asarray(dwell_s)
    out: Floats = time / time.sum()
    return out


def mean_visit_s(steps: Floats, dwell_s: ArrayLike) -> Floats:
    """Return the mean duration of a visit, with its refixations merged, (n,)."""
    out: Floats = np.asarray(dwell_s) / (1.0 - np.diag(steps))
    return out


def lowest_peak_deg_s(amplitude_deg: ArrayLike) -> Floats:
    """Return the lower limit of human peak speeds: Baloh's curve minus 15 % for people's spread."""
    a = np.asarray(amplitude_deg, dtype=float)
    out: Floats = 0.85 * BALOH_DEG_S * (1.0 - np.exp(-a / ROUND_DEG))
    return out


def highest_peak_deg_s(amplitude_deg: ArrayLike) -> Floats:
    """Return the upper limit: the higher of Bahill's and Collewijn's curves plus 15 %."""
    a = np.asarray(amplitude_deg, dtype=float)
    bahill = BAHILL_DEG_S * (1.0 - np.exp(-a / ROUND_DEG))
    collewijn = COLLEWIJN_DEG_S * (1.0 - np.exp(-a / COLLEWIJN_ROUND_DEG))
    out: Floats = 1.15 * np.maximum(bahill, collewijn)
    return out


def shortest_duration_ms(amplitude_deg: ArrayLike) -> Floats:
    """Return the lower limit of human durations, 21 ms + 2.2 ms per degree, minus a quarter."""
    out: Floats = 0.75 * (21.0 + 2.2 * np.asarray(amplitude_deg, dtype=float))
    return out


def longest_duration_ms(amplitude_deg: ArrayLike) -> Floats:
    """Return the upper limit of human durations.

    This is the higher of 25 ms + 2.4 ms per degree (Lee, Badler & Badler 2002) plus a quarter, and
    the mean of Baloh et al. 1975, 37 ms + 2.7 ms per degree.
    """
    a = np.asarray(amplitude_deg, dtype=float)
    out: Floats = np.maximum(1.25 * (25.0 + 2.4 * a), 37.0 + 2.7 * a)
    return out


def acceleration_share(amplitude_deg: ArrayLike) -> Floats:
    """Return the share of acceleration: .45 up to 10 deg, .20 from 50 (Collewijn et al. 1988)."""
    over = (np.asarray(amplitude_deg, dtype=float) - 10.0) / 40.0
    out: Floats = 0.45 - 0.25 * np.clip(over, 0.0, 1.0)
    return out


def mean_head_deg(eccentricity_deg: ArrayLike) -> Floats:
    """Return the mean head movement for a gaze shift (Stahl 1999)."""
    beyond = np.abs(np.asarray(eccentricity_deg, dtype=float)) - STAHL_FREE_DEG
    out: Floats = STAHL_SLOPE * np.maximum(0.0, beyond)
    return out


class NormBand(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One measure and its range of people, a row of bands.yaml.

    Attributes:
        key, group: Name in tables, and section of the page.
        low, high: The range.
        least: Fewest events that allow a verdict.
        source: Publication of the measurement.
        mode: Modes of conversation in which it applies, "" for all.
        joints: The rig needs one of them.
        servos: Whether it measures the servos as well, so that ideal ones cannot be judged.
        notes: (style, text) shown with a figure outside if the run has that style, e.g. "saccade
            min_jerk".
    """

    key: str
    group: str
    title: str
    low: float
    high: float
    least: int
    source: str
    unit: str = ""
    mode: str = ""
    joints: tuple[str, ...] = ()
    servos: bool = False
    notes: tuple[tuple[str, str], ...] = ()


BANDS = msgspec.yaml.decode(
    Path(__file__).with_name("bands.yaml").read_bytes(), type=tuple[NormBand, ...]
)
BY_KEY = {band.key: band for band in BANDS}
GROUPS = tuple(dict.fromkeys(band.group for band in BANDS))
