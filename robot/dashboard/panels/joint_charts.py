"""Traces of eyes, head and lids: desired, commanded and measured angles."""

from collections import deque
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from gazerig.gaze.types import Floats
from gazerig.robot.dashboard.widgets.widget import Chart
from gazerig.robot.dashboard.widgets.widgets import Container
from gazerig.robot.model.types import Snapshot, Trail

TRACE_S = 30.0
"""Duration of the traces, s."""

SPANS = {"3 s": 3.0, "10 s": 10.0, "30 s": TRACE_S}
MOST_POINTS = 300
"""Largest number of points in a trace; more would not be visible."""

_LEAST_SPAN_DEG = 10.0
_COMMANDS = (("desired", "desired"), ("commanded", "commanded"))
_MEASURED = ("measured", "measured")
_ESTIMATED = ("estimated, not measured", "estimated")
"""Names of lines, and their style on the page."""


class ChartGroup(NamedTuple):
    """Joints whose mean angle is drawn."""

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
"""Groups of joints of a head with all joints; one chart for each."""


def chart_groups(joints: Iterable[str]) -> dict[str, tuple[ChartGroup, ...]]:
    """Return the groups of a rig, with its joints only, none empty."""
    there = frozenset(joints)
    menu: dict[str, tuple[ChartGroup, ...]] = {}
    for name, groups in GROUPS.items():
        kept = [(title, tuple(j for j in names if j in there)) for title, names in groups]
        if found := tuple(ChartGroup(title, names) for title, names in kept if names):
            menu[name] = found
    return menu


class JointSeries:
    """Joint angles of the last half minute.

    joints: names of the joints; estimated: joints that are not measured
    """

    def __init__(self) -> None:
        self._rows: deque[Trail] = deque()
        self.joints: tuple[str, ...] = ()
        self.estimated: frozenset[str] = frozenset()

    def add(self, snapshot: Snapshot) -> None:
        """Add a snapshot and remove old ones."""
        if snapshot.joints != self.joints:  # rows of another rig have other joints
            self._rows.clear()
            self.joints = snapshot.joints
        self.estimated = frozenset(snapshot.estimated)
        for row in snapshot.trail:
            if self._rows and row.t_s < self._rows[-1].t_s:  # the rig's clock was restarted
                self._rows.clear()
            self._rows.append(row)
        while len(self._rows) > 1 and self._rows[-1].t_s - self._rows[1].t_s >= TRACE_S:
            # Keep one older row, so that the lines start at the edge of the axis.
            self._rows.popleft()

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
    """Return the mean desired, commanded and measured angles (n, 3) of a group."""
    mean: Floats = angles_deg[:, :, [joints.index(name) for name in group.joints]].mean(axis=2)
    return mean


class JointCharts:
    """Two menus, and a chart for each group of the choice."""

    def __init__(self, place: Container) -> None:
        self._place = place
        self.what = place.choice("show", ("yaw",), order=1)
        self.span = place.choice("of the last", tuple(SPANS), "10 s", order=2)
        self.key = place.html(order=3)
        self._drawn: tuple[tuple[ChartGroup, bool], ...] = ()
        self.charts: list[Chart] = []

    def show(self, traces: JointSeries) -> None:
        """Draw the traces."""
        ago_s, angles_deg = traces.table(SPANS[self.span.value])
        menu = chart_groups(traces.joints)
        if not len(ago_s) or not menu:
            return
        if self.what.options != tuple(menu):
            self.what.options = tuple(menu)
        groups = menu.get(self.what.value) or next(iter(menu.values()))
        wanted = tuple((g, not traces.estimated.isdisjoint(g.joints)) for g in groups)
        if wanted != self._drawn:  # other groups are chosen, or values become estimated
            self._make(wanted)
        x = np.round(ago_s, 3).tolist()
        for chart, group in zip(self.charts, groups, strict=True):
            columns = np.round(mean_deg(angles_deg, group, traces.joints).T, 2).tolist()
            chart.draw(x, dict(zip(chart.names(), columns, strict=True)))

    def _make(self, wanted: tuple[tuple[ChartGroup, bool], ...]) -> None:
        """Create the charts of these groups; True: the values of the group are estimated."""
        for chart in self.charts:
            chart.remove()
        shown = [(*line, "&#8212;") for line in _COMMANDS]
        estimates = [estimated for _, estimated in wanted]
        if not all(estimates):
            shown.append((*_MEASURED, "&#8212;"))
        if any(estimates):
            shown.append((*_ESTIMATED, "- -"))
        names = "".join(
            f"<span><b class='line-{kind}' aria-hidden='true'>{mark}</b> {name}</span>"
            for name, kind, mark in shown
        )
        self.key.content = f"<div class='key'>{names}</div>"
        self.charts = [
            self._place.chart(
                f"{group.title}, degrees{'; no feedback' if estimated else ''}",
                (*_COMMANDS, _ESTIMATED if estimated else _MEASURED),
                unit="degrees",
                least=_LEAST_SPAN_DEG,
                order=4 + row,
            )
            for row, (group, estimated) in enumerate(wanted)
        ]
        self._drawn = wanted
