"""The figures of a report, each of one run or of two, drawn without a screen as PNG.

matplotlib is an extra; without it, importing this module raises SetupError with the command that
installs it.
"""

from collections.abc import Callable, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

from gazerig.drivers.errors import SetupError, extra_hint
from gazerig.features.lab.analysis import human_norms as human
from gazerig.features.lab.analysis.blink_finder import UPPER
from gazerig.features.lab.report import eye_head, face, saccades
from gazerig.features.lab.report.gaze_trace import GazeTrace
from gazerig.gaze.types import PART_NAMES, PARTS, Floats

try:
    import matplotlib as mpl
    from matplotlib.axes import Axes
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
except ImportError as error:
    raise SetupError(extra_hint("matplotlib", "report", error)) from error

COLOURS = ("#1c6ea4", "#d9660a")
HUMAN = "#7f8c8d"
"""Human values are grey in every figure."""

HUMAN_FILL = "#dfe4e6"
INK = "#2c3136"
GREEN = "#2b8a5a"

_STYLE: Any = {
    "text.parse_math": False,  # names of files are not formulas
    "font.family": "DejaVu Sans", "font.size": 10, "text.color": INK, "axes.labelcolor": INK,
    "axes.edgecolor": "#9aa3a9", "axes.titlesize": 11, "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True,
    "axes.axisbelow": True, "grid.color": "#eceff1", "grid.linewidth": 0.8,
    "xtick.color": INK, "ytick.color": INK, "legend.frameon": False, "legend.fontsize": 8.5,
    "figure.facecolor": "white",
}  # fmt: skip
_DPI = 110


class ShownRun(NamedTuple):
    """A run in figures."""

    name: str
    run: GazeTrace
    colour: str


class Drawing(NamedTuple):
    """One figure: its section, title and caption.

    joints: the rig needs one of them
    """

    group: str
    title: str
    caption: str
    draw: Callable[[Figure, Sequence[ShownRun]], None]
    size_in: tuple[float, float] = (8.4, 3.8)
    joints: tuple[str, ...] = ()


def draw_png(drawing: Drawing, runs: Sequence[ShownRun]) -> bytes:
    """Return a figure of one run, or of two for comparison, as PNG."""
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=drawing.size_in, dpi=_DPI, layout="constrained")
        canvas = FigureCanvasAgg(figure)
        drawing.draw(figure, runs)
        out = BytesIO()
        # print_figure would draw everything twice, once only for the layout.
        canvas.print_png(out)  # type: ignore[no-untyped-call]
    return out.getvalue()


def draw_no_data(axes: Axes, what: str) -> None:
    """Write a text instead of a figure without data."""
    axes.set_axis_off()
    axes.text(0.5, 0.5, what, ha="center", va="center", transform=axes.transAxes, color=HUMAN)


_OVERVIEW_S = 12.0
_BLINK_S = np.arange(-0.1, 0.5, 0.005)
_DOTS: dict[str, Any] = {"s": 12, "alpha": 0.5, "lw": 0}
_FACE = Path(__file__).with_name("face.png")
_PX_PER_M, _NOSE_PX = 3000.0, (360.0, 480.0)
"""Scale of the picture of a face, seen by an opposite viewer, and the tip of its nose."""


def _overview(figure: Figure, runs: Sequence[ShownRun]) -> None:
    """Draw some seconds of gaze, head and target, from the busiest part of the run."""
    panels = figure.subplots(len(runs), 1, squeeze=False)[:, 0]
    for axes, (name, run, colour) in zip(panels, runs, strict=True):
        t = run.column("t")
        onsets = np.array([s.onset_s for s in run.saccades if s.onset_s < t[-1] - _OVERVIEW_S])
        many = np.searchsorted(onsets, onsets + _OVERVIEW_S) - np.arange(len(onsets))
        start = float(onsets[many.argmax()]) if len(many) else float(t[0])
        part = run.between(start, start + _OVERVIEW_S)
        axes.plot(t[part], run.column("target")[part, 0], color=HUMAN, lw=1.0, label="target")
        if run.joints.has_any(("neck_yaw",)):
            axes.plot(t[part], run.column("head")[part, 0], color=GREEN, lw=1.4, label="head")
        axes.plot(t[part], run.column("gaze")[part, 0], color=colour, lw=1.2, label="gaze")
        axes.set(xlabel="time, s", ylabel="yaw, deg", title=name)
        axes.legend(loc="upper right", ncols=3)


