"""The page of a comparison of two runs, and its values."""

from collections.abc import Sequence
from math import isfinite
from typing import Literal, NamedTuple

from gazerig.features.lab.report.gaze_trace import GazeTrace
from gazerig.features.lab.report.page import (
    Figure,
    RunHeader,
    TextLine,
    banner,
    left_out,
    line_of,
    render,
    with_unit,
)
from gazerig.features.lab.report.statistics import MeasureResult, number
from gazerig.robot.analysis.human_norms import GROUPS

Word = Literal["more than chance", "may be chance", "too few events"]


class MeasureDifference(NamedTuple):
    """One measure of two runs.

    difference: b - a; low95, high95: its interval, nan if unknown
    chance: p value of the difference, corrected; chance_shape: the same for the whole distribution,
        nan if the measure has none
    """

    a: MeasureResult
    b: MeasureResult
    difference: float
    low95: float
    high95: float
    chance: float
    chance_shape: float
    word: Word


class ComparedRow(NamedTuple):
    """One row of the page's table, ready to print."""

    a: TextLine
    b: TextLine
    events: str
    difference: str
    interval: str
    chance: str
    word: str
    css: str


_CLASSES = {"more than chance": "more", "may be chance": "same", "too few events": "few"}


def _row(difference: MeasureDifference, abouts: tuple[RunHeader, RunHeader]) -> ComparedRow:
    a, b = difference.a, difference.b
    known = isfinite(difference.difference)
    chances = [f"p {_p(difference.chance)}"] if known else []
    if isfinite(difference.chance_shape):
        chances.append(f"distribution p {_p(difference.chance_shape)}")
    return ComparedRow(
        line_of(a, abouts[0].styles),
        line_of(b, abouts[1].styles),
        f"{a.measured.events} and {b.measured.events}",
        with_unit(difference.difference, a.band.unit) if known else "",
        f"{number(difference.low95)} to {number(difference.high95)}" if known else "",
        "; ".join(chances),
        difference.word,
        _CLASSES[difference.word],
    )


def _p(chance: float) -> str:
    return "< .001" if chance < 0.001 else f"{chance:.3f}"


class ComparedSection(NamedTuple):
    """One section of the page."""

    name: str
    rows: tuple[ComparedRow, ...]
    figures: tuple[Figure, ...]
    left_out: tuple[str, ...]
    basis: tuple[str, ...]


def compare_page(
    abouts: tuple[RunHeader, RunHeader],
    runs: Sequence[GazeTrace],
    differences: Sequence[MeasureDifference],
    figures: Sequence[Figure],
) -> str:
    """Return the page as HTML that needs no other file."""
    sections = tuple(
        ComparedSection(
            group,
            tuple(_row(d, abouts) for d in differences if d.a.band.group == group),
            tuple(p for p in figures if p.drawing.group == group),
            _left_out(abouts, runs, group),
            tuple(run.joints.basis(group) for run in runs),
        )
        for group in GROUPS
    )
    return render(
        "compare.html", abouts=abouts, sections=sections, facts=_facts(abouts, runs),
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


def _facts(
    abouts: tuple[RunHeader, RunHeader], runs: Sequence[GazeTrace]
) -> tuple[tuple[str, str, str], ...]:
    """Return the facts of both runs, side by side."""
    first, second = (dict(about.facts) for about in abouts)
    names = dict.fromkeys((*first, *second))
    counts = [
        f"{run.seconds:.1f} s, {len(run.saccades)} saccades, {len(run.blinks)} blinks"
        for run in runs
    ]
    facts = [(name, first.get(name, ""), second.get(name, "")) for name in names]
    return (("length", counts[0], counts[1]), *facts)
