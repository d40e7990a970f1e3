"""The fit-scanpath command: from a recording of a person's gaze on a face to a walk for ``run``.

Fixations are found by dispersion (I-DT, Salvucci & Goldberg 2000) with pymovements. It requires
samples without losses and at a constant rate, so it receives one unbroken stretch at a time.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Literal, NamedTuple, Self

import msgspec
import numpy as np

from gazerig.drivers.errors import SetupError, install_command
from gazerig.drivers.files.file_input import read_limited
from gazerig.drivers.files.file_output import refuse_existing, write_file
from gazerig.features.lab.analysis.eye_tracker_csv import Samples, read_recording
from gazerig.gaze.scanpath.fit import (
    CONFIDENCE,
    PSEUDO_COUNT,
    RESAMPLES,
    SMOOTHINGS,
    Interval,
    PartFixation,
    WalkFit,
    fit_walk,
)
from gazerig.gaze.scanpath.scanpath import Walk
from gazerig.gaze.types import PART_NAMES, PARTS, Floats

Box = tuple[float, float, float, float]
"""x0, y0, x1, y1 with x0 < x1 and y0 < y1."""
_Part = Literal["DN", "FL", "LE", "M", "N", "FR", "RE", "UP"]
_LARGEST = 100_000  # bytes of a file of them


class PartBoxes(NamedTuple):
    """Rectangles of the parts in the recording's coordinates; parts without one are never seen."""

    boxes: dict[_Part, Box]

    @classmethod
    def read(cls, path: Path) -> Self:
        """Return the rectangles in a YAML file.

        Raises:
            SetupError: it cannot be read, or has a fault.
        """
        try:
            boxes = msgspec.yaml.decode(read_limited(path, _LARGEST), type=dict[_Part, Box])
        except (OSError, msgspec.MsgspecError) as error:
            raise SetupError(f"{path}: {' '.join(str(error).split())}") from None
        for part, (x0, y0, x1, y1) in boxes.items():
            if not (x0 < x1 and y0 < y1):
                raise SetupError(f"{path}: {part}: [x0, y0, x1, y1] needs x0 < x1 and y0 < y1")
        if len(boxes) < 2:
            raise SetupError(f"{path}: at least two parts are needed, each as [x0, y0, x1, y1]")
        return cls(boxes)

    @property
    def widest_fixation(self) -> float:
        """Return the largest width plus height of a fixation, in the recording's coordinates."""
        sides = [min(x1 - x0, y1 - y0) for x0, y0, x1, y1 in self.boxes.values()]
        return DISPERSION * float(np.median(sides))

    def part_at(self, x: float, y: float) -> str | None:
        """Return the part at a position, the smallest one if boxes overlap, None outside."""
        inside = [
            ((x1 - x0) * (y1 - y0), part)
            for part, (x0, y0, x1, y1) in self.boxes.items()
            if x0 <= x <= x1 and y0 <= y <= y1
        ]
        return min(inside)[1] if inside else None


SHORTEST_S, DISPERSION = 0.06, 0.5
"""Shortest fixation; its largest width plus height, over a part's usual shorter side."""
_LONGEST_LOSS_S = 0.075
"""A fixation may go on over a loss of the eye no longer than this."""


class _RawFixation(NamedTuple):
    """A fixation in the recording's coordinates."""

    start_s: float
    end_s: float
    x: float
    y: float


def fixations_of(samples: Samples, boxes: PartBoxes) -> list[PartFixation]:
    """Find the fixations and their parts.

    Raises:
        SetupError: pymovements is not installed, or there are too few samples.
    """
    seen = np.isfinite(samples.x)
    if np.count_nonzero(seen) < 3:
        raise SetupError("fewer than three samples have a gaze position; nothing to fit")
    step_s = float(np.median(np.diff(samples.time_s)))
    t_s = samples.time_s[seen]
    places = np.column_stack([samples.x[seen], samples.y[seen]])
    least = max(2, round(SHORTEST_S / step_s))
    widest = boxes.widest_fixation
    pause_s = max(_LONGEST_LOSS_S, 1.5 * step_s)
    breaks = np.flatnonzero(np.diff(t_s) > pause_s) + 1
    found: list[_RawFixation] = []
    for run in np.split(np.arange(len(t_s)), breaks):
        if len(run) > least:
            found += _find_fixations(t_s[run], places[run], least, widest)
    return [
        PartFixation(boxes.part_at(f.x, f.y), f.start_s, f.end_s - f.start_s)
        for f in _join_split(found, 0.5 * widest, pause_s)
    ]


def _find_fixations(t_s: Floats, places: Floats, least: int, widest: float) -> list[_RawFixation]:
    """Find the fixations of one unbroken stretch."""
    try:
        # Only this command needs it, and its import takes a second.
        from pymovements.events import idt  # type: ignore[import-untyped]
    except ImportError:
        raise SetupError(
            f"finding fixations in samples needs pymovements: {install_command('fit')}"
        ) from None
    frame = idt(places, minimum_duration=least, dispersion_threshold=widest).frame
    found = []
    # The offset is the first sample after the fixation, unless the recording ends with it; so
    # offset - onset is the duration of the fixation's samples.
    for first, last in zip(frame["onset"].to_list(), frame["offset"].to_list(), strict=True):
        x, y = np.median(places[first:last], axis=0).tolist()
        found.append(_RawFixation(float(t_s[first]), float(t_s[last]), x, y))
    return found


def _join_split(found: list[_RawFixation], nearest: float, pause_s: float) -> list[_RawFixation]:
    """Join neighbours that one noisy sample has split: close in position and in time."""
    out: list[_RawFixation] = []
    for new in found:
        if out:
            old = out[-1]
            apart = float(np.hypot(new.x - old.x, new.y - old.y))
            if apart < nearest and new.start_s - old.end_s <= pause_s:
                longer = old if old.end_s - old.start_s >= new.end_s - new.start_s else new
                out[-1] = _RawFixation(old.start_s, new.end_s, longer.x, longer.y)
                continue
        out.append(new)
    return out


