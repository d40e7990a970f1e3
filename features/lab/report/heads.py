"""Mutual gaze of two heads of one world, from the recordings of both."""

from base64 import b64encode
from collections.abc import Iterable, Sequence
from heapq import merge
from typing import NamedTuple

from gazerig.drivers.errors import SetupError
from gazerig.features.lab.report.plotting import COLOURS, Figure, draw_png, label_axes
from gazerig.features.lab.report.statistics import format_number
from gazerig.robot.analysis.mutual_gaze import (
    HeadPlacement,
    MutualGazeTrace,
    MutualLooks,
    bridge_gaps,
    interval_edges,
    mutual_gaze,
)
from gazerig.robot.control.tick import Tick

GAZE_KEY = "mutual_gaze"
"""The name of the timeline's file, and of the figures among the report's numbers."""

_TALK = "Argyle & Ingham 1972, two who talk"
_BOTH_GREEN = "#2b8a5a"


class _Measure(NamedTuple):
    """A figure of ``mutual_gaze``; {a} and {b} in its title: the heads; people: human value."""

    key: str
    title: str
    unit: str = ""
    people: str = ""
    source: str = ""


_MEASURES = (
    _Measure("first_looks", "share of the time in which {a} looks at {b}", "", "0.6", _TALK),
    _Measure("second_looks", "share of the time in which {b} looks at {a}", "", "0.6", _TALK),
    _Measure("both", "share of the time in which both do", "", "0.3", _TALK),
    _Measure("both_by_chance", "the same if neither minded the other", "", "0.36", "0.6 of 0.6"),
    _Measure("mutual_gazes", "mutual gazes"),
    _Measure("mean_s", "their mean length", "s", "1.5", _TALK),
    _Measure("median_s", "their median length", "s"),
    _Measure(
        "longest_s", "the longest", "s", "3.3", "Binetti et al. 2016: what people like to be looked at"
    ),
    _Measure("ended_by_first", "ended by {a}"),
    _Measure("ended", "ended in all"),
    _Measure("answered_after_s", "from a look to the other's answer, median", "s"),
    _Measure("answers", "such answers"),
)  # fmt: skip


class GazeLine(NamedTuple):
    """One row of the table of the page, ready to print."""

    title: str
    value: str
    people: str
    source: str


class MutualGazeReport(NamedTuple):
    """The report of two heads.

    Attributes:
        first: name of the head of the report.
        second: name of the other head.
        figures: result of ``mutual_gaze``, as in the summary of the run.
        png: timeline of the looks.
    """

    first: str
    second: str
    figures: dict[str, object]
    png: bytes

    @property
    def lines(self) -> tuple[GazeLine, ...]:
        """Return the figures as text."""
        return tuple(
            GazeLine(
                one.title.format(a=self.first, b=self.second),
                _text(self.figures.get(one.key), one.unit),
                f"{one.people} {one.unit}".strip() if one.people else "",
                one.source,
            )
            for one in _MEASURES
        )

    @property
    def data_uri(self) -> str:
        """Return the picture as embedded in the page."""
        return f"data:image/png;base64,{b64encode(self.png).decode()}"

    @property
    def as_json(self) -> dict[str, object]:
        """Return the figures as in the report's numbers."""
        return {"key": GAZE_KEY, "first": self.first, "second": self.second, **self.figures}


def mutual_gaze_report(
    ticks: tuple[Iterable[Tick], Iterable[Tick]],
    placements: tuple[Sequence[float], Sequence[float]],
    names: tuple[str, str],
) -> MutualGazeReport:
    """Return the report of the mutual gaze of two heads.

    Args:
        ticks: ticks of both runs, on one clock.
        placements: placement of each head in their world, as in ``RunInfo.placement``.
        names: names of both heads.

    Raises:
        SetupError: the run had only one head, or both had the same position.
    """
    for name, place in zip(names, placements, strict=True):
        if not place:
            raise SetupError(
                f"{name} is from a run with one head: --with takes the recordings of two heads of "
                "one run, for example run.mcap and run-other.mcap"
            )
    if tuple(placements[0]) == tuple(placements[1]):
        raise SetupError(
            f"{names[0]} and {names[1]} are from the same head: --with takes the other's"
        )
    trace = MutualGazeTrace(
        HeadPlacement.from_numbers(placements[0]), HeadPlacement.from_numbers(placements[1])
    )
    both = merge(
        ((tick.t_s, 0, tick) for tick in ticks[0]),
        ((tick.t_s, 1, tick) for tick in ticks[1]),
        key=lambda each: each[:2],  # at equal times the first head comes first, as in the run
    )
    for _, head, tick in both:
        trace.update(head, tick)
    looks = trace.looks()
    if len(looks.t_s) < 2:
        raise SetupError(f"{names[0]} and {names[1]} have no time in common")
    png = draw_png(lambda figure: _timeline(figure, looks, names), (8.4, 2.2))
    return MutualGazeReport(*names, mutual_gaze(*looks), png)


def _timeline(figure: Figure, looks: MutualLooks, names: tuple[str, str]) -> None:
    """Draw the looks of both heads over time."""
    axes = figure.subplots()
    first, second = (
        bridge_gaps(looks.t_s, looks.first_looks),
        bridge_gaps(looks.t_s, looks.second_looks),
    )
    rows = ((first, COLOURS[0]), (first & second, _BOTH_GREEN), (second, COLOURS[1]))
    for row, (mask, colour) in enumerate(rows):
        t_s = looks.t_s
        axes.broken_barh(
            [
                (float(t_s[begin] - t_s[0]), float(t_s[min(end, len(t_s) - 1)] - t_s[begin]))
                for begin, end in zip(*interval_edges(mask), strict=True)
            ],
            (row - 0.36, 0.72),
            facecolors=colour,
            lw=0,
        )
    axes.set_yticks(range(3), [f"{names[0]} looks", "both", f"{names[1]} looks"])
    axes.set_ylim(2.5, -0.5)
    axes.set_xlim(0.0, float(looks.t_s[-1] - looks.t_s[0]))
    axes.grid(False)
    label_axes(axes, "s", "")


def _text(value: object, unit: str) -> str:
    if not isinstance(value, (int, float)):
        return "none"
    return f"{format_number(value)} {unit}".strip()
