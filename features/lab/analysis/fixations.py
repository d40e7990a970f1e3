"""Fixations on the parts of a face, from gaze samples.

Fixations are found by dispersion (I-DT, Salvucci & Goldberg 2000) with pymovements. It requires
samples without losses and at a constant rate, so it receives one unbroken stretch at a time.
"""

from pathlib import Path
from typing import NamedTuple, Self

import msgspec
import numpy as np

from gazerig.drivers.errors import SetupError, install_command
from gazerig.drivers.files.file_input import read_limited
from gazerig.features.lab.analysis.eye_tracker_csv import Samples
from gazerig.gaze.scanpath.fit import PartFixation
from gazerig.gaze.types import PARTS, Floats

Box = tuple[float, float, float, float]
"""x0, y0, x1, y1 with x0 < x1 and y0 < y1."""
_LARGEST = 100_000  # bytes of a file of them


class PartBoxes(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Rectangles of the parts in the recording's coordinates; parts without one are never seen."""

    DN: Box | None = None
    FL: Box | None = None
    LE: Box | None = None
    M: Box | None = None
    N: Box | None = None
    FR: Box | None = None
    RE: Box | None = None
    UP: Box | None = None

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

    @classmethod
    def read(cls, path: Path) -> Self:
        """Return the rectangles in a YAML file.

        Raises:
            SetupError: it cannot be read, or has a fault.
        """
        try:
            return msgspec.yaml.decode(read_limited(path, _LARGEST), type=cls)
        except (OSError, msgspec.MsgspecError) as error:
            raise SetupError(f"{path}: {' '.join(str(error).split())}") from None

    @property
    def boxes(self) -> dict[str, Box]:
        """Return the given boxes."""
        every = ((part, getattr(self, part)) for part in PARTS)
        return {part: box for part, box in every if box is not None}

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
        raise SetupError("fewer than three samples with a gaze position; nothing to fit")
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
