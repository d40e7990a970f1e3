"""Figures of blinks, and of looks at people."""

from collections.abc import Sequence

import numpy as np

from gazerig.features.lab.analysis import human_norms as human
from gazerig.features.lab.analysis.human_norms import LIDS, SOCIAL
from gazerig.features.lab.report import blinks
from gazerig.features.lab.report import eye_contact as social
from gazerig.features.lab.report.plotting import (
    HUMAN,
    HUMAN_FILL,
    Axes,
    Drawing,
    Figure,
    ShownRun,
    basis_text,
    draw_legend,
    draw_no_data,
    label_axes,
)

_SHOWN_S = np.arange(-0.1, 0.5, 0.005)
_PHASES = (("closing", 60.0, 100.0), ("shut", 20.0, 60.0), ("opening", 130.0, 250.0))


def _shape(figure: Figure, runs: Sequence[ShownRun]) -> None:
    trace, phases = figure.subplots(1, 2)
    for shown in runs:
        mean = _mean_blink(shown)
        if mean is None:
            draw_no_data(trace, "no blink")
            continue
        trace.fill_between(1e3 * _SHOWN_S, *np.percentile(mean, (10, 90), axis=0), lw=0,
                           color=shown.colour, alpha=0.18)  # fmt: skip
        trace.plot(1e3 * _SHOWN_S, np.median(mean, axis=0), color=shown.colour, lw=1.6,
                   label=f"{shown.name} ({len(mean)})")  # fmt: skip
        lower = _mean_blink(shown, "lower_lid")
        if lower is not None and np.isfinite(lower).all():
            trace.plot(1e3 * _SHOWN_S, np.median(lower, axis=0), color=shown.colour, lw=1.4,
                       ls="--", label=f"{shown.name}, lower lids")  # fmt: skip
    for row, (_, low, high) in enumerate(_PHASES):
        phases.barh(row, high - low, 0.75, left=low, color=HUMAN_FILL,
                    label="people" if row == 0 else None)  # fmt: skip
        for n, shown in enumerate(runs):
            seen = blinks.blink_shapes(shown.run.blinks)[:, row]
            asked = blinks.blink_shapes(shown.run.asked_blinks)[:, row]
            at = row + 0.16 * (n - 0.5 * (len(runs) - 1))
            if len(seen):
                low10, mid, high90 = np.percentile(seen, (10, 50, 90))
                phases.plot([low10, high90], [at, at], color=shown.colour, lw=2.0)
                phases.plot(mid, at, "o", color=shown.colour, ms=5,
                            label=f"{shown.name}, {basis_text([shown], LIDS)}" if row == 0
                            else None)  # fmt: skip
            if len(asked):
                phases.plot(np.median(asked), at, "|", color="black", ms=11,
                            label="as commanded" if row == n == 0 else None)  # fmt: skip
    phases.set_yticks(range(3), [name for name, _, _ in _PHASES])
    phases.invert_yaxis()
    label_axes(
        trace,
        "time from the blink's beginning, ms",
        "lid opening",
        f"lids, {basis_text(runs, LIDS)}",
    )
    label_axes(phases, "ms", "", "phases")
    draw_legend(trace, "lower right")
    phases.set_xlim(0.0, None)
    draw_legend(phases, "upper right")


def _mean_blink(shown: ShownRun, column: str = "lid") -> np.ndarray | None:
    """Return the lid openings of every blink on one time axis, (n, times)."""
    t, lid = shown.run.column("t"), shown.run.column(column)
    inside = [
        b.onset_s for b in shown.run.blinks if t[0] < b.onset_s - 0.1 < b.onset_s + 0.5 < t[-1]
    ]
    if not inside:
        return None
    return np.array([np.interp(onset + _SHOWN_S, t, lid) for onset in inside])


