"""Traces of eyes, head and lids: what was wished, what the guard permitted, what was measured."""

from collections import deque
from typing import NamedTuple

import numpy as np
import viser
from viser import uplot

from gaze.types import Floats
from robot.page.style import AMBER, BLUE, GREY, frame
from robot.types import JOINTS, Snapshot, Trail

TRACE_S = 30.0
"""How far back the traces are kept."""

SPANS = {"3 s": 3.0, "10 s": 10.0, "30 s": TRACE_S}
MOST_POINTS = 600
"""More points than this in a trace are thinned out: the panel is not wider."""

_LEAST_SPAN_DEG = 10.0
_SERIES = (("wish", GREY, 1.5), ("permitted", AMBER, 1.5), ("measured", BLUE, 2.0))


class Group(NamedTuple):
    """Joints that are drawn as the mean of them."""

    title: str
    joints: tuple[str, ...]


GROUPS = {
    "yaw": (
        Group("eyes in the head, yaw, + left", ("left_eye_pan", "right_eye_pan")),
        Group("head, yaw, + left", ("neck_yaw",)),
        Group("upper lids", ("left_upper_lid", "right_upper_lid")),
    ),
    "pitch": (
        Group("eyes in the head, pitch, + up", ("left_eye_tilt", "right_eye_tilt")),
        Group("head, pitch, + up", ("neck_pitch",)),
        Group("upper lids", ("left_upper_lid", "right_upper_lid")),
    ),
    "left eye": (
        Group("left eye, yaw, + left", ("left_eye_pan",)),
        Group("left eye, pitch, + up", ("left_eye_tilt",)),
        Group("left upper lid", ("left_upper_lid",)),
    ),
    "right eye": (
        Group("right eye, yaw, + left", ("right_eye_pan",)),
        Group("right eye, pitch, + up", ("right_eye_tilt",)),
        Group("right upper lid", ("right_upper_lid",)),
    ),
    "neck": (
        Group("neck, yaw, + left", ("neck_yaw",)),
        Group("neck, pitch, + up", ("neck_pitch",)),
        Group("neck, roll, + right ear down", ("neck_roll",)),
    ),
}
"""What can be shown: three plots each."""


class Traces:
    """The joints of the last half minute."""

    def __init__(self) -> None:
        """Start empty."""
        self._rows: deque[Trail] = deque()

    def add(self, snapshot: Snapshot) -> None:
        """Add what a snapshot brings and forget what has become too old."""
        for row in snapshot.trail:
            if self._rows and row.t_s < self._rows[-1].t_s:  # the rig's clock was started anew
                self._rows.clear()
            self._rows.append(row)
        while len(self._rows) > 1 and self._rows[-1].t_s - self._rows[1].t_s >= TRACE_S:
            self._rows.popleft()  # one older row closes the axis

    def table(self, over_s: float) -> tuple[Floats, Floats]:
        """Give the last seconds, thinned to MOST_POINTS: times and joints.

        Returns seconds before the newest (n,) and degrees (n, 3, 9): wish, permitted and
        measured, in the order of JOINTS.
        """
        if not self._rows:
            return np.zeros(0), np.zeros((0, 3, len(JOINTS)))
        now_s = self._rows[-1].t_s
        rows = [row for row in self._rows if row.t_s >= now_s - over_s]
        rows = rows[:: -max(1, -(-len(rows) // MOST_POINTS))][::-1]
        angles = np.degrees(np.array([row[1:] for row in rows]))
        return np.array([row.t_s - now_s for row in rows]), angles


def mean_deg(angles_deg: Floats, group: Group) -> Floats:
    """Give wish, permitted and measured (n, 3) of a group, from (n, 3, 9)."""
    mean: Floats = angles_deg[:, :, [JOINTS.index(name) for name in group.joints]].mean(axis=2)
    return mean


class TracesView:
    """Three plots and two menus."""

    def __init__(self, gui: viser.GuiApi, place: viser.GuiTabHandle) -> None:
        """Put the menus into a place of the page; the plots come with their first data."""
        self._gui = gui
        self._place = place
        with place:
            self._add_menus()
        self._titles: list[viser.GuiHtmlHandle] = []
        self._plots: list[viser.GuiUplotHandle] = []

    def _add_menus(self) -> None:
        gui = self._gui
        self._what = gui.add_dropdown("show", tuple(GROUPS), initial_value="yaw", order=1)
        self._span = gui.add_dropdown("of the last", tuple(SPANS), initial_value="10 s", order=2)

    def show(self, traces: Traces) -> None:
        """Draw the traces as they are now."""
        ago_s, angles_deg = traces.table(SPANS[self._span.value])
        if not len(ago_s):
            return
        groups = GROUPS[self._what.value]
        if not self._plots:
            with self._place:
                self._add_plots()
        for title, plot, group in zip(self._titles, self._plots, groups, strict=True):
            title.content = _title(group.title)
            plot.data = _columns(ago_s, mean_deg(angles_deg, group))

    def _add_plots(self) -> None:
        self._gui.add_html(_key(), order=3)
        for row in range(3):
            self._titles.append(self._gui.add_html("", order=4 + 2 * row))
            self._plots.append(self._add_plot(5 + 2 * row))

    def _add_plot(self, order: int) -> viser.GuiUplotHandle:
        lines = [
            uplot.Series(label=name, stroke=colour, width=width, points={"show": False})
            for name, colour, width in _SERIES
        ]
        # Nothing is seen of the last line: it keeps the scale from following the noise.
        room = uplot.Series(label="", stroke="transparent", width=0, points={"show": False})
        return self._gui.add_uplot(
            tuple(np.zeros(1) for _ in range(len(lines) + 2)),
            (uplot.Series(label="s"), *lines, room),
            # No fixed range: with one, the x axis is at times never drawn (viser 1.1.1).
            scales={"x": uplot.Scale(time=False), "y": uplot.Scale(auto=True)},
            axes=(uplot.Axis(size=24), uplot.Axis(size=38)),
            legend=uplot.Legend(show=False),
            padding=(8, 14, 0, 0),
            height=128,
            order=order,
        )


def _columns(ago_s: Floats, angles_deg: Floats) -> tuple[Floats, ...]:
    """Give x, the three lines, and one that spans at least _LEAST_SPAN_DEG around them."""
    low, high = float(angles_deg.min()), float(angles_deg.max())
    room = angles_deg[:, 2].copy()
    if high - low < _LEAST_SPAN_DEG and len(room) > 1:
        room[0] = (low + high - _LEAST_SPAN_DEG) / 2
        room[1] = room[0] + _LEAST_SPAN_DEG
    return (ago_s, *(np.ascontiguousarray(column) for column in angles_deg.T), room)


def _title(words: str) -> str:
    return f"<div style='padding:4px 12px 0;font-size:12px;opacity:.85'>{words}, degrees</div>"


def _key() -> str:
    names = "".join(
        f"<span style='margin-right:12px'><span style='color:{colour};font-weight:700'>&#8212;"
        f"</span> {name}</span>"
        for name, colour, _ in _SERIES
    )
    return frame(f"<div style='font-size:12px'>{names}</div>")
