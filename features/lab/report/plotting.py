"""Style of all figures, which are drawn without a screen and returned as PNG.

Only this module imports matplotlib. matplotlib is an extra; without it, importing this module
raises SetupError with the command that installs it.
"""

from collections.abc import Callable, Sequence
from io import BytesIO
from typing import Any, Literal, NamedTuple

from gazerig.drivers.errors import SetupError, extra_hint
from gazerig.features.lab.report.face import ReferenceWalk
from gazerig.features.lab.report.gaze_trace import GazeTrace

try:
    import matplotlib as mpl
    from matplotlib.axes import Axes as Axes
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Figure
    from matplotlib.patches import Circle as Circle
    from matplotlib.patches import Ellipse as Ellipse
    from matplotlib.patches import Patch as Patch
except ImportError as error:
    raise SetupError(extra_hint("matplotlib", "report", error)) from error

COLOURS = ("#1c6ea4", "#d9660a")
HUMAN = "#7f8c8d"
"""Human values are grey in every figure."""

HUMAN_FILL = "#dfe4e6"
INK = "#2c3136"

_STYLE: Any = {
    "text.parse_math": False,  # names of files are not formulas
    "font.family": "DejaVu Sans", "font.size": 10, "text.color": INK, "axes.labelcolor": INK,
    "axes.edgecolor": "#9aa3a9", "axes.titlesize": 11, "axes.titleweight": "bold",
    "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True,
    "axes.axisbelow": True, "grid.color": "#eceff1", "grid.linewidth": 0.8,
    "xtick.color": INK, "ytick.color": INK, "legend.frameon": False, "legend.fontsize": 8.5,
    "figure.facecolor": "white",
}  # fmt: skip
_DPI = 110
_LAYOUT: Literal["constrained"] | None = "constrained"
"""Layout with room for all labels; it takes most of the drawing time, and tests disable it."""

_Corner = Literal["upper left", "upper right", "lower right", "center right"]


class ShownRun(NamedTuple):
    """A run in figures; model: the walk over faces of its rig."""

    name: str
    run: GazeTrace
    colour: str
    model: ReferenceWalk | None = None


class Drawing(NamedTuple):
    """One figure: its key (the file's name), its section, title and caption.

    caption: "{measured}" in it becomes the basis of the runs' figures: measured, or estimated
    """

    key: str
    group: str
    title: str
    caption: str
    draw: Callable[[Figure, Sequence[ShownRun]], None]
    size_in: tuple[float, float] = (8.4, 3.8)


def basis_text(runs: Sequence[ShownRun], group: str) -> str:
    """Return the basis of several runs together, e.g. "measured or estimated"."""
    return " or ".join(dict.fromkeys(shown.run.joints.basis(group) for shown in runs))


def drawing_png(drawing: Drawing, runs: Sequence[ShownRun]) -> bytes:
    """Draw a figure of one run, or of two for comparison."""
    return draw_png(lambda figure: drawing.draw(figure, runs), drawing.size_in)


def draw_png(draw: Callable[[Figure], None], size_in: tuple[float, float]) -> bytes:
    """Return a PNG of a function's drawing in an empty figure, in the style of all figures."""
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=size_in, dpi=_DPI, layout=_LAYOUT)
        canvas = FigureCanvasAgg(figure)
        draw(figure)
        out = BytesIO()
        # print_figure would draw everything twice, once only for the layout.
        canvas.print_png(out)  # type: ignore[no-untyped-call]
    return out.getvalue()


def draw_no_data(axes: Axes, what: str) -> None:
    """Write a text instead of a figure without data."""
    axes.set_xticks([])
    axes.set_yticks([])
    axes.grid(False)
    axes.text(0.5, 0.5, what, ha="center", va="center", transform=axes.transAxes, color=HUMAN)


def draw_legend(axes: Axes, where: _Corner, columns: int = 1) -> None:
    """Add a legend if anything has a label."""
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc=where, ncols=columns, markerscale=1.4)


def label_axes(axes: Axes, x: str, y: str, title: str = "") -> None:
    """Set the labels of the axes and the title."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    if title:
        axes.set_title(title, loc="left")
