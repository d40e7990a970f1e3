"""The picture of a sweep: curves with their spread over seeds, or heat maps of two parameters."""

import textwrap
from collections.abc import Sequence

import numpy as np

from gazerig.features.lab.report.plotting import (
    COLOURS,
    HUMAN_FILL,
    INK,
    Axes,
    Figure,
    nothing,
    png_of,
)
from gazerig.features.lab.sweep.axes import Axis
from gazerig.features.lab.sweep.outcome import OUTSIDE, Outcome
from gazerig.features.lab.sweep.response import (
    band_of,
    column,
    groups,
    is_number,
    most_responsive,
    positions,
)
from gazerig.gaze.types import Floats
from gazerig.robot.analysis.human_norms import NormBand

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
        if not one.failed and all(axis.has(one.point[axis.key]) for axis in axes)
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

    return png_of(draw, size_in)


def _curve(
    panel: Axes, axis: Axis, runs: Sequence[Outcome], name: str, titled: bool = True
) -> None:
    """Draw runs as dots, their mean over an axis as a line, and one standard deviation."""
    at, values = positions(axis, runs), column(name, runs)
    parts = groups(axis, at, values)
    if not parts:
        nothing(panel, "nothing found")
        return
    band = band_of(name)
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
    _limits(panel, values, band)


def _limits(panel: Axes, values: Floats, band: NormBand | None) -> None:
    """Set limits that show all values, and enough of the band that a small change looks small."""
    known = values[np.isfinite(values)]
    if not len(known):
        return
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
    places = [_index(axis, runs) for axis in axes]
    values = column(name, runs)
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
    _cells(panel, name, means)


def _cells(panel: Axes, name: str, means: Floats) -> None:
    """Write the values of a small map; values inside the band of people are bold."""
    if means.size > _ANNOTATED:
        return
    band, middle = band_of(name), np.nanmean([np.nanmin(means), np.nanmax(means)])
    for (j, i), value in np.ndenumerate(means):
        if not np.isfinite(value):
            continue
        inside = band is not None and band.low <= value <= band.high
        panel.text(
            i, j, f"{value:.3g}", ha="center", va="center", fontsize=7,
            color=INK if value > middle else "white", weight="bold" if inside else "normal",
        )  # fmt: skip


def _index(axis: Axis, runs: Sequence[Outcome]) -> Floats:
    """Return the index of each run's level."""
    at = positions(axis, runs)
    if not all(is_number(value) for value in axis.values):
        return at
    levels = np.array([float(str(value)) for value in axis.values])
    return np.array([float(np.argmin(np.abs(levels - x))) for x in at])


def _ticks(panel: Axes, axis: Axis, x: bool, indexed: bool = False) -> None:
    """Label levels that are no numbers, and all levels of a heat map."""
    numbers = all(is_number(value) for value in axis.values)
    if numbers and not indexed:
        return
    words = [f"{v:g}" if isinstance(v, float) else str(v) for v in axis.values]
    (panel.set_xticks if x else panel.set_yticks)(range(len(words)), words)


def _title(panel: Axes, name: str) -> None:
    """Set the title: the measure's title, with its unit."""
    band = band_of(name)
    if band is None:
        text = "measures outside their bands" if name == OUTSIDE else name
    else:
        unit = f", {band.unit}" if band.unit not in ("", "share") else ""
        text = f"{band.title}{unit}"
    panel.set_title("\n".join(textwrap.wrap(text, _TITLE_WIDE)), loc="left", fontsize=8)
