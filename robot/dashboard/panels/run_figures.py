"""Measures and charts of the present run's eye movements, with the ranges of people.

The measures are computed from the eye movements in the snapshots. The report of a recording
computes these and more from every tick; its ranges are also used here. Mean dwell times on the
parts of a face are those of Nakamoto & Tsuruno, table 1.
"""

from collections import Counter, defaultdict, deque
from collections.abc import Callable, Iterable
from html import escape
from math import sqrt
from typing import NamedTuple

import numpy as np

from gazerig.gaze.types import PART_NAMES, PARTS, Floats
from gazerig.robot.analysis import human_norms as human
from gazerig.robot.analysis.human_norms import (
    BY_KEY,
    DWELL_MEAN_S,
    NormBand,
    highest_peak_deg_s,
    longest_duration_ms,
    lowest_peak_deg_s,
    shortest_duration_ms,
)
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
from gazerig.robot.model.types import SeenBlink, SeenFixation, SeenSaccade, Snapshot

KEPT = 400
"""Largest number of saccades shown, the newest ones."""

_LEFT_PX, _RIGHT_PX, _TOP_PX, _FOOT_PX = 38.0, LINE_PX - 10.0, 8.0, 132.0
_WIDEST_DEG = (5.0, 10.0, 20.0, 40.0, 80.0)
_FASTEST_DEG_S = (200.0, 400.0, 600.0, 1000.0)
_LONGEST_MS = (80.0, 160.0, 320.0)
_TICKS = 4
Curve = Callable[[Floats], Floats]


class MainSequenceChart:
    """Chart of the newest saccades."""

    def __init__(self) -> None:
        self._seen: deque[SeenSaccade] = deque(maxlen=KEPT)
        self.count = 0

    def update(self, saccade: SeenSaccade) -> None:
        """Add a saccade."""
        self._seen.append(saccade)
        self.count += 1

    def drawing(self) -> str:
        """Return both charts as HTML."""
        sizes = [s.amplitude_deg for s in self._seen]
        widest = _axis_end(_WIDEST_DEG, sizes)
        speeds = [s.peak_deg_s for s in self._seen]
        lengths = [1e3 * s.duration_s for s in self._seen]
        speed, length = "peak speed, deg/s, against size, deg", "duration, ms, against size, deg"
        fastest, longest = _axis_end(_FASTEST_DEG_S, speeds), _axis_end(_LONGEST_MS, lengths)
        return (
            heading(speed, count_text(self.count, "saccade"))
            + _image(speed, sizes, speeds, widest, fastest, lowest_peak_deg_s, highest_peak_deg_s)
            + heading(length)
            + _image(
                length, sizes, lengths, widest, longest, shortest_duration_ms, longest_duration_ms
            )
            + note(
                "grey: people, from Baloh et al. 1975 less 15 % to Bahill et al. 1975 and "
                "Collewijn et al. 1988 and 15 % (speed); 21 ms + 2.2 ms/deg less a quarter to "
                "25 ms + 2.4 ms/deg (Lee, Badler & Badler 2002) and a quarter (duration); "
                "orange: the newest"
            )
        )


def _axis_end(choices: tuple[float, ...], values: list[float]) -> float:
    """Return the smallest end of an axis that includes all values, else the largest."""
    most = max(values, default=0.0)
    return next((choice for choice in choices if choice >= most), choices[-1])


