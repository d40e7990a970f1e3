"""Fit of a walk to fixations on a face: transitions and dwell times.

Nakamoto & Tsuruno (3.2.2, 3.2.3) count the transitions from one part to another, and take mean and
SD of the dwell times. So does this fit, with two choices for sparse cells of a finite recording,
and with a confidence interval for each number. Intervals are percentiles over resampled recordings
(Efron's bootstrap).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import NamedTuple

import numpy as np

from gazerig.gaze.types import PART_NAMES, PARTS, Floats

SMOOTHINGS = ("none", "laplace")
"""Plain shares, or shares after adding ``PSEUDO_COUNT`` to every count."""
PSEUDO_COUNT, CONFIDENCE, RESAMPLES = 0.5, 0.95, 1000
"""Also the level of the intervals, and the number of resampled recordings."""
_FEWEST, _FEWEST_DWELLS = 50, 5
"""Smallest number of fixations on the face for a fit; a part with fewer than the second gets mean
and SD of all parts together.
"""
_ENDS = 0.5 * (1.0 - CONFIDENCE), 0.5 * (1.0 + CONFIDENCE)
_LONGEST_GAP_S = 0.5
"""Longest gap between the two fixations of a transition."""
# Fixations may overlap by this much: times are often written with three digits.
_OVERLAP_S = 0.005


class PartFixation(NamedTuple):
    """One look: its part (None if it was outside all parts), its start and its duration."""

    part: str | None
    start_s: float
    duration_s: float


class Interval(NamedTuple):
    """A number with the ends of its confidence interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class WalkFit:
    """A fitted walk; rows and columns in the order of PARTS, rows from, columns to.

    counts:  transitions seen; matrix: their probabilities with intervals
    visits:  fixations per part; outside_fixations: fixations on no part
    dwell_mean_s, dwell_sd_s: per part, with intervals
    pooled_parts:  parts with too few looks, whose dwell is that of all parts together
    start:   part of the first fixation on the face
    """

    counts: tuple[tuple[int, ...], ...]
    matrix: tuple[tuple[Interval, ...], ...]
    visits: tuple[int, ...]
    outside_fixations: int
    dwell_mean_s: tuple[Interval, ...]
    dwell_sd_s: tuple[Interval, ...]
    pooled_parts: tuple[str, ...]
    start: str


def fit_walk(
    fixations: Sequence[PartFixation], smoothing: str, rng: np.random.Generator
) -> WalkFit:
    """Fit the walk to fixations in the order of time; smoothing: one of SMOOTHINGS.

    Raises:
        ValueError: the fixations are implausible; the message contains the reason.
    """
    _refuse_untrustworthy(fixations)
    counts = _transitions(fixations)
    matrix = _matrix(counts, smoothing, rng)
    seconds = {
        part: np.array([f.duration_s for f in fixations if f.part == part]) for part in PARTS
    }
    everywhere = np.concatenate(list(seconds.values()))
    pooled = tuple(part for part in PARTS if len(seconds[part]) < _FEWEST_DWELLS)
    dwells = [_dwell(everywhere if part in pooled else seconds[part], rng) for part in PARTS]
    return WalkFit(
        tuple(tuple(row) for row in counts.astype(int).tolist()),
        matrix,
        tuple(len(seconds[part]) for part in PARTS),
        sum(f.part is None for f in fixations),
        tuple(mean for mean, _ in dwells),
        tuple(sd for _, sd in dwells),
        pooled,
        next(f.part for f in fixations if f.part is not None),
    )


def _refuse_untrustworthy(fixations: Sequence[PartFixation]) -> None:
    """Raise ValueError for an implausible recording of looks at a face."""
    end_s, start_s = float("-inf"), float("-inf")
    for number, look in enumerate(fixations, 1):
        if look.part is not None and look.part not in PARTS:
            raise ValueError(
                f"fixation {number}: unknown part {look.part!r}; parts: {', '.join(PARTS)}"
            )
        if not isfinite(look.start_s) or not isfinite(look.duration_s) or look.duration_s <= 0.0:
            raise ValueError(f"fixation {number}: start and duration must be finite, duration > 0")
        if look.start_s <= start_s:
            raise ValueError(
                f"fixation {number} does not begin after the previous one: sort them by time"
            )
        if look.start_s < end_s - _OVERLAP_S:
            raise ValueError(
                f"fixation {number} begins before the previous one ends: check the units"
            )
        start_s, end_s = look.start_s, look.start_s + look.duration_s
    inside = sum(look.part is not None for look in fixations)
    if fixations and inside == 0:
        raise ValueError(f"all {len(fixations)} fixations are outside the parts of the face")
    if inside < _FEWEST:
        raise ValueError(
            f"{inside} fixations on the face are too few, {_FEWEST} are needed: record for longer"
        )


