"""Dwell times of the gaze on the parts of a face, with those of one measured person.

Mean dwell times per part are those of Nakamoto & Tsuruno, table 1.
"""

from collections import Counter, defaultdict

from gazerig.gaze.types import PART_NAMES, PARTS
from gazerig.robot.analysis.human_norms import DWELL_MEAN_S
from gazerig.robot.dashboard.widgets.html import (
    LINE_PX,
    box,
    count_text,
    heading,
    line,
    note,
    svg,
    text,
)
from gazerig.robot.model.types import SeenFixation

MEASURED_MEAN_S = dict(zip(PARTS, DWELL_MEAN_S, strict=True))
"""Mean dwell times of a person, s (Nakamoto & Tsuruno, table 1)."""

BIN_S, BINS = 0.1, 12
"""Width, s, and number of the bins; the last also has all longer fixations."""

_ROW_PX, _TOP_PX = 23.0, 18.0
_SHARE_PX, _SHARE_WIDE_PX = 70.0, 78.0
_BINS_PX = 204.0
_BIN_PX = (LINE_PX - 6.0 - _BINS_PX) / BINS


class DwellChart:
    """Chart of fixations by face part."""

    def __init__(self) -> None:
        self._seconds: defaultdict[str, float] = defaultdict(float)
        self._bins: dict[str, Counter[int]] = {part: Counter() for part in PARTS}
        self._counts: Counter[str] = Counter()

    def update(self, fixation: SeenFixation) -> None:
        """Add a fixation; those on no face part are ignored."""
        part = fixation.part
        if part is None:
            return
        self._seconds[part] += fixation.duration_s
        self._counts[part] += 1
        self._bins[part][min(BINS - 1, int(fixation.duration_s / BIN_S))] += 1

    def shares(self) -> dict[str, float]:
        """Return each part's share of the time on parts; empty before the first fixation."""
        whole = sum(self._seconds.values())
        return {part: self._seconds[part] / whole for part in PARTS} if whole > 0.0 else {}

    @property
    def rests(self) -> int:
        """Number of fixations on a part of a face."""
        return sum(self._counts.values())

    def drawing(self) -> str:
        """Return one row for each part as HTML: share of time, and histogram of durations."""
        shares = self.shares()
        most = max(shares.values(), default=1.0)
        rows = [
            piece
            for row, part in enumerate(PARTS)
            for piece in self._row(_TOP_PX + row * _ROW_PX, part, shares.get(part, 0.0), most)
        ]
        foot = _TOP_PX + len(PARTS) * _ROW_PX
        ends = (
            text(_BINS_PX, foot + 13.0, "0"),
            text(LINE_PX - 4.0, foot + 13.0, f"{BIN_S * BINS:.1f} s and more", "end"),
            text(_SHARE_PX, 12.0, "share of time"),
            text(_BINS_PX, 12.0, "rests by length"),
        )
        said = ", ".join(
            f"{PART_NAMES[part]} {100.0 * shares.get(part, 0.0):.0f} %" for part in PARTS
        )
        return (
            heading("rests on face parts", count_text(self.rests, "rest"))
            + svg(foot + 17.0, (*rows, *ends), f"share of the time on each part: {said}")
            + note(
                "dashes: mean of the person measured (Nakamoto & Tsuruno, table 1); "
                "left and right are the owner's"
            )
        )

    def _row(self, top: float, part: str, share: float, most: float) -> list[str]:
        colour = f"part-{part}"
        foot = top + _ROW_PX - 4.0
        pieces = [text(1.0, foot - 3.0, PART_NAMES[part])]
        pieces.append(box(_SHARE_PX, foot - 12.0, _SHARE_WIDE_PX * share / most, 10.0, colour))
        words = f"{100.0 * share:.0f} %"
        pieces.append(text(_SHARE_PX + _SHARE_WIDE_PX * share / most + 3.0, foot - 3.0, words))
        pieces.append(line(((_BINS_PX, foot), (LINE_PX - 6.0, foot)), "grid"))
        bins = self._bins[part]
        highest = max(bins.values(), default=1)
        for i, n in sorted(bins.items()):
            high = (_ROW_PX - 6.0) * n / highest
            says = f"{n} of {1e3 * i * BIN_S:.0f} ms and more"
            pieces.append(
                box(_BINS_PX + i * _BIN_PX, foot - high, _BIN_PX - 1.0, high, colour, says)
            )
        mean = _BINS_PX + MEASURED_MEAN_S[part] / BIN_S * _BIN_PX
        pieces.append(line(((mean, foot + 2.0), (mean, top)), "mean", dash="2 1.5"))
        return pieces
