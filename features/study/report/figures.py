"""Figures of a study: counts, participants and means, and effects."""

from collections.abc import Sequence
from math import isfinite
from textwrap import fill

import numpy as np

from gazerig.features.lab.report.plotting import (
    HUMAN,
    INK,
    Axes,
    Figure,
    Patch,
    draw_no_data,
    draw_png,
    label_axes,
)
from gazerig.features.study.analysis import MeasureSummary, StudyAnalysis
from gazerig.features.study.decisions import Decision

_LOW, _HIGH = ((179, 88, 6), (254, 224, 182)), ((216, 218, 235), (84, 39, 136))
"""Colours from the lowest point to the middle and on to the highest, RGB of 0 to 255:
Brewer's PuOr, which is suitable for the colour-blind."""

_MIDDLE = "#e8e8ea"
_ACCENT = "#1c6ea4"
_ROW_IN, _HEAD_IN, _ITEM_IN, _WIDE_IN = 0.42, 0.95, 0.3, 8.4
_LEAST_NUMBERED = 4.0
_JITTER = 0.05
_DARK = 140.0
_TICK_CHARACTERS = 22
"""Width at which names of conditions are wrapped."""

Colour = tuple[int, int, int]


def shades(points: int) -> list[str]:
    """Return one colour per point, from the lowest to the highest, grey for a middle point."""
    half = points // 2
    low, high = (_mix_colours(*ends, half) for ends in (_LOW, _HIGH))
    return [*low, *([_MIDDLE] if points % 2 else []), *high]


def _mix_colours(first: Colour, last: Colour, count: int) -> list[str]:
    """Return evenly spaced colours; for a count of 1 the middle colour."""
    at = np.linspace(0.0, 1.0, count) if count > 1 else np.array([0.5])
    mixed = np.rint(np.outer(1.0 - at, first) + np.outer(at, last)).astype(int)
    return ["#{:02x}{:02x}{:02x}".format(*one) for one in mixed.tolist()]


def _is_dark(colour: str) -> bool:
    """Return whether white is more readable on a colour than ink (luma of ITU-R BT.601)."""
    red, green, blue = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return 0.299 * red + 0.587 * green + 0.114 * blue < _DARK


def counts_png(some: Sequence[MeasureSummary], study: StudyAnalysis) -> bytes:
    """Draw how often each point of some items was answered, one bar per condition.

    The middles of the scales are aligned.
    """
    names = [study.label(key) for key in study.design.conditions]
    size = (_WIDE_IN, _HEAD_IN + len(some) * (_ROW_IN * len(names) + _ITEM_IN))

    def draw(figure: Figure) -> None:
        each = figure.subplots(len(some), 1, sharex=True, squeeze=False)[:, 0]
        for axes, one in zip(each, some, strict=True):
            _counts(axes, one, names)
            if len(some) > 1:
                label_axes(axes, "", "", one.measure.items[0].replace("_", " "))
        points = some[0].measure.points
        label_axes(each[-1], "share of answers below and above the middle (numbers: answers)", "")
        patches = [Patch(color=colour, label=str(k + 1)) for k, colour in enumerate(shades(points))]
        figure.legend(handles=patches, loc="outside upper right", ncols=points)

    return draw_png(draw, size)


