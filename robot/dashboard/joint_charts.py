"""Traces of eyes, head and lids: desired, commanded and measured angles."""

from collections import deque
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import viser
from viser import uplot

from gazerig.gaze.types import Floats
from gazerig.robot.dashboard.html import AMBER, BLUE, GREY, PALE_BLUE, frame
from gazerig.robot.model.types import Snapshot, Trail

TRACE_S = 30.0
"""How far back the traces are kept."""

SPANS = {"3 s": 3.0, "10 s": 10.0, "30 s": TRACE_S}
MOST_POINTS = 600
"""More points than this in a trace are thinned out: the panel is not wider."""

_LEAST_SPAN_DEG = 10.0
_COMMANDS = (("desired", GREY, 1.5), ("commanded", AMBER, 1.5))
_MEASURED = ("measured", BLUE, 2.0)
_ESTIMATED = ("estimated, not measured", PALE_BLUE, 2.0)
_DASH_PX = (6.0, 4.0)


class ChartGroup(NamedTuple):
    """Joints that are drawn as the mean of them."""

    title: str
    joints: tuple[str, ...]


_UPPER = ChartGroup("upper lids, + open", ("left_upper_lid", "right_upper_lid"))
_LOWER = ChartGroup("lower lids, + open", ("left_lower_lid", "right_lower_lid"))
_BOTH_YAW = ChartGroup("both eyes, yaw, + left", ("eyes_pan",))
_BOTH_PITCH = ChartGroup("both eyes, pitch, + up", ("eyes_tilt",))

GROUPS = {
    "yaw": (
        ChartGroup("eyes in the head, yaw, + left", ("left_eye_pan", "right_eye_pan", "eyes_pan")),
        ChartGroup("head, yaw, + left", ("neck_yaw",)),
        _UPPER,
        _LOWER,
    ),
    "pitch": (
        ChartGroup(
            "eyes in the head, pitch, + up", ("left_eye_tilt", "right_eye_tilt", "eyes_tilt")
        ),
        ChartGroup("head, pitch, + up", ("neck_pitch",)),
        _UPPER,
        _LOWER,
    ),
    "left eye": (
        ChartGroup("left eye, yaw, + left", ("left_eye_pan",)),
        _BOTH_YAW,
        ChartGroup("left eye, pitch, + up", ("left_eye_tilt",)),
        _BOTH_PITCH,
        ChartGroup("left upper lid, + open", ("left_upper_lid",)),
        ChartGroup("left lower lid, + open", ("left_lower_lid",)),
    ),
    "right eye": (
        ChartGroup("right eye, yaw, + left", ("right_eye_pan",)),
        _BOTH_YAW,
        ChartGroup("right eye, pitch, + up", ("right_eye_tilt",)),
        _BOTH_PITCH,
        ChartGroup("right upper lid, + open", ("right_upper_lid",)),
        ChartGroup("right lower lid, + open", ("right_lower_lid",)),
    ),
    "neck": (
        ChartGroup("neck, yaw, + left", ("neck_yaw",)),
        ChartGroup("neck, pitch, + up", ("neck_pitch",)),
        ChartGroup("neck, roll, + right ear down", ("neck_roll",)),
    ),
}
"""What can be shown of a head that has every joint: one plot a group."""


def groups_of(joints: Iterable[str]) -> dict[str, tuple[ChartGroup, ...]]:
    """Return what can be shown of a rig: groups of joints that are there, none empty."""
    there = frozenset(joints)
    menu: dict[str, tuple[ChartGroup, ...]] = {}
    for name, groups in GROUPS.items():
        kept = [(title, tuple(j for j in names if j in there)) for title, names in groups]
        if found := tuple(ChartGroup(title, names) for title, names in kept if names):
            menu[name] = found
    return menu