def _transitions(fixations: Sequence[PartFixation]) -> Floats:
    """Count the transitions, (8, 8), rows from; a look outside or a long gap breaks the chain."""
    counts = np.zeros((len(PARTS), len(PARTS)))
    for before, after in zip(fixations, fixations[1:], strict=False):
        gap_s = after.start_s - before.start_s - before.duration_s
        if before.part is not None and after.part is not None and gap_s <= _LONGEST_GAP_S:
            counts[PARTS.index(before.part), PARTS.index(after.part)] += 1.0
    return counts


def _matrix(
    counts: Floats, smoothing: str, rng: np.random.Generator
) -> tuple[tuple[Interval, ...], ...]:
    """Estimate the transition probabilities and their intervals."""
    added = PSEUDO_COUNT if smoothing == "laplace" else 0.0
    if added == 0.0:
        _refuse_dead_ends(counts)
    total = counts.sum()
    if total == 0.0:
        raise ValueError("no two fixations on the face follow each other: nothing to count")
    drawn = rng.multinomial(int(total), counts.ravel() / total, size=RESAMPLES)
    resampled = _shares(np.asarray(drawn.reshape(-1, *counts.shape) + added, dtype=np.float64))
    value = _shares(counts + added)
    low, high = np.nanquantile(resampled, _ENDS, axis=0)
    low, high = _widen_certain_intervals(counts, low, high)
    return tuple(
        tuple(Interval(*cell) for cell in zip(*row, strict=True))
        for row in zip(value.tolist(), low.tolist(), high.tolist(), strict=True)
    )


def _shares(counts: Floats) -> Floats:
    """Divide rows by their sums; a row without counts becomes NaN."""
    sums = counts.sum(axis=-1, keepdims=True)
    shares: Floats = np.divide(counts, sums, out=np.full(counts.shape, np.nan), where=sums > 0.0)
    return shares


def _refuse_dead_ends(counts: Floats) -> None:
    """Refuse parts that the walk would never leave, or that have no known transition."""
    away = counts.sum(axis=1) - np.diag(counts)
    stuck = [PART_NAMES[part] for part, n in zip(PARTS, away, strict=True) if n == 0.0]
    if stuck:
        raise ValueError(
            f"no transition starts at {', '.join(stuck)}:"
            " record for longer or use laplace smoothing"
        )


def _widen_certain_intervals(counts: Floats, low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """Widen intervals of cells that resampling cannot change: those seen never or always.

    For an event not seen in n trials, p <= 1 - (1 - confidence)^(1/n) is certain to that level (the
    "rule of three" for 95 %).
    """
    n = counts.sum(axis=1, keepdims=True)
    surprise = np.where(n > 0.0, (1.0 - CONFIDENCE) ** (1.0 / np.maximum(n, 1.0)), 0.0)
    high = np.where(counts == 0.0, np.maximum(high, 1.0 - surprise), high)
    low = np.where(counts == n, np.minimum(low, surprise), low)
    return low, high


def _dwell(seconds: Floats, rng: np.random.Generator) -> tuple[Interval, Interval]:
    """Return mean and SD of dwell times with their intervals."""
    n = len(seconds)
    drawn = [seconds[rng.integers(0, n, n)] for _ in range(RESAMPLES)]
    mean_ends = np.quantile([d.mean() for d in drawn], _ENDS).tolist()
    sd_ends = np.quantile([d.std(ddof=1) for d in drawn], _ENDS).tolist()
    return (
        Interval(float(seconds.mean()), *mean_ends),
        Interval(float(seconds.std(ddof=1)), *sd_ends),
    )