def _counts(axes: Axes, one: MeasureSummary, names: list[str]) -> None:
    counts = one.counts
    if counts is None or not counts.sum():
        draw_no_data(axes, "no answers")
        return
    points = counts.shape[1]
    colours = shades(points)
    for row, each in enumerate(counts):
        shares = 100.0 * each / max(1, int(each.sum()))
        below = shares[: points // 2].sum() + (0.5 * shares[points // 2] if points % 2 else 0.0)
        at = -below
        for point, share in enumerate(shares):
            axes.barh(row, share, 0.7, left=at, color=colours[point])
            if share >= _LEAST_NUMBERED:
                axes.text(at + 0.5 * share, row, str(each[point]), ha="center", va="center",
                          fontsize=8.5, color="white" if _is_dark(colours[point]) else INK)  # fmt: skip
            at += share
    axes.axvline(0.0, color=HUMAN, lw=0.8)
    axes.set_yticks(range(len(names)), names)
    axes.invert_yaxis()
    axes.set_xlim(-105.0, 105.0)
    axes.set_xticks([-100, -50, 0, 50, 100], ["100 %", "50 %", "0", "50 %", "100 %"])
    axes.grid(False)


def paired_png(one: MeasureSummary, study: StudyAnalysis) -> bytes:
    """Draw each participant as a line over the conditions, and the means with their intervals."""
    names = [study.label(c.condition) for c in one.conditions]
    return draw_png(lambda figure: _paired(figure, one, names), (_WIDE_IN, 3.4))


def _paired(figure: Figure, one: MeasureSummary, names: list[str]) -> None:
    axes = figure.subplots()
    means = one.scores.means
    if not np.isfinite(means).any():
        draw_no_data(axes, "nothing measured")
        return
    x = np.arange(len(names))
    whole = one.measure.kind == "item"
    # Equal answers are spread a little, so that they can be counted; the spread is deterministic.
    spread = np.linspace(-_JITTER, _JITTER, max(2, len(means))) * (1.0 if whole else 0.0)
    for row, apart in zip(means, spread, strict=False):
        axes.plot(x + apart, row + 1.6 * apart, "-o", color=HUMAN, lw=0.7, ms=2.5, alpha=0.45)
    for k, c in enumerate(one.conditions):
        if isfinite(c.low95):
            axes.plot([k, k], [c.low95, c.high95], color=_ACCENT, lw=3.0, solid_capstyle="butt")
        axes.plot(k, c.mean, "D", color=_ACCENT, ms=8, zorder=5)
        axes.annotate(f"{c.mean:.2f}", (k, c.mean), (12, -3), textcoords="offset points",
                      color=_ACCENT, fontweight="bold")  # fmt: skip
    axes.set_xticks(x, [fill(name, _TICK_CHARACTERS) for name in names])
    axes.set_xlim(-0.5, len(names) - 0.5)
    if one.measure.points:
        axes.set_ylim(0.8, one.measure.points + 0.2)
        axes.set_yticks(range(1, one.measure.points + 1))
    label_axes(axes, "", "mean of the scale" if one.measure.kind == "scale" else
          "rating" if whole else one.measure.name.replace("_", " "))  # fmt: skip


def forest_png(study: StudyAnalysis, names: list[str]) -> bytes:
    """Draw the effect of each hypothesis with its interval."""
    size = (_WIDE_IN, _HEAD_IN + _ROW_IN * max(1, len(names)))
    return draw_png(lambda figure: _forest(figure, study.decisions, names), size)


def _forest(figure: Figure, found: tuple[Decision, ...], names: list[str]) -> None:
    standard, bounded = figure.subplots(1, 2, sharey=True)
    for axes, which, title in (
        (standard, [one.standardised for one in found], "d_z"),
        (bounded, [one.test.effect if one.test else None for one in found], "r, δ, Δ of the test"),
    ):
        for row, size in enumerate(which):
            if size is not None and isfinite(size.value):
                if isfinite(size.low95):
                    axes.plot([size.low95, size.high95], [row, row], color=_ACCENT, lw=2.2)
                axes.plot(size.value, row, "s", color=_ACCENT, ms=7)
                axes.annotate(f"{size.symbol} = {size.value:.2f}", (size.value, row), (0, 7),
                              textcoords="offset points", ha="center", fontsize=8)  # fmt: skip
        axes.axvline(0.0, color=INK, lw=0.8)
        axes.set_yticks(range(len(names)), names)
        axes.set_ylim(len(names) - 0.5, -0.5)
        label_axes(axes, title, "")
    bounded.set_xlim(-1.05, 1.05)
