"""Figures of the gaze on a face: parts, shifts, heat map, pupil axes, vergence."""

from collections.abc import Sequence

import numpy as np

from gazerig.features.lab.analysis import human_norms as human
from gazerig.features.lab.analysis.drawn_face import HEIGHT_PX, WIDTH_PX, canvas_pixels, draw_face
from gazerig.features.lab.analysis.human_norms import FACE
from gazerig.features.lab.report import face
from gazerig.features.lab.report.face import published_walk
from gazerig.features.lab.report.plotting import (
    HUMAN,
    HUMAN_FILL,
    INK,
    Axes,
    Circle,
    Drawing,
    Ellipse,
    Figure,
    ShownRun,
    draw_legend,
    draw_no_data,
    label_axes,
)
from gazerig.gaze.types import PART_NAMES, PARTS, Floats

_NAMES = [PART_NAMES[part] for part in PARTS]
_NONE = "no fixation on a face part"


def _time_share(figure: Figure, runs: Sequence[ShownRun]) -> None:
    shares, lengths = figure.subplots(1, 2)
    places = np.arange(len(PARTS))
    wide = 0.8 / (len(runs) + 1)
    steps = human.transition_matrix()
    shares.bar(places, face.human_share(), wide, color=HUMAN, label="Nakamoto & Tsuruno")
    lengths.bar(places, human.mean_visit_s(steps, human.DWELL_MEAN_S), wide, color=HUMAN)
    for n, shown in enumerate(runs, start=1):
        at = places + n * wide
        parts = face.fixations_on_parts(shown.run)
        if len(parts):
            shares.bar(at, face.part_shares(parts), wide, color=shown.colour, label=shown.name)
        if shown.model is not None:
            due = shown.model.share(np.random.default_rng(7))
            shares.plot(at, due, "_", color="black", ms=9,
                        label="as the model plans" if n == 1 else None)  # fmt: skip
        seen = face.part_visits(shown.run)
        each = [[v.end_s - v.start_s for v in seen if v.part == p] for p in range(len(PARTS))]
        means = [float(np.mean(e)) if e else 0.0 for e in each]
        errors = [float(np.std(e) / np.sqrt(len(e))) if len(e) > 1 else 0.0 for e in each]
        lengths.bar(at, means, wide, color=shown.colour, yerr=errors, ecolor=INK,
                    error_kw={"lw": 0.8})  # fmt: skip
    for axes in (shares, lengths):
        axes.set_xticks(places + 0.5 * wide * len(runs), _NAMES, rotation=38, ha="right")
        axes.grid(axis="x", visible=False)
    label_axes(shares, "", "share of the time on parts", "time on each part")
    label_axes(lengths, "", "mean visit in s (bar: standard error)", "length of a visit")
    draw_legend(shares, "upper left")


def _dwell(figure: Figure, runs: Sequence[ShownRun]) -> None:
    """Draw the distribution of visits to each part, with the law of table 1."""
    panels = figure.subplots(2, 4, sharex=True, sharey=True).ravel()
    rng = np.random.default_rng(7)
    grid = np.geomspace(0.03, 4.0, 120)
    for part, axes in enumerate(panels):
        law = published_walk().visits(part, 2000, rng)
        axes.plot(grid, _below(law, grid), color=HUMAN, lw=1.6, label="table 1")
        for shown in runs:
            if shown.model is not None:
                asked = shown.model.visits(part, 2000, rng)
                axes.plot(grid, _below(asked, grid), color=shown.colour, lw=1.0, ls=":",
                          label=f"{shown.name}, its model")  # fmt: skip
            lengths = np.array([v.end_s - v.start_s for v in face.part_visits(shown.run)
                                if v.part == part])  # fmt: skip
            if len(lengths):
                axes.plot(grid, _below(lengths, grid), color=shown.colour, lw=1.4,
                          label=shown.name)  # fmt: skip
            if len(runs) == 1:
                axes.text(0.96, 0.06, f"n {len(lengths)}", ha="right", fontsize=8.5,
                          transform=axes.transAxes, color=HUMAN)  # fmt: skip
        axes.set_xscale("log")
        axes.set_xticks([0.05, 0.2, 1.0], ["50 ms", "0.2 s", "1 s"], fontsize=8)
        axes.minorticks_off()
        axes.set_title(_NAMES[part], loc="left", fontsize=9.5)
    for axes in panels[::4]:
        axes.set_ylabel("share not longer")
    handles, names = panels[0].get_legend_handles_labels()
    if handles:
        figure.legend(handles, names, loc="outside upper right", ncols=len(names))