def _main_sequence(figure: Figure, runs: Sequence[ShownRun]) -> None:
    peaks, durations = figure.subplots(1, 2)
    tables = [saccades.saccade_table(shown.run) for shown in runs]
    a = np.linspace(0.3, max(8.0, 1.08 * np.vstack(tables)[:, 0].max(initial=8.0)), 120)
    peaks.fill_between(a, human.lowest_peak_deg_s(a), human.highest_peak_deg_s(a),
                       color=HUMAN_FILL, lw=0, label="people")  # fmt: skip
    durations.fill_between(a, human.shortest_duration_ms(a), human.longest_duration_ms(a),
                           color=HUMAN_FILL, lw=0)  # fmt: skip
    for shown, table in zip(runs, tables, strict=True):
        commanded = saccades.commanded_saccade_table(shown.run)
        for axes, column in ((peaks, 2), (durations, 1)):
            axes.scatter(table[:, 0], table[:, column], color=shown.colour, label=shown.name,
                         **_DOTS)  # fmt: skip
            if len(runs) == 1:
                axes.scatter(commanded[:, 0], commanded[:, column], marker="_", color="black",
                             s=14, lw=0.7, alpha=0.6, label="as commanded")  # fmt: skip
    peaks.set(xlabel="amplitude, deg", title="peak speed, deg/s")
    durations.set(xlabel="amplitude, deg", title="duration, ms", ylim=(0.0, None))
    peaks.legend(loc="lower right")


def _time_share(figure: Figure, runs: Sequence[ShownRun]) -> None:
    shares, lengths = figure.subplots(1, 2)
    places, wide = np.arange(len(PARTS)), 0.8 / (len(runs) + 1)
    visits = human.mean_visit_s(human.transition_matrix(), human.DWELL_MEAN_S)
    shares.bar(places, face.human_share(), wide, color=HUMAN, label="Nakamoto & Tsuruno")
    lengths.bar(places, visits, wide, color=HUMAN)
    for n, (name, run, colour) in enumerate(runs, start=1):
        parts, seen = face.fixations_on_parts(run), face.part_visits(run)
        if len(parts):
            shares.bar(places + n * wide, face.part_shares(parts), wide, color=colour, label=name)
        each = [[v.end_s - v.start_s for v in seen if v.part == part] or [0.0] for part in places]
        lengths.bar(places + n * wide, [np.mean(one) for one in each], wide, color=colour)
    names = [PART_NAMES[part] for part in PARTS]
    for axes in (shares, lengths):
        axes.set_xticks(places + 0.5 * wide * len(runs), names, rotation=38, ha="right")
        axes.grid(axis="x", visible=False)
    shares.set_title("share of the time on parts")
    lengths.set_title("mean visit, s")
    shares.legend(loc="upper left")


def _transitions(figure: Figure, runs: Sequence[ShownRun]) -> None:
    panels, people = figure.subplots(1, 1 + len(runs)), face.human_shifts()
    _matrix(panels[0], people, "Nakamoto & Tsuruno", people)
    for axes, (name, run, _) in zip(panels[1:], runs, strict=True):
        moves = face.part_shifts(run)
        _matrix(axes, face.shift_shares(moves)[0], f"{name} ({len(moves)} shifts)", people)


def _matrix(axes: Axes, values: Floats, title: str, people: Floats) -> None:
    axes.imshow(values, cmap="Blues", vmin=0.0, vmax=0.75)
    axes.set_xticks(range(len(PARTS)), PARTS)
    axes.set_yticks(range(len(PARTS)), PARTS)
    axes.grid(False)
    for (row, column), value in np.ndenumerate(values):
        ink = "#c92a2a" if people[row, column] == 0.0 else "white" if value > 0.42 else INK
        axes.text(
            column, row, f"{100 * value:.0f}", ha="center", va="center", fontsize=7.5, color=ink
        )
    axes.set(xlabel="to", ylabel="from", title=title)


def _heat(figure: Figure, runs: Sequence[ShownRun]) -> None:
    panels = figure.subplots(1, 1 + len(runs))
    _draw_map(panels[0], face.expected_density(), "expected of people")
    for axes, (name, run, _) in zip(panels[1:], runs, strict=True):
        points = face.face_points(run)
        if len(points):
            _draw_map(axes, face.gaze_density(points), f"{name} ({points[:, 2].sum():.0f} s)")
        else:
            draw_no_data(axes, "no gaze on a face")


def _draw_map(axes: Axes, density: Floats, title: str) -> None:
    (left, right), (low, high) = (
        nose_px + sign * _PX_PER_M * centres[[0, -1]]
        for nose_px, sign, centres in zip(_NOSE_PX, (1.0, -1.0), face.GRID_M, strict=True)
    )
    picture = cv2.imread(str(_FACE))
    assert picture is not None
    axes.imshow(picture[..., ::-1])
    shade = density / density.max()
    axes.imshow(shade[::-1], extent=(left, right, low, high), cmap="plasma",
                alpha=np.clip(1.6 * shade[::-1], 0.0, 0.85), interpolation="bilinear")  # fmt: skip
    axes.set_title(title)
    axes.axis("off")


