"""Fixations on the parts of a face, from gaze samples.

Fixations are found by dispersion (I-DT, Salvucci & Goldberg 2000) with pymovements. It requires
samples without losses and at a constant rate, so it receives one unbroken stretch at a time.
"""

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from gazerig.drivers.errors import SetupError, install_command
from gazerig.features.lab.analysis.eye_tracker_csv import FixationTable, Samples
from gazerig.gaze.scanpath.fit import PartFixation
from gazerig.gaze.types import PARTS, Floats
from gazerig.params import Bounds

Box = tuple[float, float, float, float]
"""x0, y0, x1, y1 with x0 < x1 and y0 < y1."""


@dataclass(frozen=True)
class PartBoxes:
    """Rectangles of the parts in the recording's coordinates; parts without one are never seen."""

    DN: Annotated[Box | None, Bounds(-1e6, 1e6), "x0, y0, x1, y1 of the chin"] = None
    FL: Annotated[Box | None, Bounds(-1e6, 1e6), "x0, y0, x1, y1 of the left side"] = None
    LE: Annotated[Box | None, Bounds(-1e6, 1e6), "x0, y0, x1, y1 of the left eye"] = None
    M: Annotated[Box | None, Bounds(-1e6, 1e6), "x0, y0, x1, y1 of the mouth"] = None
    N: Annotated[Box | None, Bounds(-1e6, 1e6), "x0, y0, x1, y1 of the nose"] = None
    FR: Annotated[Box | None, Bounds(-1e6, 1e6), "x0, y0, x1, y1 of the right side"] = None
    RE: Annotated[Box | None, Bounds(-1e6, 1e6), "x0, y0, x1, y1 of the right eye"] = None
    UP: Annotated[Box | None, Bounds(-1e6, 1e6), "x0, y0, x1, y1 of the forehead"] = None

    def __post_init__(self) -> None:
        """Check that there are boxes, and that each has a positive width and height.

        Raises:
            ValueError: fewer than two boxes, or corners out of order.
        """
        if len(self.boxes) < 2:
            raise ValueError("at least two parts are needed, each as [x0, y0, x1, y1]")
        for part, (x0, y0, x1, y1) in self.boxes.items():
            if not (x0 < x1 and y0 < y1):
                raise ValueError(f"{part}: [x0, y0, x1, y1] needs x0 < x1 and y0 < y1")

    @property
    def boxes(self) -> dict[str, Box]:
        """Return the given boxes."""
        every = ((part, getattr(self, part)) for part in PARTS)
        return {part: box for part, box in every if box is not None}

    def part_at(self, x: float, y: float) -> str | None:
        """Return the part at a position, the smallest one if boxes overlap, None outside."""
        inside = [
            ((x1 - x0) * (y1 - y0), part)
            for part, (x0, y0, x1, y1) in self.boxes.items()
            if x0 <= x <= x1 and y0 <= y <= y1
        ]
        return min(inside)[1] if inside else None


@dataclass(frozen=True)
class FixationParams:
    """Criteria of a fixation."""

    # fmt: off
    shortest_ms: Annotated[float, Bounds(10, 1000), "shortest fixation"] = 60.0
    dispersion: Annotated[float, Bounds(0.05, 5), "largest width plus height of a fixation, over a part's usual shorter side"] = 0.5
    longest_loss_ms: Annotated[float, Bounds(0, 1000), "a fixation may go on over a loss of the eye no longer than this"] = 75.0
    # fmt: on


class _RawFixation(NamedTuple):
    """A fixation in the recording's coordinates."""

    start_s: float
    end_s: float
    x: float
    y: float


def fixations_of(
    samples: Samples, boxes: PartBoxes, params: FixationParams
) -> tuple[PartFixation, ...]:
    """Find the fixations and their parts.

    Raises:
        SetupError: pymovements is not installed, or there are too few samples.
    """
    seen = np.isfinite(samples.x)
    if np.count_nonzero(seen) < 3:
        raise SetupError("fewer than three samples with a gaze position; nothing to fit")
    step_s = float(np.median(np.diff(samples.time_s)))
    t_s = samples.time_s[seen]
    places = np.column_stack([samples.x[seen], samples.y[seen]])
    least = max(2, round(params.shortest_ms / 1e3 / step_s))
    widest = params.dispersion * usual_side(boxes)
    pause_s = max(params.longest_loss_ms / 1e3, 1.5 * step_s)
    breaks = np.flatnonzero(np.diff(t_s) > pause_s) + 1
    found: list[_RawFixation] = []
    for run in np.split(np.arange(len(t_s)), breaks):
        if len(run) > least:
            found += _find_fixations(t_s[run], places[run], least, widest)
    joined = _join_split(found, 0.5 * widest, pause_s)
    return tuple(
        PartFixation(boxes.part_at(f.x, f.y), f.start_s, f.end_s - f.start_s) for f in joined
    )


def labelled_fixations(table: FixationTable, boxes: PartBoxes | None) -> tuple[PartFixation, ...]:
    """Return the fixations of a table, with parts from its labels or else from the boxes.

    Raises:
        SetupError: there are neither labels nor boxes.
    """
    if not table.labelled and boxes is None:
        raise SetupError("fixations without a part column need the rectangles of the parts")
    return tuple(
        PartFixation(
            row.part if table.labelled or boxes is None else boxes.part_at(*row.p),
            row.start_s,
            row.duration_s,
        )
        for row in table.rows
    )


def usual_side(boxes: PartBoxes) -> float:
    """Return the median of the boxes' shorter sides, the scale for dispersion."""
    return float(np.median([min(x1 - x0, y1 - y0) for x0, y0, x1, y1 in boxes.boxes.values()]))


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