def _when(figure: Figure, runs: Sequence[ShownRun]) -> None:
    gaps, evoked = figure.subplots(1, 2)
    bins = np.arange(0.0, 15.1, 0.75).tolist()
    for shown in runs:
        apart = blinks.blink_intervals(shown.run)
        if len(apart):
            weights = np.full(len(apart), 1.0 / len(apart))
            gaps.hist(np.minimum(apart, 15.0), bins, weights=weights, histtype="step", lw=1.6,
                      color=shown.colour, label=f"{shown.name} ({len(apart)})")  # fmt: skip
        rows = blinks.evoked_blinks(shown.run)
        edges = np.array([0.0, 5.0, 10.0, 17.0, 25.0, 33.0, 50.0, 90.0])
        for low, high in zip(edges[:-1], edges[1:], strict=True):
            here = rows[(rows[:, 0] >= low) & (rows[:, 0] < high)]
            if len(here):
                evoked.plot(here[:, 0].mean(), here[:, 1].mean(), "o", color=shown.colour, ms=6)
                evoked.annotate(f"{len(here)}", (here[:, 0].mean(), here[:, 1].mean()), (4, 4),
                                textcoords="offset points", fontsize=8, color=HUMAN)  # fmt: skip
    a = np.linspace(0.0, 60.0, 80)
    evoked.plot(
        a, human.evoked_blink_probability(a), color=HUMAN, lw=1.5, label="Evinger et al. 1994"
    )
    evoked.set_ylim(-0.03, 1.06)
    label_axes(gaps, "time between blinks, s (15 and more at the end)", "share", "intervals")
    label_axes(
        evoked, "gaze shift, deg (number: saccades)", "share with a blink", "with gaze shifts"
    )
    draw_legend(gaps, "upper right")
    draw_legend(evoked, "lower right")


def _looks(figure: Figure, runs: Sequence[ShownRun]) -> None:
    *strips, lengths = figure.subplots(len(runs) + 1, 1,
                                       height_ratios=[0.5] * len(runs) + [1.0])  # fmt: skip
    bins = np.geomspace(0.15, 60.0, 30).tolist()
    for axes, shown in zip(strips, runs, strict=True):
        looks, both = social.face_looks(shown.run), social.mutual_looks(shown.run)
        start = float(shown.run.column("t")[0]) if len(shown.run.rows) else 0.0
        _strip(axes, looks, start, 0, shown.colour)
        _strip(axes, both, start, 1, "#2b8a5a")
        axes.set_yticks([0, 1], ["on a face", "mutual"])
        axes.set_ylim(-0.5, 1.5)
        axes.set_xlim(0.0, max(1.0, shown.run.seconds))
        axes.grid(False)
        label_axes(axes, "", "", shown.name)
        if len(looks):
            each = looks[:, 1] - looks[:, 0]
            lengths.hist(np.clip(each, 0.15, 60.0), bins, histtype="step", lw=1.6,
                         color=shown.colour,
                         label=f"{shown.name}, on a face ({len(each)})")  # fmt: skip
            mutual = both[:, 1] - both[:, 0]
            lengths.hist(np.clip(mutual, 0.15, 60.0), bins, histtype="step", lw=1.2, ls="--",
                         color=shown.colour, label=f"mutual ({len(mutual)})")  # fmt: skip
    strips[-1].set_xlabel("time in s")
    for at, text in ((2.2, "2.2 s"), (3.3, "3.3 s"), (7.9, "7.9 s"), (15.0, "15 s")):
        lengths.axvline(at, color=HUMAN, lw=1.0)
        lengths.text(at, 0.99, f" {text}", color=HUMAN, fontsize=8, va="top",
                     transform=lengths.get_xaxis_transform())  # fmt: skip
    lengths.set_xscale("log")
    lengths.set_xticks([0.2, 0.5, 1, 2, 5, 10, 20, 50], ["0.2", "0.5", "1", "2", "5", "10", "20",
                       "50"])  # fmt: skip
    lengths.minorticks_off()
    label_axes(lengths, "length of a look in s", "looks")
    lengths.set_ylim(0.0, 1.5 * lengths.get_ylim()[1])
    draw_legend(lengths, "upper left", 2)


def _strip(axes: Axes, bouts: np.ndarray, start_s: float, row: int, colour: str) -> None:
    spans = [(begin - start_s, end - begin) for begin, end, _ in bouts]
    axes.broken_barh(spans, (row - 0.36, 0.72), facecolors=colour, lw=0)


DRAWINGS = (
    Drawing("blink_shape", LIDS, "Shape of a blink",
            "Median and 10th to 90th percentile of the upper lids, {measured}, and the median of "
            "lower lids if the rig has them; and the lengths of the phases with those of people. A "
            "phase lasts while the lid is faster than a twentieth of its peak.",
            _shape),
    Drawing("blink_when", LIDS, "When the lids blink",
            "Intervals between blinks; and the share of gaze shifts with a blink.", _when),
    Drawing("looks", SOCIAL, "Looks at people",
            "Times with the gaze on a face, and with that face turned to the robot too; and the "
            "length of each look. 2.2 s: bouts of face gaze in conversation (Rogers 2018); 3.3 s: "
            "preferred length (Binetti 2016); 7.9 s: while listening (Lee, Badler & Badler 2002); "
            "15 s is a stare.", _looks, (8.4, 4.4)),
)  # fmt: skip
