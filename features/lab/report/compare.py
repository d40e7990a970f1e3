"""Comparison of two runs: their figures, the differences, and their p values.

For each measure, the events of both runs are pooled and divided again at random (permutation test)
to find how often chance causes a difference as large. If a measure has one number per event, the
two distributions are also compared (Kolmogorov-Smirnov). All p values are corrected for their
number (Holm 1979). The interval of the difference is from a bootstrap (Efron 1979). Events count as
independent of each other, as is usual. Within a run they are not quite independent, so a difference
just above chance deserves another run.
"""

import warnings
from collections.abc import Iterable, Sequence
from math import isfinite, nan
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from gazerig.features.lab.analysis.human_norms import BY_KEY, GROUPS
from gazerig.features.lab.report.gaze_trace import GazeTrace
from gazerig.features.lab.report.page import (
    PageFigure,
    RunHeader,
    TextLine,
    banner,
    finding_line,
    left_out,
    render,
    with_unit,
    write_all,
)
from gazerig.features.lab.report.plotting import COLOURS, ShownRun
from gazerig.features.lab.report.report import Progress, draw_figures, measure_run, read_run
from gazerig.features.lab.report.statistics import (
    MeasuredValue,
    MeasureResult,
    bootstrap,
    correct_p_values,
    format_number,
    judge,
    measured_value,
    measured_values,
    unbiased_interval,
)
from gazerig.robot.control.tick import Tick

LEVEL = 0.05
_DRAWS, _AT_ONCE = 2000, 100
_SEED = 20060401
COMPARING = "comparing"


Word = Literal["more than chance", "may be chance", "too few events"]


class MeasureDifference(NamedTuple):
    """One measure of two runs.

    difference: b - a; low95, high95: its interval, nan if unknown
    p_value: p value of the difference, corrected
    shape_p_value: the same for the whole distribution, nan if the measure has none
    """

    a: MeasureResult
    b: MeasureResult
    difference: float
    low95: float
    high95: float
    p_value: float
    shape_p_value: float
    word: Word


class Comparison(NamedTuple):
    """The differences, and the files with them.

    warning: warning if one run is measured and the other estimated, "" if both have the same basis
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
    runs = [read_run(each, about, progress) for each, about in zip(ticks, abouts, strict=True)]
    progress(COMPARING, 0.0)
    differences = measure_differences(measure_run(runs[0]), measure_run(runs[1]))
    progress(COMPARING, 1.0)
    shown = [
        ShownRun(about.name, run, colour, about.model)
        for about, run, colour in zip(abouts, runs, COLOURS, strict=True)
    ]
    figures = draw_figures(shown, progress)
    page = compare_page(abouts, runs, differences, figures)
    written = write_all(out, page, figures, [_difference_json(d, runs) for d in differences], force)
    return Comparison(differences, out, *written, mixed_basis_warning(abouts, runs))


def measure_differences(
    a: Sequence[MeasuredValue], b: Sequence[MeasuredValue]
) -> tuple[MeasureDifference, ...]:
    """Compare the measures that both runs have."""
    theirs = {measure.key: measure for measure in b}
    pairs = [(m, theirs[m.key]) for m in a if m.key in theirs]
    enough = {m.key for m, n in pairs if min(m.events, n.events) >= BY_KEY[m.key].min_events}
    rng = np.random.default_rng(_SEED)
    chances = {m.key: permutation_p_value(m, n, rng) for m, n in pairs if m.key in enough}
    shapes = {m.key: shape_p_value(m, n) for m, n in pairs if m.key in enough}
    known = {k: p for k, p in shapes.items() if isfinite(p)}
    both = correct_p_values({**chances, **{f"{k} shape": p for k, p in known.items()}})
    out = []
    for m, n in pairs:
        p, shape = both.get(m.key, nan), both.get(f"{m.key} shape", nan)
        first, second = judge(m, BY_KEY[m.key]), judge(n, BY_KEY[m.key])
        if not isfinite(p):
            nothing = (nan, nan, nan, nan, nan)
            out.append(MeasureDifference(first, second, *nothing, "too few events"))
            continue
        value = second.value - first.value
        of_b, of_a = bootstrap(n, rng), bootstrap(m, rng)
        count = min(len(of_a), len(of_b))
        low, high = unbiased_interval(of_b[:count] - of_a[:count], value)
        differs = p < LEVEL or (isfinite(shape) and shape < LEVEL)
        word: Word = "more than chance" if differs else "may be chance"
        out.append(MeasureDifference(first, second, value, low, high, p, shape, word))
    return tuple(out)


def permutation_p_value(a: MeasuredValue, b: MeasuredValue, rng: np.random.Generator) -> float:
    """Return the p value of the difference of two figures by a permutation test."""
    rows, n = np.concatenate([a.rows, b.rows]), len(a.rows)
    seen = abs(measured_value(b.statistic, b.rows) - measured_value(a.statistic, a.rows))
    as_much = drawn_count = 0
    for _ in range(0, _DRAWS, _AT_ONCE):
        orders = [rng.permutation(len(rows)) for _ in range(_AT_ONCE)]
        first = measured_values(a.statistic, rows, [order[:n] for order in orders])
        dealt = abs(measured_values(a.statistic, rows, [order[n:] for order in orders]) - first)
        drawn_count += int(np.isfinite(dealt).sum())
        as_much += int((dealt >= seen - 1e-12).sum())
    return (as_much + 1.0) / (drawn_count + 1.0)


def shape_p_value(a: MeasuredValue, b: MeasuredValue) -> float:
    """Return the Kolmogorov-Smirnov p value of two distributions, nan for rows without one."""
    if a.rows.ndim != 1 or len(np.unique(np.concatenate([a.rows, b.rows]))) <= 2:
        return nan
    from scipy import stats  # its import takes a second, which other commands do not need

    with warnings.catch_warnings():
        # If the exact p value overflows, SciPy uses the asymptotic one and warns.
        warnings.simplefilter("ignore", RuntimeWarning)
        return float(stats.ks_2samp(a.rows, b.rows).pvalue)


def _difference_json(d: MeasureDifference, runs: Sequence[GazeTrace]) -> dict[str, object]:
    values = {
        "a": d.a.value, "b": d.b.value, "difference": d.difference, "low95": d.low95,
        "high95": d.high95, "p_value": d.p_value, "shape_p_value": d.shape_p_value,
    }  # fmt: skip
    known = {key: value if isfinite(value) else None for key, value in values.items()}
    events = [d.a.measured.events, d.b.measured.events]
    return {"key": d.a.band.key, "title": d.a.band.title, "unit": d.a.band.unit, **known,
            "events": events, "verdicts": [d.a.verdict, d.b.verdict],
            "word": d.word,
            "basis": [run.joints.basis(d.a.band.group) for run in runs]}  # fmt: skip


class ComparedRow(NamedTuple):
    """One row of the page's table, ready to print."""

    a: TextLine
    b: TextLine
    events: str
    difference: str
    interval: str
    p_text: str
    word: str
    css: str