def _below(values: Floats, grid: Floats) -> Floats:
    return np.asarray(np.searchsorted(np.sort(values), grid, side="right") / len(values))


def _transitions(figure: Figure, runs: Sequence[ShownRun]) -> None:
    panels = figure.subplots(1, 1 + len(runs))
    theirs = human.visit_matrix(human.transition_matrix())
    _matrix(panels[0], theirs, "Nakamoto & Tsuruno")
    for axes, shown in zip(panels[1:], runs, strict=True):
        moves = face.part_shifts(shown.run)
        if not len(moves):
            draw_no_data(axes, "no shift between parts")
            continue
        counts = face.count_shifts(moves)
        total = counts.sum(axis=1, keepdims=True)
        ours = np.divide(counts, total, out=np.zeros_like(counts), where=total > 0)
        _matrix(axes, ours, f"{shown.name} ({len(moves)} shifts)", theirs)


def _matrix(axes: Axes, values: Floats, title: str, theirs: Floats | None = None) -> None:
    axes.imshow(values, cmap="Blues", vmin=0.0, vmax=0.75)
    axes.set_xticks(range(len(PARTS)), PARTS)
    axes.set_yticks(range(len(PARTS)), PARTS)
    axes.grid(False)
    for row, column in np.ndindex(values.shape):
        value = values[row, column]
        wrong = theirs is not None and value > 0.0 and theirs[row, column] == 0.0
        if value > 0.005:
            ink = "#c92a2a" if wrong else "white" if value > 0.42 else INK
            axes.text(column, row, f"{100 * value:.0f}", ha="center", va="center", fontsize=7.5,
                      color=ink)  # fmt: skip
    label_axes(axes, "to", "from", title)


def _heat(figure: Figure, runs: Sequence[ShownRun]) -> None:
    panels = figure.subplots(1, 1 + len(runs))
    _draw_map(panels[0], face.expected_density(), "expected of people")
    for axes, shown in zip(panels[1:], runs, strict=True):
        points = face.face_points(shown.run)
        if len(points):
            _draw_map(axes, face.gaze_density(points), f"{shown.name} ({points[:, 2].sum():.0f} s)")
        else:
            draw_no_data(axes, "no gaze on a face")


def _draw_map(axes: Axes, density: Floats, title: str) -> None:
    y, z = face.GRID_M
    left, top = canvas_pixels(np.array([[y[0], z[-1]]]))[0]
    right, bottom = canvas_pixels(np.array([[y[-1], z[0]]]))[0]
    axes.imshow(draw_face()[..., ::-1])
    shade = density / density.max()
    axes.imshow(shade[::-1], extent=(left, right, bottom, top), cmap="plasma",
                alpha=np.clip(1.6 * shade[::-1], 0.0, 0.85), interpolation="bilinear")  # fmt: skip
    axes.set_xlim(40, WIDTH_PX - 40)
    axes.set_ylim(HEIGHT_PX - 40, 60)
    axes.axis("off")
    axes.set_title(title, loc="left")


def _pupils(figure: Figure, runs: Sequence[ShownRun]) -> None:
    panels = figure.subplots(1, 2 * len(runs), sharex=True, sharey=True, squeeze=False)[0]
    for n, shown in enumerate(runs):
        rows = face.map_axes(shown.run)
        distance = float(np.nanmedian(shown.run.column("target_m"))) if len(rows) else 1.0
        for side, axes in enumerate(panels[2 * n : 2 * n + 2]):
            name = ("left", "right")[side]
            title = f"{name} eye" if len(runs) == 1 else f"{shown.name}: {name} eye"
            label_axes(axes, "mm to the person's left", "mm up" if not side else "", title)
            for deg, text in ((1.0, "1 deg"), (0.5 * human.CONE_DEG, "cone of direct gaze")):
                radius = 1e3 * distance * np.tan(np.radians(deg))
                axes.add_patch(Circle((0, 0), radius, fill=False, ec=HUMAN, lw=1.0))
                axes.text(0.0, radius, f"{text}", ha="center", va="bottom", fontsize=8,
                          color=HUMAN)  # fmt: skip
            _scatter(axes, rows[:, 2 * side : 2 * side + 2], shown.colour)
            half = 1e3 * distance * np.tan(np.radians(3.2))
            axes.set_xlim(-half, half)
            axes.set_ylim(-half, half)
            axes.set_aspect("equal")