class JointSeries:
    """The joints of the last half minute.

    joints: their names; estimated: those that are not measured
    """

    def __init__(self) -> None:
        self._rows: deque[Trail] = deque()
        self.joints: tuple[str, ...] = ()
        self.estimated: frozenset[str] = frozenset()

    def add(self, snapshot: Snapshot) -> None:
        """Add what a snapshot brings and forget what has become too old."""
        if snapshot.joints != self.joints:  # of another rig the rows would not fit
            self._rows.clear()
            self.joints = snapshot.joints
        self.estimated = frozenset(snapshot.estimated)
        for row in snapshot.trail:
            if self._rows and row.t_s < self._rows[-1].t_s:  # the rig's clock was started again
                self._rows.clear()
            self._rows.append(row)
        while len(self._rows) > 1 and self._rows[-1].t_s - self._rows[1].t_s >= TRACE_S:
            self._rows.popleft()  # one older row closes the axis

    def table(self, over_s: float) -> tuple[Floats, Floats]:
        """Return the last seconds, thinned to MOST_POINTS: times and joints.

        Returns seconds before the newest (n,) and degrees (n, 3, joints): desired, commanded and
        measured.
        """
        if not self._rows:
            return np.zeros(0), np.zeros((0, 3, len(self.joints)))
        now_s = self._rows[-1].t_s
        rows = [row for row in self._rows if row.t_s >= now_s - over_s]
        rows = rows[:: -max(1, -(-len(rows) // MOST_POINTS))][::-1]
        angles = np.degrees(np.array([row[1:] for row in rows]))
        return np.array([row.t_s - now_s for row in rows]), angles


def mean_deg(angles_deg: Floats, group: ChartGroup, joints: tuple[str, ...]) -> Floats:
    """Return desired, commanded and measured (n, 3) of a group, from those of the joints."""
    mean: Floats = angles_deg[:, :, [joints.index(name) for name in group.joints]].mean(axis=2)
    return mean


class _Plot(NamedTuple):
    """One plot and the line above it."""

    title: viser.GuiHtmlHandle
    plot: viser.GuiUplotHandle

    def remove(self) -> None:
        self.title.remove()
        self.plot.remove()


class JointCharts:
    """Two menus, and a plot for each group of what is chosen."""

    def __init__(self, gui: viser.GuiApi, place: viser.GuiTabHandle) -> None:
        self._gui = gui
        self._place = place
        with place:
            self._what = gui.add_dropdown("show", ("yaw",), order=1)
            self._span = gui.add_dropdown(
                "of the last", tuple(SPANS), initial_value="10 s", order=2
            )
            self._key = gui.add_html("", order=3)
        self._drawn: tuple[tuple[ChartGroup, bool], ...] = ()
        self._plots: list[_Plot] = []

    def show(self, traces: JointSeries) -> None:
        """Draw the traces as they are now."""
        ago_s, angles_deg = traces.table(SPANS[self._span.value])
        menu = groups_of(traces.joints)
        if not len(ago_s) or not menu:
            return
        if self._what.options != tuple(menu):
            self._what.options = tuple(menu)
        groups = menu.get(self._what.value) or next(iter(menu.values()))
        self._make(tuple((g, not traces.estimated.isdisjoint(g.joints)) for g in groups))
        for (_, plot), group in zip(self._plots, groups, strict=True):
            plot.data = _columns(ago_s, mean_deg(angles_deg, group, traces.joints))

    def _make(self, wanted: tuple[tuple[ChartGroup, bool], ...]) -> None:
        """Create the plots again if other groups are chosen, or values are estimated now."""
        if wanted == self._drawn:
            return
        for plot in self._plots:
            plot.remove()
        self._key.content = _key([estimated for _, estimated in wanted])
        with self._place:
            self._plots = [
                self._add(group.title, estimated, 4 + 2 * row)
                for row, (group, estimated) in enumerate(wanted)
            ]
        self._drawn = wanted

    def _add(self, title: str, estimated: bool, order: int) -> _Plot:
        lines = [
            uplot.Series(label=name, stroke=colour, width=width, points={"show": False})
            for name, colour, width in _COMMANDS
        ]
        lines.append(_result(estimated))
        # Nothing is seen of the last line: it keeps the scale from following the noise.
        room = uplot.Series(label="", stroke="transparent", width=0, points={"show": False})
        return _Plot(
            self._gui.add_html(_title(title, estimated), order=order),
            self._gui.add_uplot(
                tuple(np.zeros(1) for _ in range(len(lines) + 2)),
                (uplot.Series(label="s"), *lines, room),
                # No fixed range: with one, the x axis is at times never drawn (viser 1.1.1).
                scales={"x": uplot.Scale(time=False), "y": uplot.Scale(auto=True)},
                axes=(uplot.Axis(size=24), uplot.Axis(size=38)),
                legend=uplot.Legend(show=False),
                padding=(8, 14, 0, 0),
                height=128,
                order=order + 1,
            ),
        )


def _result(estimated: bool) -> uplot.Series:
    """Return the line of the resulting angle: dashed and pale if it is not measured."""
    name, colour, width = _ESTIMATED if estimated else _MEASURED
    line = uplot.Series(label=name, stroke=colour, width=width, points={"show": False})
    if estimated:
        line["dash"] = _DASH_PX
    return line


def _columns(ago_s: Floats, angles_deg: Floats) -> tuple[Floats, ...]:
    """Return x, the three lines, and one that spans at least _LEAST_SPAN_DEG around them."""
    low, high = float(angles_deg.min()), float(angles_deg.max())
    room = angles_deg[:, 2].copy()
    if high - low < _LEAST_SPAN_DEG and len(room) > 1:
        room[0] = (low + high - _LEAST_SPAN_DEG) / 2
        room[1] = room[0] + _LEAST_SPAN_DEG
    return (ago_s, *(np.ascontiguousarray(column) for column in angles_deg.T), room)


def _title(text: str, estimated: bool) -> str:
    said = f"{text}, degrees{'; no feedback' if estimated else ''}"
    return f"<div style='padding:4px 12px 0;font-size:12px;opacity:.85'>{said}</div>"


def _key(estimated: Sequence[bool]) -> str:
    """Name the lines that there are."""
    shown = [(*line, "&#8212;") for line in _COMMANDS]
    if not all(estimated):
        shown.append((*_MEASURED, "&#8212;"))
    if any(estimated):
        shown.append((*_ESTIMATED, "- -"))
    names = "".join(
        f"<span style='margin-right:12px;white-space:nowrap'>"
        f"<span style='color:{colour};font-weight:700'>{mark}</span> {name}</span>"
        for name, colour, _, mark in shown
    )
    return frame(f"<div style='font-size:12px'>{names}</div>")
