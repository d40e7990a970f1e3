"""The fit-scanpath command: from a recording of a person's gaze on a face to a walk for ``run``."""

from math import isnan
from pathlib import Path

import numpy as np

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import refuse_existing, write_file
from gazerig.features.lab.analysis.eye_tracker_csv import Samples, read_recording
from gazerig.features.lab.analysis.fixations import (
    FixationParams,
    PartBoxes,
    fixations_of,
    labelled_fixations,
    usual_side,
)
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


def fit_to_recording(
    recording: Path,
    parts: PartBoxes | None,
    out: Path,
    smoothing: str = "laplace",
    seed: int = 0,
    force: bool = False,
) -> str:
    """Fit a walk to a recording, write it as YAML, and return a report as text.

    parts: rectangles of the parts in the recording's coordinates; not needed for labelled parts
    smoothing: "none" or "laplace"; seed: seed of the resampling
    force: replace an existing file

    Raises:
        SetupError: a file cannot be read, trusted or written.
    """
    if smoothing not in SMOOTHINGS:
        raise SetupError(f"no smoothing {smoothing!r}; there are {', '.join(SMOOTHINGS)}")
    if out.resolve() == recording.resolve():
        raise SetupError(f"{out}: is the recording itself; give another file to write to")
    refuse_existing(out, force=force)
    fixations, notes = _fixations(recording, parts)
    try:
        fitted = fit_walk(fixations, smoothing, np.random.default_rng(seed))
        means = tuple(mean.value for mean in fitted.dwell_mean_s)
        sds = tuple(sd.value for sd in fitted.dwell_sd_s)
        if min(means) < 0.001 or max((*means, *sds)) > 60.0:
            raise ValueError(
                f"dwell times of {min(means):g} to {max(means):g} s are no dwells on a face:"
                " check the unit of the times"
            )
        Walk(PARTS, _matrix(fitted), means, sds, fitted.start)
    except ValueError as error:
        raise SetupError(f"{recording}: {error}") from None
    text = walk_yaml(fitted, smoothing, (_one_line(recording.name), *notes, f"seed {seed}"))
    write_file(out, text, force)
    return _report(fitted, smoothing, recording, notes, out)


def walk_yaml(fitted: WalkFit, smoothing: str, about: tuple[str, ...]) -> str:
    """Return a fitted walk as the YAML that a rig's ``walk`` names.

    about: lines with the source of the walk
    """
    level = f"{100.0 * CONFIDENCE:g} %"
    lines = ["# Walk over a face, fitted from a recording:"]
    lines += [f"#   {_one_line(line)}" for line in about]
    lines += [
        "#",
        f"# {sum(fitted.visits)} fixations on the face, {fitted.outside_fixations} elsewhere,"
        f" {_transitions(fitted)} transitions between parts.",
        f"# {_smoothing(smoothing)} Intervals hold {level}, from {RESAMPLES} resamples.",
        "#",
        "# DN chin, FL left side, LE left eye, M mouth, N nose, FR right side, RE right eye,",
        "# UP forehead; left and right are as in the recording's parts, and should be the owner's.",
        "",
        f"order: [{', '.join(PARTS)}]",
        "",
        "# Transition probabilities, 0..1.",
        "matrix:",
        "  #  " + "".join(f"{part:<8}" for part in PARTS).rstrip(),
    ]
    for part, row, counts in zip(PARTS, _matrix(fitted), fitted.counts, strict=True):
        numbers = ", ".join(f"{cell:.4f}" for cell in row)
        lines.append(f"  - [{numbers}]  # from {part}, {sum(counts)} transitions")
    lines += ["", f"# The same with {level} intervals and the counts in brackets."]
    lines += [
        f"#   {a} to {b}: {_ends(cell)} ({n})"
        for a, row, seen in zip(PARTS, fitted.matrix, fitted.counts, strict=True)
        for b, cell, n in zip(PARTS, row, seen, strict=True)
    ]
    lines += ["", "# Dwell times in seconds, in the order above."]
    for part, visits, mean, sd in zip(
        PARTS, fitted.visits, fitted.dwell_mean_s, fitted.dwell_sd_s, strict=True
    ):
        few = ", too few: all parts together" if part in fitted.pooled_parts else ""
        lines.append(f"#   {part}: mean {_ends(mean)}, SD {_ends(sd)} ({visits} fixations{few})")
    lines += [
        f"dwell_mean_s: [{', '.join(f'{mean.value:.4f}' for mean in fitted.dwell_mean_s)}]",
        f"dwell_sd_s: [{', '.join(f'{sd.value:.4f}' for sd in fitted.dwell_sd_s)}]",
        "",
        f"start: {fitted.start}  # part of the first fixation on the face",
    ]
    return "\n".join(lines) + "\n"


