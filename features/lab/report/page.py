"""The page of a report: text, numbers and figures in the HTML templates."""

import json
from base64 import b64encode
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from typing import NamedTuple

import jinja2

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import make_folder, refuse_existing, write_file
from gazerig.features.lab.analysis.human_norms import BANDS, GROUPS, NormBand
from gazerig.features.lab.report.face import ReferenceWalk
from gazerig.features.lab.report.gaze_trace import GazeTrace
from gazerig.features.lab.report.joint_basis import JointBasis
from gazerig.features.lab.report.statistics import MeasureResult, format_number
from gazerig.robot.control.feedback_basis import ESTIMATED, Basis


@dataclass(frozen=True)
class RunHeader:
    """A run's name and circumstances.

    name: short, for figures; facts: (what, value) rows of the page's head
    styles: e.g. "saccade min_jerk", "scanpath markov": which notes of the bands apply
    model: the configured walk over faces, None for another scanpath model
    warnings: e.g. that the recording is incomplete
    duration_s: length of the run, None if unknown before it is read
    """

    name: str
    facts: tuple[tuple[str, str], ...] = ()
    styles: frozenset[str] = field(default_factory=frozenset)
    model: ReferenceWalk | None = None
    warnings: tuple[str, ...] = ()
    duration_s: float | None = None


_CLASSES = {
    "pass": "pass", "uncertain": "uncertain", "outside": "outside", "too few events": "few",
}  # fmt: skip


class PageFigure(NamedTuple):
    """A drawn figure with its caption; key, group: those of its drawing."""

    title: str
    png: bytes
    caption: str
    key: str = ""
    group: str = ""

    @property
    def data_uri(self) -> str:
        """Return the figure as embedded in the page."""
        return f"data:image/png;base64,{b64encode(self.png).decode()}"


class TextLine(NamedTuple):
    """One row of a table of the page, ready to print.

    css: class of its verdict; gauge: SVG of the value and its band; notes: possible reasons
    """

    title: str
    value: str
    interval: str
    asked: str
    band: str
    events: str
    verdict: str
    css: str
    source: str
    notes: tuple[str, ...]
    gauge: "Gauge | None"


class Gauge(NamedTuple):
    """Places on a scale of 0..100: the band, the value and its interval."""

    band_from: float
    band_wide: float
    value: float
    low: float
    wide: float


class PageSection(NamedTuple):
    """One section of the page."""

    name: str
    lines: tuple[TextLine, ...]
    figures: tuple[PageFigure, ...]
    left_out: tuple[str, ...]
    basis: Basis


def report_page(
    about: RunHeader,
    run: GazeTrace,
    findings: Sequence[MeasureResult],
    figures: Sequence[PageFigure],
) -> str:
    """Return the page of one run as HTML that needs no other file."""
    styles = about.styles | {f"conversation {run.mode}"} | run.joints.styles
    sections = tuple(
        PageSection(
            group,
            tuple(finding_line(f, styles) for f in findings if f.band.group == group),
            tuple(p for p in figures if p.group == group),
            left_out(run.joints, group),
            run.joints.basis(group),
        )
        for group in GROUPS
    )
    counts = Counter(finding.verdict for finding in findings)
    total = sum(run.kinds.values()) or 1.0
    shares = sorted(run.kinds.items(), key=lambda item: -item[1])
    facts = (
        *about.facts,
        *(
            (
                ("length", f"{run.seconds:.1f} s, {len(run.rows)} ticks at {run.rate_hz:.0f} Hz"),
                (
                    "events",
                    f"{len(run.saccades)} saccades, {len(run.fixations)} fixations, "
                    f"{len(run.blinks)} blinks",
                ),
                ("looked at", ", ".join(f"{kind} {100 * s / total:.0f} %" for kind, s in shares)),
                ("conversation", run.mode),
            )
        ),
    )
    return render(
        "report.html", about=about, facts=facts, sections=sections, counts=counts,
        outside=[f.band.title for f in findings if f.verdict == "outside"],
        uncertain=[f.band.title for f in findings if f.verdict == "uncertain"],
        basis=run.joints.whole_basis, banner=banner(run.joints),
    )  # fmt: skip


def left_out(joints: JointBasis, group: str) -> tuple[str, ...]:
    """Return the reasons for missing measures of a section."""
    return joints.all_left_out(band.key for band in BANDS if band.group == group)


def banner(joints: JointBasis) -> str:
    """Return the warning about servos without feedback, "" if all are measured."""
    if not joints.estimated:
        return ""
    if joints.whole_basis == "estimated":
        return (
            "Nothing here is measured: the servos of this rig have no feedback. All results are "
            f"{ESTIMATED}. Real eyes may lag, stick or swing without an effect on the verdicts."
        )
    return (
        f"Not all of this is measured: the servos of {', '.join(joints.estimated)} have no "
        f"feedback. Results that depend on them are {ESTIMATED}; their sections are marked."
    )


