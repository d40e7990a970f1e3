"""The picture of a sweep: curves with their spread over seeds, or heat maps of two parameters."""

import textwrap
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gazerig.features.lab.analysis.human_norms import BANDS, BY_KEY, NormBand
from gazerig.features.lab.report.plotting import (
    COLOURS,
    HUMAN_FILL,
    INK,
    Axes,
    Figure,
    draw_no_data,
    draw_png,
)
from gazerig.features.lab.sweep.axes import Axis
from gazerig.features.lab.sweep.run_outcome import OUTSIDE, REPORT, Outcome
from gazerig.gaze.types import Floats

PICTURE = "response.png"

_MOST = {1: 6, 2: 6}
"""Number of columns shown, by number of axes; for more axes, ``_ROWS`` rows of panels."""
_ROWS = 3
_PANEL_IN = (3.3, 2.7)
_ANNOTATED = 64
_TITLE_WIDE = 38
_CURVE_KEY = "line: mean; blue: one standard deviation; dots: runs; grey: band of people"
_HEAT_KEY = "mean over seeds; bold: inside the band of people"


def response_png(
    axes: Sequence[Axis], outcomes: Sequence[Outcome], shown: Sequence[str] = ()
) -> bytes:
    """Draw the response of figures to the parameters.

    Args:
        axes: the varied parameters.
        outcomes: all runs; failed runs and runs off the axes are left out.
        shown: columns; empty: measures outside their bands, and those with the strongest response.
    """
    runs = [
        one
        for one in outcomes
        if not one.failure and all(axis.contains(one.point[axis.key]) for axis in axes)
    ]
    names = list(shown) or most_responsive(axes, runs, _MOST.get(len(axes), _ROWS))
    heat = len(axes) == 2 and not any(axis.is_range for axis in axes)
    each = [(name, axis) for name in names for axis in (axes[:1] if heat else axes)]
    columns = min(3, len(names)) if heat or len(axes) == 1 else len(axes)
    rows = -(-len(each) // columns)
    size_in = (_PANEL_IN[0] * max(columns, 2), _PANEL_IN[1] * rows + 0.2)

    def draw(figure: Figure) -> None:
        figure.supxlabel(_HEAT_KEY if heat else _CURVE_KEY, fontsize=8)
        panels = list(figure.subplots(rows, columns, squeeze=False).flat)
        for (name, axis), panel in zip(each, panels, strict=False):
            if heat:
                _heat_map(figure, panel, axes, runs, name)
            else:
                _curve(panel, axis, runs, name, titled=axis is axes[0])
        for panel in panels[len(each) :]:
            panel.set_visible(False)

    return draw_png(draw, size_in)


def _curve(
    panel: Axes, axis: Axis, runs: Sequence[Outcome], name: str, titled: bool = True
) -> None:
    """Draw runs as dots, their mean over an axis as a line, and one standard deviation."""
    at, values = axis_positions(axis, runs), figure_column(name, runs)
    parts = level_groups(axis, at, values)
    if not parts:
        draw_no_data(panel, "nothing found")
        return
    band = norm_band(name)
    if band is not None:
        panel.axhspan(band.low, band.high, color=HUMAN_FILL, zorder=0, lw=0)
    where = [part.at for part in parts]
    means = np.array([part.values.mean() for part in parts])
    spread = np.array([part.values.std() for part in parts])
    panel.fill_between(where, means - spread, means + spread, color=COLOURS[0], alpha=0.18, lw=0)
    panel.plot(where, means, "-o", color=COLOURS[0], ms=3.5, lw=1.6)
    panel.plot(at, values, ".", color=COLOURS[1], ms=3.0, alpha=0.5)
    if not axis.is_range:
        _ticks(panel, axis, x=True)
    panel.set_xlabel(axis.label, fontsize=8)
    panel.tick_params(labelsize=8)
    if titled:
        _title(panel, name)
    # Limits that show all values, and enough of the band that a small change looks small.
    known = values[np.isfinite(values)]
    low, high = float(known.min()), float(known.max())
    least = 0.5 * (band.high - band.low) if band is not None else 0.05 * abs(high) or 1.0
    margin = max(0.1 * (high - low), 0.5 * (least - (high - low)))
    panel.set_ylim(low - margin, high + margin)


def _heat_map(
    figure: Figure, panel: Axes, axes: Sequence[Axis], runs: Sequence[Outcome], name: str
) -> None:
    """Draw the mean over seeds at each pair of levels."""
    x_axis, y_axis = axes
    counts = len(y_axis.values), len(x_axis.values)
    places = []  # index of each run's level
    for axis in axes:
        at = axis_positions(axis, runs)
        if all(is_number(value) for value in axis.values):
            levels = np.array([float(str(value)) for value in axis.values])
            at = np.array([float(np.argmin(np.abs(levels - x))) for x in at])
        places.append(at)
    values = figure_column(name, runs)
    means = np.full(counts, np.nan)
    for j in range(counts[0]):
        for i in range(counts[1]):
            here = values[(places[0] == i) & (places[1] == j) & np.isfinite(values)]
            if len(here):
                means[j, i] = here.mean()
    image = panel.imshow(means, origin="lower", aspect="auto", cmap="viridis")
    panel.grid(False)
    _ticks(panel, x_axis, x=True, indexed=True)
    _ticks(panel, y_axis, x=False, indexed=True)
    panel.set_xlabel(x_axis.label, fontsize=8)
    panel.set_ylabel(y_axis.label, fontsize=8)
    panel.tick_params(labelsize=8)
    figure.colorbar(image, ax=panel).ax.tick_params(labelsize=7)
    _title(panel, name)
    if means.size > _ANNOTATED:
        return
    band, middle = norm_band(name), np.nanmean([np.nanmin(means), np.nanmax(means)])
    for (j, i), value in np.ndenumerate(means):
        if not np.isfinite(value):
            continue
        inside = band is not None and band.low <= value <= band.high
        panel.text(
            i, j, f"{value:.3g}", ha="center", va="center", fontsize=7,
            color=INK if value > middle else "white", weight="bold" if inside else "normal",
        )  # fmt: skip


def _ticks(panel: Axes, axis: Axis, x: bool, indexed: bool = False) -> None:
    """Label levels that are no numbers, and all levels of a heat map."""
    numbers = all(is_number(value) for value in axis.values)
    if numbers and not indexed:
        return
    words = [f"{v:g}" if isinstance(v, float) else str(v) for v in axis.values]
    (panel.set_xticks if x else panel.set_yticks)(range(len(words)), words)


def _title(panel: Axes, name: str) -> None:
    """Set the title: the measure's title, with its unit."""
    band = norm_band(name)
    if band is None:
        text = "measures outside their bands" if name == OUTSIDE else name
    else:
        unit = f", {band.unit}" if band.unit not in ("", "share") else ""
        text = f"{band.title}{unit}"
    panel.set_title("\n".join(textwrap.wrap(text, _TITLE_WIDE)), loc="left", fontsize=8)


_BINS = 5
_WEAK = 0.05
"""Measures with a weaker response get no panel."""


class LevelGroup(NamedTuple):
    """The runs at one level of an axis, or in one part of a range.

    at: position on the axis; values: a column's figures in these runs
    """

    at: float
    values: Floats


def is_number(value: object) -> bool:
    """Return whether a value fits on a numeric axis."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def axis_positions(axis: Axis, outcomes: Sequence[Outcome]) -> Floats:
    """Return the position of each run on an axis: its number, or the index of its level."""
    if axis.is_range or all(is_number(value) for value in axis.values):
        return np.array([float(str(one.point[axis.key])) for one in outcomes])
    return np.array([float(axis.index(one.point[axis.key])) for one in outcomes])


def figure_column(name: str, outcomes: Sequence[Outcome]) -> Floats:
    """Return a column's figure in each run, nan if missing."""
    found = (one.figures.get(name) for one in outcomes)
    return np.array([float(x) if isinstance(x, int | float) else np.nan for x in found])


def level_groups(axis: Axis, at: Floats, values: Floats) -> list[LevelGroup]:
    """Return the runs by level of an axis; for a range, by parts with equally many runs."""
    known = np.isfinite(values)
    at, values = at[known], values[known]
    if not axis.is_range:
        return [LevelGroup(float(x), values[at == x]) for x in np.unique(at)]
    order = np.argsort(at, kind="stable")
    parts = np.array_split(order, max(1, min(_BINS, len(order) // 2)))
    return [LevelGroup(float(at[part].mean()), values[part]) for part in parts if len(part)]


def response_strength(axes: Sequence[Axis], outcomes: Sequence[Outcome], band: NormBand) -> float:
    """Return the strongest response of a measure to any parameter, 0..1.

    The response is the share of variance that a parameter explains, less the share that as many
    groups explain by chance (epsilon squared, Kelley 1935), times the change of the mean in widths
    of its band, at most 1.
    """
    values = figure_column(f"{REPORT}{band.key}", outcomes)
    best = 0.0
    for axis in axes:
        parts = [part.values for part in level_groups(axis, axis_positions(axis, outcomes), values)]
        n, k = sum(map(len, parts)), len(parts)
        if k < 2 or n <= k:
            continue
        total = float(np.var(np.concatenate(parts))) * n
        within = sum(float(np.var(part)) * len(part) for part in parts)
        change = float(np.ptp([part.mean() for part in parts])) / (band.high - band.low)
        if total > 0.0:
            explained = 1.0 - (within / (n - k)) / (total / (n - 1))
            best = max(best, explained * min(1.0, change))
    return best


def most_responsive(axes: Sequence[Axis], outcomes: Sequence[Outcome], most: int) -> list[str]:
    """Return columns to show: measures outside their bands, then the strongest responses."""
    found = {f"{REPORT}{band.key}": response_strength(axes, outcomes, band) for band in BANDS}
    order = sorted(found, key=lambda name: -found[name])
    return [OUTSIDE, *(name for name in order if found[name] > _WEAK)][:most]


def norm_band(name: str) -> NormBand | None:
    """Return the band of a measure's column, None for any other column."""
    return BY_KEY.get(name.removeprefix(REPORT)) if name.startswith(REPORT) else None
