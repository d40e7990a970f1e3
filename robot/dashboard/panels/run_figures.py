"""Measures of the present run with the ranges of people, for the drawer Report.

They are computed from the eye movements in the snapshots. The report of a recording computes
these and more from every tick; its bands are used here.
"""

from html import escape
from math import sqrt
from typing import NamedTuple

from gazerig.robot.analysis import human_norms as human
from gazerig.robot.analysis.human_norms import BY_KEY, NormBand
from gazerig.robot.dashboard.panels.dwell_chart import DwellChart
from gazerig.robot.dashboard.widgets.html import note
from gazerig.robot.model.types import SeenBlink, SeenSaccade, Snapshot

LEAST_DEG = 1.0
"""Smallest saccade that counts, deg, as in the report: encoder steps distort smaller ones."""

_SMALL_PEAK_DEG, _SMALL_DURATION_DEG, _LARGE_DEG = 8.0, 12.0, 15.0
_SOON_S, _PAUSE_S = 0.1, 2.0
_LEAST_RATE_S = 60.0
_SURE = 1.96
"""Distance to a range, in standard errors, that is chance in one of twenty cases."""
_TALKING = ("talk", "listen", "think")

HOW_TO = note(
    "A report judges a recording by all of this and more, each with its source. Record a run with "
    "gazerig run RIG --record evening.mcap, then make one HTML file with gazerig report "
    "evening.mcap."
)


class RunFigure(NamedTuple):
    """Measure: its value and its number of events."""

    key: str
    value: float
    events: int


class RunFigures:
    """Counter of eye movements since the start."""

    def __init__(self) -> None:
        self._inside: dict[str, list[int]] = {}  # key -> number inside, total number
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
        low, high = float(human.slowest_peak(size)), float(human.fastest_peak(size))
        key = "peak_small" if size < _SMALL_PEAK_DEG else "peak_large"
        self._count(key, low <= saccade.peak_deg_s <= high)
        low, high = float(human.shortest_ms(size)), float(human.longest_ms(size))
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

    As in the report, a measure is not called outside if its distance may be chance.
    """
    if figure.events < band.least:
        return f"too few: {figure.events} of {band.least}"
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
