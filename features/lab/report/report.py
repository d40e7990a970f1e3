"""The report of one run, or of two side by side: one HTML page, and its numbers as JSON."""

import json
from base64 import b64encode
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from typing import Any

import jinja2
import msgspec

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import make_folder, refuse_existing, write_file
from gazerig.features.lab.analysis.human_norms import BANDS, GROUPS
from gazerig.features.lab.report.figures import COLOURS, DRAWINGS, Drawing, ShownRun, draw_png
from gazerig.features.lab.report.gaze_trace import GazeTrace, GazeTraceBuilder
from gazerig.features.lab.report.measures import judge_run
from gazerig.features.lab.report.statistics import MeasureResult
from gazerig.robot.recording.read import RunRecording, report_bad_contents
from gazerig.robot.recording.run_info import RunInfo

Progress = Callable[[str, float], None]
"""Receives the current activity and its completed share, 0..1."""

_PROGRESS_EVERY, _LEAST_TICKS = 400, 20
_PAGE = Path(__file__).with_name("report.html")


@dataclass(frozen=True)
class ReportedRun:
    """A run with its results.

    Attributes:
        name: Short name, for figures.
        run: The run.
        facts: (what, value) rows of the page's head.
        styles: Styles of gaze that select notes of the bands, e.g. "saccade min_jerk".
        warning: Defect of the recording, "" without one.
    """

    name: str
    run: GazeTrace
    facts: dict[str, str]
    styles: frozenset[str]
    warning: str = ""
    results: tuple[MeasureResult, ...] = ()

    @property
    def banner(self) -> str:
        """Return the warning about servos that were not measured, "" if all were."""
        joints = self.run.joints
        if self.run.ideal_servos:
            return (
                "The servos were ideal: a lag without bytes. Measures of servos are not judged; run "
                "with emulated servos to see them."
            )
        if joints.estimated:
            return (
                f"Not all of this is measured: the servos of {', '.join(joints.estimated)} have no "
                "feedback. Results that depend on them are estimated from commands and known servo "
                "speeds, not measured; their sections are marked. "
                "Real eyes may lag, stick or swing without an effect on the verdicts."
            )
        return ""

    @property
    def counts(self) -> Counter[str]:
        """Return the number of measures with each verdict."""
        return Counter(result.verdict for result in self.results)

    def of(self, verdict: str) -> list[MeasureResult]:
        """Return the results with a verdict."""
        return [result for result in self.results if result.verdict == verdict]


def describe_run(name: str, info: RunInfo, run: GazeTrace, warning: str = "") -> ReportedRun:
    """Return a run with its circumstances and results.

    Raises:
        ValueError, KeyError, TypeError: The recorded configuration is damaged.
    """
    gaze = msgspec.yaml.decode(info.config_yaml)["gaze"]
    saccade, scanpath = gaze["saccade"]["profile"], gaze["scanpath"]["model"]
    kinds = sorted(run.kinds.items(), key=lambda item: -item[1])
    total = sum(run.kinds.values()) or 1.0
    facts = {
        "rig": info.rig,
        "character": info.character or "none",
        "profile": info.profile,
        "saw": f"scene {info.scene}" if info.scene else info.eyes,
        "servos": info.bus if info.mock else "real",
        "time": "simulated" if info.fast else "real",
        "seed": str(info.seed),
        "started": info.started_utc.isoformat(),
        "versions": ", ".join(f"{name} {v}" for name, v in sorted(info.versions.items())),
        "saccades": saccade,
        "face scanpath": scanpath,
        "length": f"{run.seconds:.1f} s, {len(run.rows)} ticks at {run.rate_hz:.0f} Hz",
        "events": f"{len(run.saccades)} saccades, {len(run.fixations)} fixations, "
        f"{len(run.blinks)} blinks",
        "looked at": ", ".join(f"{kind} {100 * s / total:.0f} %" for kind, s in kinds),
        "conversation": run.mode,
    }
    styles = {
        f"saccade {saccade}", f"scanpath {scanpath}",
        f"conversation {run.mode}",
    }  # fmt: skip
    return ReportedRun(name, run, facts, run.joints.styles | styles, warning, judge_run(run))