FOLDER = Path(__file__).parent
"""Folder of the templates."""


def render(template: str, folder: Path = FOLDER, **values: object) -> str:
    """Fill a template of a folder; it may extend those of this folder."""
    loader = jinja2.FileSystemLoader((folder, FOLDER))
    environment = jinja2.Environment(
        loader=loader, autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    return environment.get_template(template).render(**values)


def finding_line(finding: MeasureResult, styles: frozenset[str]) -> TextLine:
    """Return a finding as text."""
    band, value = finding.band, finding.value
    known = isfinite(finding.low95)
    interval = f"{format_number(finding.low95)} to {format_number(finding.high95)}" if known else ""
    asked = finding.measured.commanded_value
    notes = tuple(text for style, text in band.notes if style in styles)
    return TextLine(
        band.title,
        with_unit(value, band.unit) if isfinite(value) else "nothing found",
        interval,
        format_number(asked) if isfinite(asked) else "",
        band_text(band),
        f"{finding.measured.events} of {band.min_events}"
        if finding.verdict == "too few events"
        else f"{finding.measured.events}",
        finding.verdict,
        _CLASSES[finding.verdict],
        band.source,
        notes if finding.verdict in ("outside", "uncertain") else (),
        make_gauge(finding) if known else None,
    )


def make_gauge(finding: MeasureResult) -> Gauge:
    """Return band and value on one scale; a distant value is at the end of the scale."""
    band = finding.band
    margin = 0.75 * (band.high - band.low)
    start, span = band.low - margin, band.high - band.low + 2.0 * margin

    def at(x: float) -> float:
        return min(100.0, max(0.0, 100.0 * (x - start) / span))

    low, high = at(finding.low95), at(finding.high95)
    return Gauge(at(band.low), at(band.high) - at(band.low), at(finding.value), low, high - low)


def band_text(band: NormBand) -> str:
    """Return a band as text."""
    return f"{format_number(band.low)} to {with_unit(band.high, band.unit)}"


def with_unit(value: float, unit: str) -> str:
    """Return a number with its unit; shares have none."""
    return format_number(value) if unit in ("", "share") else f"{format_number(value)} {unit}"


def numbers_file(out: Path) -> Path:
    """Return the file of a page's numbers; its name differs from that of a run's own summary."""
    return out.with_name(f"{out.stem}_measures.json")


_PAGE_MARK = b'name="generator" content="gazerig"'
_MARKS = {".json": b'[\n {\n  "key": ', ".png": b"Matplotlib"}
"""Text near the beginning of the files of reports and comparisons."""

_HEAD_BYTES = 4096


def report_files(out: Path, figures: Collection[str]) -> tuple[Path, ...]:
    """Return the page, its numbers, and its figures by their keys."""
    folder = out.with_name(f"{out.stem}_figures")
    return (out, numbers_file(out), *(folder / f"{key}.png" for key in figures))


def refuse_foreign(paths: Collection[Path], force: bool = False) -> None:
    """Refuse existing files; with ``force`` only those that are no report's.

    Raises:
        SetupError: something already exists or cannot be written.
    """
    refuse_existing(*paths, force=force)
    for path in paths:
        if not path.is_file():
            continue
        try:
            with path.open("rb") as file:
                head = file.read(_HEAD_BYTES)
        except OSError as error:
            raise SetupError(f"cannot read {path} ({error.strerror}): name another file") from error
        if head and _MARKS.get(path.suffix, _PAGE_MARK) not in head:
            raise SetupError(
                f"{path} was not made by gazerig report, and is kept even with --force: "
                "name another file, or remove it"
            )


def write_all(
    out: Path,
    page: str,
    figures: Sequence[PageFigure],
    numbers: Sequence[dict[str, object]],
    force: bool = False,
) -> tuple[tuple[Path, ...], Path]:
    """Write page, figures and numbers; return the figures' paths and that of the numbers.

    force: replace files of an earlier report

    Raises:
        SetupError: something already exists or cannot be written.
    """
    _, data, *paths = files = report_files(out, [figure.key for figure in figures])
    refuse_foreign(files, force)
    make_folder(out.with_name(f"{out.stem}_figures"))
    for path, figure in zip(paths, figures, strict=True):
        write_file(path, figure.png, force)
    write_file(data, json.dumps(list(numbers), indent=1) + "\n", force)
    write_file(out, page, force)
    return tuple(paths), data
