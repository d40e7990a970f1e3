"""Figures of saccades and fixations with human curves."""

from collections.abc import Sequence

import numpy as np

from gazerig.features.lab.analysis import human_norms as human
from gazerig.features.lab.analysis.human_norms import SACCADES
from gazerig.features.lab.report import saccades
from gazerig.features.lab.report.plotting import (
    HUMAN,
    HUMAN_FILL,
    Axes,
    Drawing,
    Figure,
    ShownRun,
    draw_legend,
    draw_no_data,
    label_axes,
)

_OVERVIEW_S = 12.0


def _overview(figure: Figure, runs: Sequence[ShownRun]) -> None:
    """Draw some seconds of gaze, head and target, from the busiest part of the run."""
    panels = figure.subplots(len(runs), 1, squeeze=False)[:, 0]
    for axes, shown in zip(panels, runs, strict=True):
        run = shown.run
        t = run.column("t")
        if not len(t):
            draw_no_data(axes, "no ticks")
            continue
        onsets = np.array([s.onset_s for s in run.saccades if s.onset_s < t[-1] - _OVERVIEW_S])
        many = [np.count_nonzero((onsets >= s) & (onsets < s + _OVERVIEW_S)) for s in onsets]
        start = float(onsets[int(np.argmax(many))]) if many else float(t[0])
        part = run.between(start, start + _OVERVIEW_S)
        axes.plot(t[part], run.column("target_yaw")[part], color=HUMAN, lw=1.0, label="target")
        if run.joints.has_any("neck_yaw"):
            axes.plot(t[part], run.column("head_yaw")[part], color="#2b8a5a", lw=1.4, label="head")
        axes.plot(t[part], run.column("gaze_yaw")[part], color=shown.colour, lw=1.2, label="gaze")
        label_axes(axes, "time in s", "yaw, deg", shown.name)
        draw_legend(axes, "upper right", 3)


def _main_sequence(figure: Figure, runs: Sequence[ShownRun]) -> None:
    peaks, durations = figure.subplots(1, 2)
    tables = [saccades.saccade_table(shown.run) for shown in runs]
    most = max((float(table[:, 0].max()) for table in tables if len(table)), default=10.0)
    a = np.linspace(0.3, max(8.0, 1.08 * most), 120)
    _draw_human_band(peaks, a, human.lowest_peak_deg_s(a), human.highest_peak_deg_s(a))
    _draw_human_band(durations, a, human.shortest_duration_ms(a), human.longest_duration_ms(a))
    for shown, table in zip(runs, tables, strict=True):
        asked = saccades.commanded_saccade_table(shown.run)
        style = {"s": 9, "alpha": 0.45, "lw": 0}
        if not len(table):
            continue
        peaks.scatter(table[:, 0], table[:, 2], color=shown.colour, **style, label=shown.name)
        durations.scatter(table[:, 0], table[:, 1], color=shown.colour, **style)
        if len(runs) == 1 and len(asked):
            peaks.scatter(asked[:, 0], asked[:, 2], marker="_", color="black", s=14, lw=0.7,
                          alpha=0.6, label="as commanded")  # fmt: skip
            durations.scatter(asked[:, 0], asked[:, 1], marker="_", color="black", s=14, lw=0.7,
                              alpha=0.6)  # fmt: skip
    label_axes(peaks, "amplitude in deg", "peak speed in deg/s", "peak speed")
    label_axes(durations, "amplitude in deg", "duration in ms", "duration")
    durations.set_ylim(0.0, None)
    draw_legend(peaks, "lower right")


def _draw_human_band(axes: Axes, a: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
    axes.fill_between(a, low, high, color=HUMAN_FILL, lw=0, label="people", zorder=0)


def _shape(figure: Figure, runs: Sequence[ShownRun]) -> None:
    skew, sizes = figure.subplots(1, 2)
    most = 10.0
    bins = np.arange(0.0, 41.0, 1.0).tolist()
    for shown in runs:
        table = saccades.saccade_table(shown.run)
        if len(table):
            most = max(most, float(table[:, 0].max()))
            skew.scatter(table[:, 0], table[:, 3], color=shown.colour, s=9, alpha=0.45, lw=0)
        size = table[:, 0]
        weights = np.full(len(size), 1.0 / max(1, len(size)))
        sizes.hist(np.minimum(size, 40.0), bins, weights=weights, histtype="step", lw=1.6,
                   color=shown.colour, label=f"{shown.name} ({len(size)})")  # fmt: skip
    a = np.linspace(0.0, 1.05 * most, 60)
    expected = human.acceleration_share(a)
    skew.fill_between(a, expected - 0.08, expected + 0.08, color=HUMAN_FILL, lw=0, zorder=0)
    skew.plot(a, expected, color=HUMAN, lw=1.4, label="people (Collewijn 1988)")
    skew.axhline(0.5, color="#b0b7bb", lw=0.8, ls=":")
    skew.set_ylim(0.0, 1.0)
    label_axes(skew, "amplitude in deg", "time of the peak / duration", "skew")
    draw_legend(skew, "upper right")
    sizes.axvline(15.0, color=HUMAN, lw=1.2)
    sizes.text(15.4, 0.97, "83 to 90 % of\npeople's are smaller", color=HUMAN, fontsize=8.5,
               va="top", transform=sizes.get_xaxis_transform())  # fmt: skip
    label_axes(sizes, "amplitude in deg (40 and more at the end)", "share of saccades", "sizes")
    draw_legend(sizes, "center right")


def _fixations(figure: Figure, runs: Sequence[ShownRun]) -> None:
    axes = figure.subplots()
    bins = np.geomspace(0.04, 6.0, 34).tolist()
    axes.axvspan(1 / 4.0, 1 / 1.5, color=HUMAN_FILL, lw=0, label="people: mean, 1.5 to 4 a second")
    for shown in runs:
        lengths = np.array([f.duration_s for f in shown.run.fixations])
        if not len(lengths):
            draw_no_data(axes, "no fixation")
            continue
        weights = np.full(len(lengths), 1.0 / len(lengths))
        axes.hist(np.clip(lengths, 0.04, 6.0), bins, weights=weights, histtype="step", lw=1.6,
                  color=shown.colour, label=f"{shown.name} ({len(lengths)})")  # fmt: skip
        axes.axvline(lengths.mean(), color=shown.colour, lw=1.2, ls="--")
    axes.set_xscale("log")
    axes.set_xticks([0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0], ["50 ms", "100 ms", "200 ms", "0.5 s",
                    "1 s", "2 s", "5 s"])  # fmt: skip
    axes.minorticks_off()
    label_axes(axes, "length of a fixation (dashed: mean)", "share of fixations")
    draw_legend(axes, "upper right")


DRAWINGS = (
    Drawing("overview", SACCADES, "Twelve seconds of the run",
            "Gaze and head, {measured}, and the direction of the target, sideways.", _overview,
            (8.4, 3.4)),
    Drawing("main_sequence", SACCADES, "Main sequence",
            "Each dot is a saccade of the gaze in space, {measured}; grey is the human range: "
            "between Baloh's and the higher of Bahill's and Collewijn's curves, 15 % between "
            "people; durations 21 + 2.2 A less 25 % to 25 + 2.4 A ms and 25 %, or 37 + 2.7 A ms.", _main_sequence),
    Drawing("saccade_shape", SACCADES, "Skew and sizes",
            "Time of the peak speed in a saccade, .5 is the middle; and the sizes of saccades.",
            _shape),
    Drawing("fixations", SACCADES, "Fixations",
            "Time between saccades, on a logarithmic axis.", _fixations, (8.4, 3.2)),
)  # fmt: skip