def read_run(recording: RunRecording, progress: Progress) -> ReportedRun:
    """Read a recorded run in one pass.

    Raises:
        SetupError: the run is too short, or its contents are damaged.
    """
    info, name = recording.info, recording.path.stem
    builder = GazeTraceBuilder(ideal_servos=info.mock and info.bus == "ideal")
    first_s, count = None, 0
    with report_bad_contents(recording.path):
        for count, tick in enumerate(recording.ticks(), 1):
            builder.update(tick)
            first_s = tick.t_s if first_s is None else first_s
            if recording.duration_s and count % _PROGRESS_EVERY == 0:
                progress(f"reading {name}", min(1.0, (tick.t_s - first_s) / recording.duration_s))
        if count < _LEAST_TICKS:
            raise SetupError(f"{recording.path}: {count} ticks are too few for a report")
        found = describe_run(name, info, builder.trace(), recording.note)
    return replace(found, facts={"recording": str(recording.path)} | found.facts)


def report_files(out: Path) -> tuple[Path, Path]:
    """Return the page and the file of its numbers."""
    return out, out.with_name(f"{out.stem}_measures.json")


def make_report(
    runs: Sequence[ReportedRun], out: Path, progress: Progress, force: bool = False
) -> None:
    """Write the page of one run or of two, and its numbers as JSON.

    force: replace existing files

    Raises:
        SetupError: a file cannot be written.
    """
    page, data = report_files(out)
    refuse_existing(page, data, force=force)
    shown = [
        ShownRun(one.name, one.run, colour) for one, colour in zip(runs, COLOURS, strict=False)
    ]
    figures: dict[str, list[tuple[Drawing, str]]] = {group: [] for group in GROUPS}
    for count, drawing in enumerate(DRAWINGS):
        progress("drawing figures", count / len(DRAWINGS))
        able = [one for one in shown if one.run.joints.has_any(drawing.joints)]
        if able:
            picture = b64encode(draw_png(drawing, able)).decode()
            figures[drawing.group].append((drawing, picture))
    progress("drawing figures", 1.0)
    text = _page(runs, figures)
    make_folder(out.parent)
    numbers = [_numbers(one, result) for one in runs for result in one.results]
    write_file(data, json.dumps(numbers, indent=1) + "\n", force)
    write_file(page, text, force)


def _page(runs: Sequence[ReportedRun], figures: dict[str, list[tuple[Drawing, str]]]) -> str:
    """Return the page as HTML that needs no other file."""
    rows: dict[str, list[Any]] = {group: [] for group in GROUPS}
    left_out: dict[str, dict[str, None]] = {group: {} for group in GROUPS}
    by_key = [{result.band.key: result for result in one.results} for one in runs]
    for band in BANDS:
        cells = [results.get(band.key) for results in by_key]
        if any(cells):
            rows[band.group].append((band, cells))
        elif not any(one.run.joints.has_any(band.joints) for one in runs):
            left_out[band.group][" or ".join(band.joints)] = None
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= {"number": format_number, "unit": with_unit}
    return environment.from_string(_PAGE.read_text(encoding="utf-8")).render(
        runs=runs, groups=GROUPS, rows=rows, left_out=left_out, figures=figures
    )


def _numbers(one: ReportedRun, result: MeasureResult) -> dict[str, object]:
    """Return a result as plain JSON; unknown values are null."""
    values = {
        "value": result.value, "low95": result.low95, "high95": result.high95,
        "commanded": result.measured.commanded_value,
    }  # fmt: skip
    return {
        "run": one.name, **msgspec.structs.asdict(result.band),
        **{name: value if isfinite(value) else None for name, value in values.items()},
        "events": result.measured.events, "verdict": result.verdict,
        "basis": one.run.joints.basis(result.band.group),
    }  # fmt: skip


def with_unit(value: float, unit: str) -> str:
    """Return a number with its unit, "" for an unknown one; shares have no unit."""
    text = format_number(value)
    return f"{text} {unit}" if text and unit not in ("", "share") else text


def format_number(value: float) -> str:
    """Return a number with three digits, "" for an unknown one."""
    if not isfinite(value):
        return ""
    return f"{value:.0f}" if abs(value) >= 100.0 else f"{value:.3g}"