def _image(
    title: str,
    x: list[float],
    y: list[float],
    widest: float,
    highest: float,
    low: Curve,
    high: Curve,
) -> str:
    def at(size: float, value: float) -> tuple[float, float]:
        across = _LEFT_PX + min(1.0, size / widest) * (_RIGHT_PX - _LEFT_PX)
        return across, _FOOT_PX - min(1.0, value / highest) * (_FOOT_PX - _TOP_PX)

    sizes = np.linspace(0.0, widest, 41)
    lower, upper = low(sizes).tolist(), high(sizes).tolist()
    edge = [*zip(sizes.tolist(), lower, strict=True)]
    edge += reversed([*zip(sizes.tolist(), upper, strict=True)])
    band = [at(*point) for point in edge]
    outline = " ".join(f"{u:.1f},{v:.1f}" for u, v in band)
    people = f"<polygon points='{outline}' class='svg-people'/>"
    dots = []
    for i, (a, b) in enumerate(zip(x, y, strict=True)):
        (u, v), is_newest = at(a, b), i == len(x) - 1
        radius, kind = (3.4, "svg-dot newest") if is_newest else (2.0, "svg-dot")
        dots.append(f"<circle cx='{u:.1f}' cy='{v:.1f}' r='{radius}' class='{kind}'/>")
    inside = sum(low(np.array(a)) <= b <= high(np.array(a)) for a, b in zip(x, y, strict=True))
    says = f"{title}: {inside} of {len(x)} saccades inside the human range"
    return svg(_FOOT_PX + 18.0, (people, *_axes(widest, highest), *dots), says)


def _axes(widest: float, highest: float) -> Iterable[str]:
    for i in range(_TICKS + 1):
        share = i / _TICKS
        x = _LEFT_PX + share * (_RIGHT_PX - _LEFT_PX)
        y = _FOOT_PX - share * (_FOOT_PX - _TOP_PX)
        yield line(((_LEFT_PX, y), (_RIGHT_PX, y)), "axis" if i == 0 else "grid")
        yield text(x, _FOOT_PX + 15.0, f"{share * widest:g}", "middle")
        yield text(_LEFT_PX - 4.0, y + 4.5, f"{share * highest:g}", "end")


MEASURED_MEAN_S = dict(zip(PARTS, DWELL_MEAN_S, strict=True))
"""Mean dwell times of a person, s (Nakamoto & Tsuruno, table 1)."""

BIN_S, BINS = 0.1, 12
"""Width, s, and number of the bins; the last one also counts all longer fixations."""

_ROW_PX, _ROWS_TOP_PX = 23.0, 18.0
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
            for piece in self._row(_ROWS_TOP_PX + row * _ROW_PX, part, shares.get(part, 0.0), most)
        ]
        foot = _ROWS_TOP_PX + len(PARTS) * _ROW_PX
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


LEAST_DEG = 1.0
"""Smallest saccade that counts, deg, as in the report: encoder steps distort smaller ones."""

_SMALL_PEAK_DEG, _SMALL_DURATION_DEG, _LARGE_DEG = 8.0, 12.0, 15.0
_SOON_S, _PAUSE_S = 0.1, 2.0
_LEAST_RATE_S = 60.0
_SURE = 1.96
"""Distance to a range, in standard errors, that occurs by chance in one of twenty cases."""
_TALKING = ("talk", "listen", "think")

HOW_TO = note(
    "A report judges a recording by all of this and more, each with its source. Record a run with "
    "gazerig run RIG --record evening.mcap, then make one HTML file with gazerig report "
    "evening.mcap."
)


class RunFigure(NamedTuple):
    """Measure: its value and the number of events."""

    key: str
    value: float
    events: int