def _fixations(
    recording: Path, parts: PartBoxes | None
) -> tuple[tuple[PartFixation, ...], tuple[str, ...]]:
    """Return the fixations of a recording, and a description of their source."""
    read = read_recording(recording)
    try:
        if not isinstance(read, Samples):
            found = labelled_fixations(read, parts)
            return found, (f"{len(found)} fixations from a table; {read.note}",)
        if parts is None:
            raise SetupError("gaze samples need the rectangles of the face's parts (--parts)")
        params = FixationParams()
        found = fixations_of(read, parts, params)
    except SetupError as error:
        raise SetupError(f"{recording}: {error}") from None
    seconds = float(read.time_s[-1] - read.time_s[0])
    lost = sum(map(isnan, read.x.tolist()))
    rate = 1.0 / float(np.median(np.diff(read.time_s)))
    return found, (
        f"{len(read.x)} samples at {rate:.0f} Hz over {seconds:.1f} s,"
        f" {100.0 * lost / len(read.x):.1f} % lost; {read.note}",
        f"{len(found)} fixations by dispersion up to"
        f" {params.dispersion * usual_side(parts):g} (width plus height),"
        f" {params.shortest_ms:g} ms or longer",
    )


def _matrix(fitted: WalkFit) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(cell.value for cell in row) for row in fitted.matrix)


def _transitions(fitted: WalkFit) -> int:
    return sum(sum(row) for row in fitted.counts)


def _smoothing(smoothing: str) -> str:
    if smoothing == "none":
        return "Probabilities are plain shares."
    return f"Laplace smoothing: {PSEUDO_COUNT:g} is added to every count."


def _ends(number: Interval) -> str:
    return f"{number.value:.3f} [{number.low:.3f}, {number.high:.3f}]"


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _report(
    fitted: WalkFit, smoothing: str, recording: Path, notes: tuple[str, ...], out: Path
) -> str:
    """Return the results as text, part by part."""
    shares = np.array(fitted.visits) / sum(fitted.visits)
    lines = [f"{recording}: {note}" for note in notes]
    lines.append(
        f"{sum(fitted.visits)} fixations on the face, {fitted.outside_fixations} elsewhere,"
        f" {_transitions(fitted)} transitions; {smoothing} smoothing"
    )
    rows = zip(PARTS, fitted.visits, shares, fitted.dwell_mean_s, fitted.dwell_sd_s, strict=True)
    for part, n, share, mean, sd in rows:
        few = "  too few, dwell of all parts together" if part in fitted.pooled_parts else ""
        lines.append(
            f"  {PART_NAMES[part]:<11}{n:>6} fixations {100.0 * share:5.1f} %"
            f"   dwell {mean.value:.3f} s [{mean.low:.3f}, {mean.high:.3f}]"
            f"   SD {sd.value:.3f} s{few}"
        )
    widths = [cell.high - cell.low for row in fitted.matrix for cell in row]
    lines.append(
        f"widest interval of a transition: {max(widths):.2f},"
        f" usual: {sorted(widths)[len(widths) // 2]:.2f}"
    )
    lines.append(f"written to {out}; use it as gaze.scanpath.transition_matrix of a rig")
    return "\n".join(lines)
