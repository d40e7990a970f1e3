"""Figures of eyes and head together, and of smooth following."""

from collections.abc import Sequence

import numpy as np

from gazerig.features.lab.analysis import human_norms as human
from gazerig.features.lab.analysis.human_norms import FOLLOWING, HEAD
from gazerig.features.lab.report import eye_head
from gazerig.features.lab.report import pursuit as following
from gazerig.features.lab.report.plotting import (
    HUMAN,
    HUMAN_FILL,
    Drawing,
    Figure,
    ShownRun,
    draw_legend,
    draw_no_data,
    label_axes,
)


def _contribution(figure: Figure, runs: Sequence[ShownRun]) -> None:
    amount, latency = figure.subplots(1, 2)
    aside = np.linspace(0.0, 80.0, 90)
    free = human.STAHL_FREE_DEG
    slow = human.STAHL_SLOPE - human.STAHL_SLOPE_SD
    fast = human.STAHL_SLOPE + human.STAHL_SLOPE_SD
    least = slow * np.maximum(0.0, aside - free - human.STAHL_FREE_SD_DEG)
    most = fast * np.maximum(0.0, aside - free + human.STAHL_FREE_SD_DEG)
    amount.fill_between(aside, least, most, color=HUMAN_FILL, lw=0, zorder=0)
    amount.plot(aside, human.mean_head_deg(aside), color=HUMAN, lw=1.6, label="people (Stahl 1999)")
    amount.plot(aside, aside, color="#b0b7bb", lw=0.8, ls=":")
    latency.axhspan(-100.0, 140.0, color=HUMAN_FILL, lw=0, zorder=0)
    for shown in runs:
        shifts = eye_head.gaze_shifts(shown.run)
        x = [s.aside_deg for s in shifts]
        amount.scatter(x, [s.head_deg for s in shifts], s=13, alpha=0.6, lw=0,
                       color=shown.colour, label=f"{shown.name} ({len(shifts)})")  # fmt: skip
        latency.scatter(x, [1e3 * s.head_after_s for s in shifts], s=16, alpha=0.7, lw=0,
                        color=shown.colour)  # fmt: skip
    amount.set_ylim(-10.0, 80.0)
    latency.set_xlim(0.0, 80.0)
    latency.set_ylim(-200.0, 550.0)
    label_axes(amount, "gaze shift from where the head pointed, deg", "head movement in 0.9 s, deg",
          "the head's part")  # fmt: skip
    label_axes(latency, "gaze shift from where the head pointed, deg", "head after eyes, ms",
          "start of the head")  # fmt: skip
    draw_legend(amount, "upper left")


def _vor(figure: Figure, runs: Sequence[ShownRun]) -> None:
    axes = figure.subplots()
    axes.axhspan(0.85, 1.2, color=HUMAN_FILL, lw=0, zorder=0, label="healthy people")
    axes.axhline(1.0, color=HUMAN, lw=1.0)
    for shown in runs:
        rows = eye_head.vor_gains(shown.run)
        axes.scatter(rows[:, 1], rows[:, 0], s=18, alpha=0.7, lw=0, color=shown.colour,
                     label=f"{shown.name} ({len(rows)} stretches)")  # fmt: skip
    axes.set_ylim(0.0, 1.8)
    label_axes(
        axes, "mean speed of the head in a stretch, deg/s", "gain of the eyes against the head"
    )
    draw_legend(axes, "lower right", 3)


def _following(figure: Figure, runs: Sequence[ShownRun]) -> None:
    gains, response, phases = figure.subplots(1, 3)
    gains.axhspan(0.85, 1.05, color=HUMAN_FILL, lw=0, zorder=0)
    gains.axhline(0.95, color=HUMAN, lw=1.2)
    f = np.linspace(0.05, 1.0, 60)
    phases.fill_between(f, -360.0 * f * 0.16, 360.0 * f * 0.05, color=HUMAN_FILL, lw=0, zorder=0)
    response.axhspan(0.85, 1.05, color=HUMAN_FILL, lw=0, zorder=0)
    some = False
    for shown in runs:
        rows = following.pursuit_stretches(shown.run)
        gains.scatter(rows[:, 0], rows[:, 1], s=14, alpha=0.65, lw=0, color=shown.colour,
                      label=f"{shown.name} ({len(rows)})")  # fmt: skip
        bode = following.pursuit_response(shown.run)
        some = some or bool(len(bode))
        response.plot(bode[:, 0], bode[:, 1], "o-", ms=4, lw=1.0, color=shown.colour)
        phases.plot(bode[:, 0], bode[:, 2], "o-", ms=4, lw=1.0, color=shown.colour)
    gains.set_ylim(0.0, 1.6)
    response.set_ylim(0.0, 1.6)
    response.set_xlim(0.05, 1.0)
    phases.set_xlim(0.05, 1.0)
    phases.set_ylim(-120.0, 60.0)
    label_axes(gains, "target's speed, deg/s", "gain", "gain of stretches")
    label_axes(response, "frequency, Hz", "gain", "gain")
    label_axes(phases, "frequency, Hz", "phase, deg (- behind)", "phase")
    draw_legend(gains, "lower right")
    if not some:
        draw_no_data(response, "no coherent frequency")
        draw_no_data(phases, "")


DRAWINGS = (
    Drawing("head_part", HEAD, "The head's part in a gaze shift",
            "Head movement with a shift of the gaze, sideways, and the start of the head. Grey: "
            "Stahl's mean, and one standard deviation of range and slope; and starts from 100 ms "
            "before to 140 ms after the eyes.", _contribution),
    Drawing("vor", HEAD, "Gaze held while the head turns",
            "Gain of the eyes between saccades, for targets at rest; 1 stabilises the gaze. The "
            "additional turn for a near target is taken into account.", _vor,
            (8.4, 3.2)),
    Drawing("following", FOLLOWING, "Smooth following",
            "Left: gain of the gaze between saccades against the target's speed; people reach .95 "
            "(Robinson 1986). Middle and right: gain and phase by frequency, from cross spectra, "
            "where coherence is above .6; grey is up to 160 ms behind, to 50 ms ahead. The target "
            "is as seen by the rig.", _following),
)  # fmt: skip