_CLASSES = {"more than chance": "more", "may be chance": "same", "too few events": "few"}


def _row(difference: MeasureDifference, abouts: tuple[RunHeader, RunHeader]) -> ComparedRow:
    a, b = difference.a, difference.b
    known = isfinite(difference.difference)
    chances = [f"p {_p_text(difference.p_value)}"] if known else []
    if isfinite(difference.shape_p_value):
        chances.append(f"distribution p {_p_text(difference.shape_p_value)}")
    return ComparedRow(
        finding_line(a, abouts[0].styles),
        finding_line(b, abouts[1].styles),
        f"{a.measured.events} and {b.measured.events}",
        with_unit(difference.difference, a.band.unit) if known else "",
        f"{format_number(difference.low95)} to {format_number(difference.high95)}" if known else "",
        "; ".join(chances),
        difference.word,
        _CLASSES[difference.word],
    )


def _p_text(chance: float) -> str:
    return "< .001" if chance < 0.001 else f"{chance:.3f}"


class ComparedSection(NamedTuple):
    """One section of the page."""

    name: str
    rows: tuple[ComparedRow, ...]
    figures: tuple[PageFigure, ...]
    left_out: tuple[str, ...]
    basis: tuple[str, ...]


def compare_page(
    abouts: tuple[RunHeader, RunHeader],
    runs: Sequence[GazeTrace],
    differences: Sequence[MeasureDifference],
    figures: Sequence[PageFigure],
) -> str:
    """Return the page as HTML that needs no other file."""
    sections = tuple(
        ComparedSection(
            group,
            tuple(_row(d, abouts) for d in differences if d.a.band.group == group),
            tuple(p for p in figures if p.group == group),
            _left_out(abouts, runs, group),
            tuple(run.joints.basis(group) for run in runs),
        )
        for group in GROUPS
    )
    facts = [dict(about.facts) for about in abouts]
    names = dict.fromkeys((*facts[0], *facts[1]))
    lengths = [
        f"{run.seconds:.1f} s, {len(run.saccades)} saccades, {len(run.blinks)} blinks"
        for run in runs
    ]
    return render(
        "compare.html", abouts=abouts, sections=sections,
        facts=[("length", *lengths), *((name, *(of.get(name, "") for of in facts)) for name in names)],
        differing=[d.a.band.title for d in differences if d.word == "more than chance"],
        counts={word: sum(d.word == word for d in differences) for word in _CLASSES},
        banners=banners(abouts, runs),
    )  # fmt: skip


def banners(abouts: tuple[RunHeader, RunHeader], runs: Sequence[GazeTrace]) -> tuple[str, ...]:
    """Return the warnings at the top: runs that were not measured, or differ in that."""
    messages = [
        f"{about.name}: {text}"
        for about, run in zip(abouts, runs, strict=True)
        if (text := banner(run.joints))
    ]
    return (*messages, *filter(None, (mixed_basis_warning(abouts, runs),)))


def mixed_basis_warning(abouts: tuple[RunHeader, RunHeader], runs: Sequence[GazeTrace]) -> str:
    """Return a warning if one run is measured and the other estimated, "" otherwise."""
    first, second = (run.joints.whole_basis for run in runs)
    if first == second:
        return ""
    return (
        f"{abouts[0].name} is {first} and {abouts[1].name} is {second}: differences may "
        "come from the servos' feedback, not from the gaze"
    )


def _left_out(
    abouts: tuple[RunHeader, RunHeader], runs: Sequence[GazeTrace], group: str
) -> tuple[str, ...]:
    """Return the reasons for missing measures of a section, and the run of each reason."""
    each = [dict.fromkeys(left_out(run.joints, group)) for run in runs]
    both = [why for why in each[0] if why in each[1]]
    return (
        *both,
        *(
            f"{about.name}: {why}"
            for about, reasons in zip(abouts, each, strict=True)
            for why in reasons
            if why not in both
        ),
    )