class RunFigures:
    """Counter of eye movements since the start."""

    def __init__(self) -> None:
        self._inside: dict[str, list[int]] = {}  # key -> number inside the range, total number
        self._first_s: float | None = None
        self._now_s = 0.0
        self._blinks = self._saccades = 0
        self._last_end_s: float | None = None
        self._talking = False

    def update(self, snapshot: Snapshot) -> None:
        """Add a snapshot."""
        if self._first_s is None:
            self._first_s = snapshot.t_s
        self._now_s = snapshot.t_s
        self._talking = snapshot.conversation in _TALKING
        for event in snapshot.events:
            if isinstance(event, SeenSaccade):
                self._add(event)
            elif isinstance(event, SeenBlink):
                self._blinks += 1

    def _add(self, saccade: SeenSaccade) -> None:
        self._saccades += 1
        if self._last_end_s is not None:
            pause_s = saccade.onset_s - self._last_end_s
            if pause_s < _PAUSE_S:
                self._count("too_soon", pause_s < _SOON_S)
        self._last_end_s = saccade.onset_s + saccade.duration_s
        size = saccade.amplitude_deg
        if size < LEAST_DEG:
            return
        low, high = float(human.lowest_peak_deg_s(size)), float(human.highest_peak_deg_s(size))
        key = "peak_small" if size < _SMALL_PEAK_DEG else "peak_large"
        self._count(key, low <= saccade.peak_deg_s <= high)
        low, high = float(human.shortest_duration_ms(size)), float(human.longest_duration_ms(size))
        key = "duration_small" if size < _SMALL_DURATION_DEG else "duration_large"
        self._count(key, low <= 1e3 * saccade.duration_s <= high)
        self._count("below_15", size < _LARGE_DEG)

    def _count(self, key: str, fits: object) -> None:
        counts = self._inside.setdefault(key, [0, 0])
        counts[0] += bool(fits)
        counts[1] += 1

    def figures(self, dwell: DwellChart) -> list[RunFigure]:
        """Return all measures; dwell: fixations on parts of faces."""
        seconds = self._now_s - self._first_s if self._first_s is not None else 0.0
        found = [RunFigure(key, inside / n, n) for key, (inside, n) in self._inside.items()]
        if seconds > 0.0:
            found.append(RunFigure("rate", self._saccades / seconds, self._saccades))
        if seconds >= _LEAST_RATE_S:
            key = "blink_rate_talk" if self._talking else "blink_rate"
            found.append(RunFigure(key, 60.0 * self._blinks / seconds, self._blinks))
        if shares := dwell.shares():
            found.append(RunFigure("eyes_share", shares["LE"] + shares["RE"], dwell.rests))
        order = list(BY_KEY)
        return sorted(found, key=lambda figure: order.index(figure.key))

    def table(self, dwell: DwellChart) -> str:
        """Return the measures as HTML."""
        rows = "".join(_row(figure, BY_KEY[figure.key]) for figure in self.figures(dwell))
        if not rows:
            return note("no eye movement has been seen yet")
        seconds = self._now_s - (self._first_s or 0.0)
        return (
            "<div class='scroll'><table><thead><tr><th scope='col'>since the start, "
            f"{seconds / 60.0:.1f} min</th><th scope='col'>here</th><th scope='col'>people</th>"
            f"</tr></thead><tbody>{rows}</tbody></table></div>"
        )


def compare_with_band(figure: RunFigure, band: NormBand) -> str:
    """Return the relation of a measure to the range of people as text.

    As in the report, a measure does not count as outside if the difference may be chance.
    """
    if figure.events < band.min_events:
        return f"too few: {figure.events} of {band.min_events}"
    if band.low <= figure.value <= band.high:
        return "inside"
    if band.unit == "share":
        spread = sqrt(max(figure.value * (1.0 - figure.value), 0.25 / figure.events))
    else:
        spread = figure.value
    off = max(band.low - figure.value, figure.value - band.high)
    return "may be chance" if off <= _SURE * spread / sqrt(figure.events) else "outside"


def _row(figure: RunFigure, band: NormBand) -> str:
    """Return the row of one measure: its value and the range of people."""
    verdict = compare_with_band(figure, band)
    kind = " class='near'" if verdict == "outside" else ""
    unit, factor = ("%", 100.0) if band.unit == "share" else (band.unit, 1.0)
    here, low, high = (f"{factor * value:.3g}" for value in (figure.value, band.low, band.high))
    return (
        f"<tr title='{escape(band.source)}'><th scope='row'>{escape(band.title)}"
        f"<div class='quiet'>{verdict}</div></th><td{kind}>{here} {escape(unit)}</td>"
        f"<td>{low} to {high}</td></tr>"
    )
