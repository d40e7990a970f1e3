"""Creation of a report from ticks: collect, measure, compare with bands, draw, write."""

from collections.abc import Callable, Iterable, Sequence
from math import isfinite
from pathlib import Path
from typing import NamedTuple

from gazerig.drivers.errors import SetupError
from gazerig.features.lab.report import (
    figures_face,
    figures_head,
    figures_lids,
    figures_saccades,
)
from gazerig.features.lab.report.gaze_trace import GazeTrace, GazeTraceBuilder
from gazerig.features.lab.report.measures import judge_run
from gazerig.features.lab.report.page import PageFigure, RunHeader, report_page, write_all
from gazerig.features.lab.report.plotting import COLOURS, Drawing, ShownRun, basis_text, drawing_png
from gazerig.features.lab.report.statistics import MeasureResult
from gazerig.robot.control.tick import Tick

Progress = Callable[[str, float], None]
"""Receives the current activity and its completed share, 0..1."""

DRAWINGS: tuple[Drawing, ...] = (
    *figures_saccades.DRAWINGS,
    *figures_face.DRAWINGS,
    *figures_head.DRAWINGS,
    *figures_lids.DRAWINGS,
)

FIGURE_KEYS = tuple(drawing.key for drawing in DRAWINGS)

_PROGRESS_EVERY, _LEAST_TICKS = 400, 20
READING, DRAWING = "reading the run", "drawing figures"


class Report(NamedTuple):
    """The findings, and the files with them: the page, its figures, and the numbers as JSON."""

    findings: tuple[MeasureResult, ...]
    page: Path
    figures: tuple[Path, ...]
    data: Path


def make_report(
    run: GazeTrace,
    about: RunHeader,
    out: Path,
    progress: Progress,
    force: bool = False,
) -> Report:
    """Write one HTML page, one PNG per figure, and the numbers as JSON; return the findings.

    out: the page to write; the PNGs are written to the folder NAME_figures of the same parent
    force: replace existing files

    Raises:
        SetupError: a file cannot be written.
    """
    findings = judge_run(run)
    figures = draw_figures([ShownRun(about.name, run, COLOURS[0], about.model)], progress)
    page = report_page(about, run, findings, figures)
    numbers = [_finding_json(f, run) for f in findings]
    written = write_all(out, page, figures, numbers, force)
    return Report(findings, out, *written)


def read_run(ticks: Iterable[Tick], about: RunHeader, progress: Progress) -> GazeTrace:
    """Collect the data of a run in one pass.

    Raises:
        SetupError: the run is too short.
    """
    builder, first_s = GazeTraceBuilder(), None
    progress(READING, 0.0)
    for count, tick in enumerate(ticks):
        builder.update(tick)
        first_s = tick.t_s if first_s is None else first_s
        if about.duration_s and count % _PROGRESS_EVERY == 0:
            progress(READING, min(1.0, (tick.t_s - first_s) / about.duration_s))
    progress(READING, 1.0)
    run = builder.trace()
    if len(run.rows) < _LEAST_TICKS:
        raise SetupError(f"{about.name}: {len(run.rows)} ticks are too few for a report")
    return run


def draw_figures(runs: Sequence[ShownRun], progress: Progress) -> tuple[PageFigure, ...]:
    """Draw every figure of one run, or of two runs together; skip runs without its joints."""
    figures = []
    for count, drawing in enumerate(DRAWINGS):
        progress(DRAWING, count / len(DRAWINGS))
        able = [shown for shown in runs if not shown.run.joints.left_out(drawing.key)]
        if able:
            basis = basis_text(able, drawing.group)
            caption = drawing.caption.replace("{measured}", basis)
            png = drawing_png(drawing, able)
            figures.append(PageFigure(drawing.title, png, caption, drawing.key, drawing.group))
    progress(DRAWING, 1.0)
    return tuple(figures)


def _finding_json(finding: MeasureResult, run: GazeTrace) -> dict[str, object]:
    """Return a finding as plain JSON; unknown values are null.

    basis: "measured", "partly estimated" or "estimated"
    """
    band = finding.band
    return {
        "key": band.key, "title": band.title, "unit": band.unit,
        "value": _or_none(finding.value), "low95": _or_none(finding.low95),
        "high95": _or_none(finding.high95), "asked": _or_none(finding.measured.commanded_value),
        "events": finding.measured.events, "least_events": band.min_events,
        "band": [band.low, band.high], "verdict": finding.verdict, "source": band.source,
        "basis": run.joints.basis(band.group),
    }  # fmt: skip


def _or_none(value: float) -> float | None:
    return value if isfinite(value) else None
