"""Style of all figures, which are drawn without a screen and returned as PNG.

Only this module imports matplotlib. matplotlib is an extra; without it, importing this module
raises SetupError with the command that installs it.
"""

from collections.abc import Callable, Sequence
from io import BytesIO
from typing import Any, NamedTuple

from gazerig.drivers.errors import SetupError, extra_hint
from gazerig.features.lab.report.gaze_trace import GazeTrace

try:
    import matplotlib as mpl
    from matplotlib.axes import Axes as Axes
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Figure
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


def draw_histogram(axes: Axes, values: Any, bins: Any, name: str, **style: Any) -> None:
    """Draw the shares of values as steps; values beyond the bins are at their ends."""
    if len(values):
        inside, weights = values.clip(bins[0], bins[-1]), [1.0 / len(values)] * len(values)
        axes.hist(inside, bins, weights=weights, histtype="step", lw=1.6,
                  label=f"{name} ({len(values)})", **style)  # fmt: skip


def mark_times(axes: Axes, times: dict[float, str]) -> None:
    """Draw a logarithmic axis of times with these labels."""
    axes.set_xscale("log")
    axes.minorticks_off()
    axes.set_xticks([*times], [*times.values()])