_SEED = 0
"""Of the resamples, so that the same recording gives the same walk."""


def fit_to_recording(
    recording: Path,
    boxes: PartBoxes | None,
    out: Path,
    smoothing: str = "laplace",
    mapping: Mapping[str, str] = {},  # noqa: B006  # is not changed
    force: bool = False,
) -> str:
    """Fit a walk to a recording, write it as YAML, and return a report as text.

    Args:
        recording: Table of gaze samples or fixations.
        boxes: Rectangles of the parts in its coordinates; not needed for labelled parts.
        out: File to write.
        smoothing: "none" or "laplace".
        mapping: Names of its columns; see ``read_recording``.
        force: Whether to replace an existing file.

    Raises:
        SetupError: a file cannot be read, trusted or written.
    """
    if smoothing not in SMOOTHINGS:
        raise SetupError(f"no smoothing {smoothing!r}; there are {', '.join(SMOOTHINGS)}")
    if out.resolve() == recording.resolve():
        raise SetupError(f"{out}: is the recording itself; give another file to write to")
    refuse_existing(out, force=force)
    fixations, note = _fixations(recording, boxes, mapping)
    try:
        fitted = fit_walk(fixations, smoothing, np.random.default_rng(_SEED))
        means = [mean.value for mean in fitted.dwell_mean_s]
        sds = [sd.value for sd in fitted.dwell_sd_s]
        if min(means) < 0.001 or max(*means, *sds) > 60.0:
            raise ValueError(
                f"dwell times of {min(means):g} to {max(means):g} s are no dwells on a face:"
                " check the unit of the times"
            )
        matrix = [[cell.value for cell in row] for row in fitted.matrix]
        Walk(PARTS, tuple(map(tuple, matrix)), tuple(means), tuple(sds), fitted.start)
    except ValueError as error:
        raise SetupError(f"{recording}: {error}") from None
    lines = [" ".join(recording.name.split()), note, *_report(fitted, smoothing)]
    write_file(out, _walk_yaml(fitted, matrix, lines), force)
    use = f"written to {out}; use it as gaze.scanpath.transition_matrix of a rig"
    return "\n".join([*lines, use])


def _fixations(
    recording: Path, boxes: PartBoxes | None, mapping: Mapping[str, str]
) -> tuple[list[PartFixation], str]:
    """Return the fixations of a recording, and a description of their source."""
    read = read_recording(recording, mapping, None if boxes is None else boxes.part_at)
    if not isinstance(read, Samples):
        return read
    if boxes is None:
        raise SetupError(f"{recording}: samples need the rectangles of the face's parts (--parts)")
    return fixations_of(read, boxes), (
        f"{len(read.x)} samples at {1.0 / np.median(np.diff(read.time_s)):.0f} Hz,"
        f" {100.0 * np.isnan(read.x).mean():.1f} % lost; {read.note}; fixations by dispersion up to"
        f" {boxes.widest_fixation:g} (width plus height), {1e3 * SHORTEST_S:g} ms or longer"
    )


def _report(fitted: WalkFit, smoothing: str) -> list[str]:
    """Return the results as text, part by part."""
    looks = sum(fitted.visits)
    added = f", {PSEUDO_COUNT:g} added to every count" if smoothing == "laplace" else ""
    rows = zip(PARTS, fitted.visits, fitted.dwell_mean_s, fitted.dwell_sd_s, strict=True)
    widths = sorted(cell.high - cell.low for row in fitted.matrix for cell in row)
    return [
        f"{looks} fixations on the face, {fitted.outside_fixations} elsewhere,"
        f" {sum(map(sum, fitted.counts))} transitions; {smoothing} smoothing{added}",
        *(
            f"  {PART_NAMES[part]:<11}{n:>6} fixations {100.0 * n / looks:5.1f} %"
            f"   dwell {_ends(mean)} s   SD {_ends(sd)} s"
            + ("  too few: all parts together" if part in fitted.pooled_parts else "")
            for part, n, mean, sd in rows
        ),
        f"widest interval of a transition: {widths[-1]:.2f}, usual: {widths[len(widths) // 2]:.2f}",
        f"brackets hold {100.0 * CONFIDENCE:g} %, from {RESAMPLES} resamples",
    ]


def _walk_yaml(fitted: WalkFit, matrix: list[list[float]], about: list[str]) -> str:
    """Return a fitted walk as the YAML that a rig's ``transition_matrix`` names."""
    cells = zip(PARTS, matrix, fitted.counts, strict=True)
    return "\n".join([
        "# Walk over a face, fitted from a recording:",
        *(f"#   {line}" for line in about),
        "# Left and right are as in the recording's parts, and should be the owner's.",
        f"order: [{', '.join(PARTS)}]",
        "matrix:",
        *(
            f"  - [{_numbers(row)}]  # from {part}, {sum(counts)} transitions"
            for part, row, counts in cells
        ),
        f"dwell_mean_s: [{_numbers([mean.value for mean in fitted.dwell_mean_s])}]",
        f"dwell_sd_s: [{_numbers([sd.value for sd in fitted.dwell_sd_s])}]",
        f"start: {fitted.start}  # part of the first fixation on the face",
        "",
    ])  # fmt: skip


def _numbers(values: list[float]) -> str:
    return ", ".join(f"{value:.4f}" for value in values)


def _ends(number: Interval) -> str:
    return f"{number.value:.3f} [{number.low:.3f}, {number.high:.3f}]"
