"""The fit-scanpath command: from a recording of a person's gaze on a face to a walk for ``run``."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import refuse_existing, write_file
from gazerig.features.lab.analysis.eye_tracker_csv import (
    FixationTable,
    Samples,
    read_recording,
)
from gazerig.features.lab.analysis.fixations import SHORTEST_S, PartBoxes, fixations_of
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
from gazerig.gaze.types import PART_NAMES, PARTS

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
    read = read_recording(recording, mapping)
    try:
        fixations, note = _fixations(read, boxes)
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
    except (SetupError, ValueError) as error:
        raise SetupError(f"{recording}: {error}") from None
    lines = [" ".join(recording.name.split()), note, *_report(fitted, smoothing)]
    write_file(out, _walk_yaml(fitted, matrix, lines), force)
    use = f"written to {out}; use it as gaze.scanpath.transition_matrix of a rig"
    return "\n".join([*lines, use])


def _fixations(
    read: Samples | FixationTable, boxes: PartBoxes | None
) -> tuple[list[PartFixation], str]:
    """Return the fixations of a recording, and a description of their source."""
    if isinstance(read, FixationTable):
        parts = read.parts
        if not read.labelled:
            if boxes is None:
                raise SetupError("fixations without parts need their rectangles (--parts)")
            parts = [boxes.part_at(x, y) for x, y in zip(read.x, read.y, strict=True)]
        rows = zip(parts, read.start_s.tolist(), read.duration_s.tolist(), strict=True)
        return [PartFixation(*row) for row in rows], f"fixations of a table; {read.note}"
    if boxes is None:
        raise SetupError("gaze samples need the rectangles of the face's parts (--parts)")
    found = fixations_of(read, boxes)
    return found, (
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