def _scatter(axes: Axes, points: Floats, colour: str) -> None:
    """Draw the points of one axis, their mean, and the ellipse of two standard deviations."""
    if len(points) < 3:
        axes.text(0, 0, "too few", ha="center", color=HUMAN)
        return
    axes.scatter(points[:, 0], points[:, 1], s=7, alpha=0.35, lw=0, color=colour)
    mean, cov = points.mean(axis=0), np.cov(points.T)
    values, vectors = np.linalg.eigh(cov)
    turn = np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1]))
    wide, high = 4.0 * np.sqrt(np.maximum(values[::-1], 0.0))
    axes.add_patch(Ellipse((mean[0], mean[1]), wide, high, angle=turn, fill=False, ec=INK, lw=1.2))
    axes.plot(*mean, "+", color=INK, ms=9)
    axes.text(0.03, 0.03, f"mean {mean[0]:+.1f}, {mean[1]:+.1f} mm", transform=axes.transAxes,
              fontsize=8.5)  # fmt: skip


def _vergence(figure: Figure, runs: Sequence[ShownRun]) -> None:
    axes = figure.subplots()
    axes.axvspan(-2.5, 4.5, color=HUMAN_FILL, lw=0, label="passes for a direct gaze")
    axes.axvline(0.0, color=HUMAN, lw=1.0)
    bins = np.arange(-3.0, 5.01, 0.1).tolist()
    for shown in runs:
        rows = face.map_axes(shown.run)
        if not len(rows):
            draw_no_data(axes, _NONE)
            continue
        weights = np.full(len(rows), 1.0 / len(rows))
        axes.hist(np.clip(rows[:, 6], -3.0, 5.0), bins, weights=weights, color=shown.colour,
                  alpha=0.75, label=f"{shown.name} ({len(rows)})")  # fmt: skip
    label_axes(axes, "vergence error at the face's distance, deg (+ nearer)",
          "share of fixations")  # fmt: skip
    draw_legend(axes, "upper right")


DRAWINGS = (
    Drawing("part_share", FACE, "Time on the parts of a face",
            "Share of the time on parts and mean visit, refixations merged; grey is Nakamoto & "
            "Tsuruno, eq 1 with table 1 as dwell of each step.", _time_share, (8.4, 4.0)),
    Drawing("dwell", FACE, "Visits to each part",
            "Share of visits up to a duration; grey is table 1 of Nakamoto & Tsuruno as log-normal "
            "dwells with the refixations of eq 1; dotted is the rig's own model, including its "
            "floor.", _dwell,
            (8.4, 4.4)),
    Drawing("transitions", FACE, "Transitions between parts",
            "Shifts between parts in percent of each row, staying left out; red are shifts that "
            "eq 1 of Nakamoto & Tsuruno does not have. DN chin, FL and FR sides, LE and RE eyes, "
            "M mouth, N nose, UP forehead; left and right are the person's own.", _transitions,
            (8.4, 4.2)),
    Drawing("heat", FACE, "Heat map",
            "Time on the face, and the map expected from people's shares of time on the parts "
            "(figures 8 and 9 of Nakamoto & Tsuruno).", _heat, (8.4, 4.6)),
    Drawing("pupil_axes", FACE, "Pupil axes at the face",
            "One dot a fixation: the line of sight of each eye, {measured}, in the plane of the "
            "face, relative to the target point. The face is as seen by the rig: an error of its "
            "camera is not included.", _pupils, (8.4, 4.2)),
    Drawing("vergence", FACE, "Vergence at the face",
            "Angle between the lines of sight, {measured}, less that of the point looked at.",
            _vergence, (8.4, 3.0)),
)  # fmt: skip