def _head_part(figure: Figure, runs: Sequence[ShownRun]) -> None:
    axes = figure.subplots()
    aside, free, spread = np.linspace(0.0, 80.0, 90), human.STAHL_FREE_DEG, human.STAHL_FREE_SD_DEG
    least, most = (
        (human.STAHL_SLOPE + sign * human.STAHL_SLOPE_SD)
        * np.maximum(0.0, aside - free + sign * spread)
        for sign in (-1.0, 1.0)
    )
    axes.fill_between(aside, least, most, color=HUMAN_FILL, lw=0)
    axes.plot(aside, human.mean_head_deg(aside), color=HUMAN, lw=1.6, label="people (Stahl 1999)")
    for name, run, colour in runs:
        shifts = eye_head.gaze_shifts(run)
        axes.scatter(shifts[:, 0], shifts[:, 1], color=colour, label=f"{name} ({len(shifts)})",
                     **_DOTS)  # fmt: skip
    axes.set(ylim=(-10.0, 80.0), xlabel="gaze shift from where the head pointed, deg",
             ylabel="head movement in 0.9 s, deg")  # fmt: skip
    axes.legend(loc="upper left")


def _following(figure: Figure, runs: Sequence[ShownRun]) -> None:
    axes = figure.subplots()
    axes.axhspan(0.85, 1.05, color=HUMAN_FILL, lw=0, label="people")
    for name, run, colour in runs:
        speed, gain, _ = eye_head.pursuit_stretches(run).T
        axes.scatter(speed, gain, color=colour, label=f"{name} ({len(gain)} stretches)", **_DOTS)
    axes.set(ylim=(0.0, 1.6), xlabel="target's speed, deg/s", ylabel="gain")
    axes.legend(loc="lower right", ncols=3)


def _blink(figure: Figure, runs: Sequence[ShownRun]) -> None:
    axes = figure.subplots()
    for name, run, colour in runs:
        t, lid = run.column("t"), run.column("lid")
        onsets = [b.onset_s for b in run.blinks if t[0] < b.onset_s - 0.1 < b.onset_s + 0.5 < t[-1]]
        shapes = np.array([np.interp(onset + _BLINK_S, t, lid) for onset in onsets])
        if len(shapes):
            low, middle, high = np.percentile(shapes, (10, 50, 90), axis=0)
            axes.plot(1e3 * _BLINK_S, middle, color=colour, label=f"{name} ({len(onsets)})")
            axes.fill_between(1e3 * _BLINK_S, low, high, lw=0, color=colour, alpha=0.15)
    axes.set(xlabel="time from the blink's beginning, ms", ylabel="opening of the upper lids")
    axes.legend(loc="lower right")


def _looks(figure: Figure, runs: Sequence[ShownRun]) -> None:
    panels = figure.subplots(len(runs), 1, squeeze=False)[:, 0]
    for axes, (name, run, colour) in zip(panels, runs, strict=True):
        for row, ink in enumerate((colour, GREEN)):
            begins, ends, _ = face.face_looks(run, mutual=row == 1).T
            spans = np.column_stack([begins - run.column("t")[0], ends - begins])
            axes.broken_barh(spans.tolist(), (row - 0.36, 0.72), facecolors=ink, lw=0)
        axes.set_yticks([0, 1], ["on a face", "mutual"])
        axes.set(xlim=(0.0, run.seconds), xlabel="time, s", title=name)
        axes.grid(False)


DRAWINGS = (
    Drawing("Saccades", "Twelve seconds of the run",
            "Gaze and head, and the direction of the target, sideways.", _overview, (8.4, 3.4)),
    Drawing("Saccades", "Main sequence",
            "Each dot is a saccade of the gaze in space; grey is the human range: between Baloh's "
            "and the higher of Bahill's and Collewijn's curves, 15 % between people; durations "
            "21 + 2.2 A less 25 % to 25 + 2.4 A ms and 25 %, or 37 + 2.7 A ms.", _main_sequence),
    Drawing("On the face", "Time on the parts of a face",
            "Share of the time on parts and mean visit, refixations merged; grey is Nakamoto & "
            "Tsuruno, eq 1 with table 1 as dwell of each step.", _time_share, (8.4, 4.0)),
    Drawing("On the face", "Transitions between parts",
            "Shifts between parts in percent of each row, staying left out; red are shifts that "
            "eq 1 of Nakamoto & Tsuruno does not have. DN chin, FL and FR sides, LE and RE eyes, "
            "M mouth, N nose, UP forehead; left and right are the person's own.", _transitions,
            (8.4, 4.5)),
    Drawing("On the face", "Heat map",
            "Time on the face, and the map expected from people's shares of time on the parts "
            "(figures 8 and 9 of Nakamoto & Tsuruno).", _heat, (8.4, 4.6)),
    Drawing("Eyes and head", "The head's part in a gaze shift",
            "Head movement with a shift of the gaze, sideways. Grey: Stahl's mean, and one standard "
            "deviation of range and slope.", _head_part, joints=("neck_yaw",)),
    Drawing("Following", "Smooth following",
            "Gain of the gaze between saccades against the target's speed; people reach .95 "
            "(Robinson 1986). The target is as seen by the rig.", _following, (8.4, 3.0)),
    Drawing("Lids", "Shape of a blink",
            "Median and 10th to 90th percentile of the upper lids.", _blink, (8.4, 3.2), joints=UPPER),
    Drawing("Social gaze", "Looks at people",
            "Times with the gaze on a face, and with that face turned to the robot too. Longer than "
            "15 s is a stare.", _looks, (8.4, 2.4)),
)  # fmt: skip
