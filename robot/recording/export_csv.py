"""A run as CSV that eye-tracking tools and spreadsheets open: samples, events, fixations.

Angles and signs are those of robot.recording.gaze_angles; an empty cell is a lost eye.
"""

import csv
from collections.abc import Iterable, Iterator, Sequence
from math import isfinite
from pathlib import Path

from robot.recording.gaze_angles import MOVEMENTS, Trace
from robot.recording.gaze_labels import Labels, Stretch

SAMPLES = (
    "time_s", "x_deg", "y_deg", "left_x_deg", "left_y_deg", "right_x_deg", "right_y_deg",
    "head_yaw_deg", "head_pitch_deg", "head_roll_deg", "left_lid", "right_lid",
    "event", "movement", "target", "part",
)  # fmt: skip
"""x_deg, y_deg: the cyclopean gaze; lids: 0 shut .. 1 open; event: blink, else the movement;
target, part: what the eyes are on, and in a saccade what they go to."""

EVENTS = ("onset_s", "duration_s", "event", "amplitude_deg", "peak_deg_s", "target", "part")
FIXATIONS = ("start_s", "duration_s", "part", "target")
"""As `gazerig fit-scanpath` reads them; a pursued part is a fixated one here."""


def write_csv(
    trace: Trace, labels: Labels, stretches: Sequence[Stretch], stem: Path
) -> tuple[Path, ...]:
    """Write STEM_samples.csv, STEM_events.csv and STEM_fixations.csv; give their paths.

    Raises:
        OSError: they cannot be written.
    """
    made = (
        ("samples", SAMPLES, _sample_rows(trace, labels)),
        ("events", EVENTS, map(_event_row, stretches)),
        ("fixations", FIXATIONS, _fixation_rows(stretches)),
    )
    return tuple(
        _write(stem.with_name(f"{stem.name}_{kind}.csv"), names, rows) for kind, names, rows in made
    )


def number(value: float | None, decimals: int = 4) -> str:
    """Write a number, "" where there is none."""
    return "" if value is None or not isfinite(value) else f"{value:.{decimals}f}"


def _write(path: Path, names: Sequence[str], rows: Iterable[Sequence[str]]) -> Path:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        writer.writerows(rows)
    return path


def _sample_rows(trace: Trace, labels: Labels) -> Iterator[list[str]]:
    columns = zip(
        trace.time_s.tolist(), trace.cyclopean_deg.tolist(), trace.left_deg.tolist(),
        trace.right_deg.tolist(), trace.head_deg.tolist(), trace.lids.tolist(),
        labels.event(), labels.movement.tolist(), labels.looked_at.tolist(), strict=True,
    )  # fmt: skip
    for time_s, *angles, lids, event, movement, looked_at in columns:
        name = trace.names[looked_at]
        yield [
            number(time_s, 6),
            *(number(value) for pair in angles for value in pair),
            *(number(value, 3) for value in lids),
            event, MOVEMENTS[movement], name.target, name.part,
        ]  # fmt: skip


def _event_row(stretch: Stretch) -> list[str]:
    return [
        number(stretch.onset_s, 6),
        number(stretch.duration_s, 6),
        stretch.event,
        number(stretch.amplitude_deg, 3),
        number(stretch.peak_deg_s, 1),
        *stretch.looked_at,
    ]


def _fixation_rows(stretches: Sequence[Stretch]) -> Iterator[list[str]]:
    """Give one row a stay: fixation and pursuit of one part, without a saccade between, are one."""
    stay: Stretch | None = None
    for s in (s for s in stretches if s.event != "blink"):
        rests = s.event in ("fixation", "pursuit")
        if stay is not None and rests and s.looked_at == stay.looked_at:
            stay = stay._replace(duration_s=s.onset_s + s.duration_s - stay.onset_s)
            continue
        if stay is not None:
            yield _fixation_row(stay)
        stay = s if rests else None
    if stay is not None:
        yield _fixation_row(stay)


def _fixation_row(stay: Stretch) -> list[str]:
    target, part = stay.looked_at
    return [number(stay.onset_s, 6), number(stay.duration_s, 6), part, target]
