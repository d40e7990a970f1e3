"""Comparison of two runs: their figures, the differences, and the p values of these.

For each measure, the events of both runs are pooled and dealt again at random (permutation test)
to find how often chance makes a difference as large. If a measure has one number an event, the two
distributions are compared too (Kolmogorov-Smirnov). All p values are corrected for their number
(Holm 1979). The interval of the difference is a bootstrap's (Efron 1979). Events count as
independent of each other, as is usual. Within a run they are not quite independent, so a
difference just above chance deserves another run.
"""

import warnings
from collections.abc import Iterable, Sequence
from math import isfinite, nan
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gazerig.features.lab.report.compare_page import (
    MeasureDifference,
    Word,
    compare_page,
    mixed_basis_warning,
)
from gazerig.features.lab.report.files import write_all
from gazerig.features.lab.report.gaze_trace import GazeTrace
from gazerig.features.lab.report.page import RunHeader
from gazerig.features.lab.report.plotting import COLOURS, Shown
from gazerig.features.lab.report.report import Progress, draw_figures, measure_run, read
from gazerig.features.lab.report.statistics import (
    MeasuredValue,
    bootstrap,
    correct_p_values,
    figure,
    figures,
    judge,
    unbiased_interval,
)
from gazerig.robot.analysis.human_norms import BY_KEY
from gazerig.robot.control.tick import Tick

LEVEL = 0.05
_DRAWS, _AT_ONCE = 2000, 100
_SEED = 20060401
COMPARING = "comparing"


class Comparison(NamedTuple):
    """The differences, and the files with them.

    warning: that one run is measured and the other estimated, "" if both have the same basis
    """

    differences: tuple[MeasureDifference, ...]
    page: Path
    figures: tuple[Path, ...]
    data: Path
    warning: str


def compare(
    ticks: tuple[Iterable[Tick], Iterable[Tick]],
    abouts: tuple[RunHeader, RunHeader],
    out: Path,
    progress: Progress,
    force: bool = False,
) -> Comparison:
    """Write a page that compares two runs, its figures and numbers; return the differences.

    force: replace existing files

    Raises:
        SetupError: a file cannot be written, or a run is empty.
    """
    runs = [read(each, about, progress) for each, about in zip(ticks, abouts, strict=True)]
    progress(COMPARING, 0.0)
    differences = differences_of(measure_run(runs[0]), measure_run(runs[1]))
    progress(COMPARING, 1.0)
    shown = [
        Shown(about.name, run, colour, about.model)
        for about, run, colour in zip(abouts, runs, COLOURS, strict=True)
    ]
    figures = draw_figures(shown, progress)
    page = compare_page(abouts, runs, differences, figures)
    written = write_all(out, page, figures, [_numbers(d, runs) for d in differences], force)
    return Comparison(differences, out, *written, mixed_basis_warning(abouts, runs))


def differences_of(
    a: Sequence[MeasuredValue], b: Sequence[MeasuredValue]
) -> tuple[MeasureDifference, ...]:
    """Compare the measures that both runs have."""
    theirs = {measure.key: measure for measure in b}
    pairs = [(m, theirs[m.key]) for m in a if m.key in theirs]
    enough = {m.key for m, n in pairs if min(m.events, n.events) >= BY_KEY[m.key].least}
    rng = np.random.default_rng(_SEED)
    chances = {m.key: chance(m, n, rng) for m, n in pairs if m.key in enough}
    shapes = {m.key: chance_of_shape(m, n) for m, n in pairs if m.key in enough}
    known = {k: p for k, p in shapes.items() if isfinite(p)}
    both = correct_p_values({**chances, **{f"{k} shape": p for k, p in known.items()}})
    out = []
    for m, n in pairs:
        p, shape = both.get(m.key, nan), both.get(f"{m.key} shape", nan)
        out.append(_difference(m, n, p, shape, rng))
    return tuple(out)


def chance(a: MeasuredValue, b: MeasuredValue, rng: np.random.Generator) -> float:
    """Return the p value of the difference of two figures by a permutation test."""
    rows, n = np.concatenate([a.rows, b.rows]), len(a.rows)
    seen = abs(figure(b.of, b.rows) - figure(a.of, a.rows))
    as_much = drawn_count = 0
    for _ in range(0, _DRAWS, _AT_ONCE):
        orders = [rng.permutation(len(rows)) for _ in range(_AT_ONCE)]
        first = figures(a.of, rows, [order[:n] for order in orders])
        dealt = abs(figures(a.of, rows, [order[n:] for order in orders]) - first)
        drawn_count += int(np.isfinite(dealt).sum())
        as_much += int((dealt >= seen - 1e-12).sum())
    return (as_much + 1.0) / (drawn_count + 1.0)


def chance_of_shape(a: MeasuredValue, b: MeasuredValue) -> float:
    """Return the Kolmogorov-Smirnov p value of two distributions, nan for rows without one."""
    if a.rows.ndim != 1 or len(np.unique(np.concatenate([a.rows, b.rows]))) <= 2:
        return nan
    from scipy import stats  # takes a second to import, which other commands should not pay

    with warnings.catch_warnings():
        # If the exact p value overflows, SciPy uses the asymptotic one and warns.
        warnings.simplefilter("ignore", RuntimeWarning)
        return float(stats.ks_2samp(a.rows, b.rows).pvalue)


def _difference(
    a: MeasuredValue, b: MeasuredValue, p: float, shape: float, rng: np.random.Generator
) -> MeasureDifference:
    band = BY_KEY[a.key]
    ours, theirs = judge(a, band), judge(b, band)
    if not isfinite(p):
        return MeasureDifference(ours, theirs, nan, nan, nan, nan, nan, "too few events")
    value = theirs.value - ours.value
    of_b, of_a = bootstrap(b, rng), bootstrap(a, rng)
    n = min(len(of_a), len(of_b))
    low, high = unbiased_interval(of_b[:n] - of_a[:n], value)
    differs = p < LEVEL or (isfinite(shape) and shape < LEVEL)
    word: Word = "more than chance" if differs else "may be chance"
    return MeasureDifference(ours, theirs, value, low, high, p, shape, word)


def _numbers(d: MeasureDifference, runs: Sequence[GazeTrace]) -> dict[str, object]:
    values = {
        "a": d.a.value, "b": d.b.value, "difference": d.difference, "low95": d.low95,
        "high95": d.high95, "chance": d.chance, "chance_of_shape": d.chance_shape,
    }  # fmt: skip
    known = {key: value if isfinite(value) else None for key, value in values.items()}
    events = [d.a.measured.events, d.b.measured.events]
    return {"key": d.a.band.key, "title": d.a.band.title, "unit": d.a.band.unit, **known,
            "events": events, "verdicts": [d.a.verdict, d.b.verdict],
            "word": d.word,
            "basis": [run.joints.basis(d.a.band.group) for run in runs]}  # fmt: skip
