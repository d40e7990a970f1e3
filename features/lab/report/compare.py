"""Comparison of two runs: their figures beside the human bands, and the differences."""

from collections.abc import Iterable, Sequence
from math import isfinite
from pathlib import Path
from typing import NamedTuple

from gazerig.features.lab.analysis.human_norms import GROUPS
from gazerig.features.lab.report.gaze_trace import GazeTrace
from gazerig.features.lab.report.measures import judge_run
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
from gazerig.features.lab.report.report import Progress, draw_figures, read_run
from gazerig.features.lab.report.statistics import MeasureResult
from gazerig.robot.control.tick import Tick


class MeasureDifference(NamedTuple):
    """One measure of two runs."""

    a: MeasureResult
    b: MeasureResult

    @property
    def difference(self) -> float:
        """Return b - a, nan if one is unknown."""
        return self.b.value - self.a.value


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
    differences = measure_differences(judge_run(runs[0]), judge_run(runs[1]))
    shown = [
        ShownRun(about.name, run, colour, about.model)
        for about, run, colour in zip(abouts, runs, COLOURS, strict=True)
    ]
    figures = draw_figures(shown, progress)
    page = compare_page(abouts, runs, differences, figures)
    written = write_all(out, page, figures, [_difference_json(d, runs) for d in differences], force)
    return Comparison(differences, out, *written, mixed_basis_warning(abouts, runs))


def measure_differences(
    a: Sequence[MeasureResult], b: Sequence[MeasureResult]
) -> tuple[MeasureDifference, ...]:
    """Return the measures that both runs have."""
    theirs = {result.band.key: result for result in b}
    return tuple(MeasureDifference(m, theirs[m.band.key]) for m in a if m.band.key in theirs)


def _difference_json(d: MeasureDifference, runs: Sequence[GazeTrace]) -> dict[str, object]:
    values = {"a": d.a.value, "b": d.b.value, "difference": d.difference}
    known = {key: value if isfinite(value) else None for key, value in values.items()}
    events = [d.a.measured.events, d.b.measured.events]
    return {"key": d.a.band.key, "title": d.a.band.title, "unit": d.a.band.unit, **known,
            "events": events, "verdicts": [d.a.verdict, d.b.verdict],
            "basis": [run.joints.basis(d.a.band.group) for run in runs]}  # fmt: skip


class ComparedRow(NamedTuple):
    """One row of the page's table, ready to print."""

    a: TextLine
    b: TextLine
    events: str
    difference: str


def _row(difference: MeasureDifference, abouts: tuple[RunHeader, RunHeader]) -> ComparedRow:
    a, b = difference.a, difference.b
    value = difference.difference
    return ComparedRow(
        finding_line(a, abouts[0].styles),
        finding_line(b, abouts[1].styles),
        f"{a.measured.events} and {b.measured.events}",
        with_unit(value, a.band.unit) if isfinite(value) else "",
    )


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
