"""Draw the words, the traces and the camera picture beside the page's scene."""

from collections import deque
from html import escape
from math import degrees

import cv2
import numpy as np
import viser
from viser import uplot

from gaze.types import Floats, Pull
from robot.types import JOINTS, Snapshot

TRACE_S = 10.0
"""How far back the traces reach."""

_TRACE_EVERY = 3  # traces are redrawn with every third picture, some 8 times a second
_LEFT_PAN, _RIGHT_PAN = JOINTS.index("left_eye_pan"), JOINTS.index("right_eye_pan")
_NECK_YAW = JOINTS.index("neck_yaw")

_GREEN, _AMBER, _ORANGE, _RED, _BLUE, _GREY = (
    "#2b8a5a", "#d9830a", "#e8590c", "#d02f2f", "#1c7ed6", "#868e96",
)  # fmt: skip
_PHASES = {"fixate": _GREEN, "saccade": _ORANGE, "pursue": _BLUE}
_LEVELS = {"ok": _GREEN, "limited": _AMBER, "hold": _ORANGE, "limp": _RED}
_REASONS_SHOWN = 4


class PanelView:
    """The panel, from top to bottom: status, two traces, the camera picture."""

    def __init__(self, gui: viser.GuiApi) -> None:
        """Say that nothing has come yet; traces and picture appear with their first data."""
        self._gui = gui
        self._status = gui.add_html(_frame("<b>waiting for the rig</b>"), order=1)
        self._traces = Traces()
        self._plots: tuple[viser.GuiUplotHandle, ...] = ()
        self._picture: viser.GuiImageHandle | None = None
        self._shown = 0

    def note(self, snapshots: tuple[Snapshot, ...]) -> None:
        """Remember every snapshot for the traces, also those that are not drawn."""
        for snapshot in snapshots:
            self._traces.add(snapshot)

    def show(self, snapshot: Snapshot) -> None:
        """Draw the newest words and, less often, the traces."""
        self._status.content = status(snapshot)
        if self._shown % _TRACE_EVERY == 0:
            self._show_traces()
        self._shown += 1

    def silent(self) -> None:
        """Say that the rig sends nothing any more."""
        self._status.content = _frame(
            f"{_pill('silent', _GREY)}<div style='margin-top:6px'>nothing has come from the rig "
            "for a second; what is shown is the last that was seen</div>"
        )

    def show_picture(self, jpeg: bytes) -> None:
        """Draw the camera picture; one that cannot be decoded is skipped."""
        bgr = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
        if bgr is None:
            return
        rgb = cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB)
        if self._picture is None:
            self._picture = self._gui.add_image(rgb, label="camera", format="jpeg", order=2)
        self._picture.image = rgb

    def _show_traces(self) -> None:
        ago_s, eye_deg, head_deg = self._traces.columns()
        if not self._plots:
            eye = self._add_plot("eyes in the head, yaw in degrees, + left", _BLUE, 3)
            head = self._add_plot("head, yaw in degrees, + left", _GREEN, 5)
            self._plots = (eye, head)
        for plot, trace in zip(self._plots, (eye_deg, head_deg), strict=True):
            plot.data = (ago_s, trace)

    def _add_plot(self, title: str, colour: str, order: int) -> viser.GuiUplotHandle:
        words = f"<div style='padding:4px 12px 0;font-size:12px;opacity:.8'>{escape(title)}</div>"
        self._gui.add_html(words, order=order)
        return self._gui.add_uplot(
            (np.zeros(1), np.zeros(1)),
            (uplot.Series(label="s"), uplot.Series(label=title, stroke=colour, width=2)),
            scales={
                # No fixed range: with one, the x axis is at times never drawn (viser 1.1.1).
                "x": uplot.Scale(time=False),
                "y": uplot.Scale(range=(-60.0, 60.0)),
            },
            axes=(uplot.Axis(size=26), uplot.Axis(size=38)),
            legend=uplot.Legend(show=False),
            padding=(10, 14, 0, 0),
            height=120,
            order=order + 1,
        )


class Traces:
    """Eye and head yaw of the last ten seconds."""

    def __init__(self) -> None:
        """Start empty."""
        self._rows: deque[tuple[float, float, float]] = deque()

    def add(self, snapshot: Snapshot) -> None:
        """Add a snapshot and forget what has become too old."""
        rows, t_s = self._rows, snapshot.t_s
        if rows and t_s < rows[-1][0]:  # the rig's clock was started anew
            rows.clear()
        joints = snapshot.measured_rad
        eye_deg = degrees((joints[_LEFT_PAN] + joints[_RIGHT_PAN]) / 2)
        rows.append((t_s, eye_deg, degrees(joints[_NECK_YAW])))
        while len(rows) > 1 and t_s - rows[1][0] >= TRACE_S:  # one older row closes the axis
            rows.popleft()

    def columns(self) -> tuple[Floats, Floats, Floats]:
        """Give seconds before the newest, eye yaw and head yaw in degrees, each (n,)."""
        table = np.array(self._rows, float).reshape(-1, 3)
        now_s = table[-1, 0] if len(table) else 0.0
        return table[:, 0] - now_s, table[:, 1], table[:, 2]


def status(snapshot: Snapshot) -> str:
    """Say in HTML what the rig does and why."""
    pills = (
        _pill(snapshot.phase, _PHASES.get(snapshot.phase, _GREY))
        + _pill(f"guard: {snapshot.level}", _LEVELS[snapshot.level])
        + (_pill(snapshot.behaviour, _GREY) if snapshot.behaviour else "")
        + f"<span style='float:right'>{snapshot.rate_hz:.0f} Hz</span>"
    )
    return _frame(
        f"<div style='font-size:17px;font-weight:600'>{escape(snapshot.target_name)}</div>"
        f"<div style='opacity:.8;min-height:1.5em'>{escape(snapshot.why)}</div>"
        f"<div style='margin:6px 0'>{pills}</div>"
        f"{_pulls(snapshot.pulls)}"
        f"{_reasons(snapshot.reasons)}"
        f"<div style='opacity:.8'>{escape(snapshot.health)}</div>"
        f"<div style='opacity:.8'>{escape(snapshot.seeing)}</div>"
    )


def _pulls(pulls: tuple[Pull, ...]) -> str:
    """List what pulls the gaze, term by term, the strongest first."""
    if not pulls:
        return ""
    rows = "".join(
        f"<tr><td>{escape(p.kind)} {p.id}</td>"
        + "".join(f"<td style='text-align:right'>{value:.2f}</td>" for value in p[2:])
        + "</tr>"
        for p in pulls
    )
    names = "".join(
        f"<th style='font-weight:400;text-align:right'>{escape(n)}</th>" for n in Pull._fields[2:]
    )
    style = "font-size:10.5px;width:100%;opacity:.85;line-height:1.3"
    return f"<table style='{style}'><tr><th></th>{names}</tr>{rows}</table>"


def _reasons(reasons: tuple[str, ...]) -> str:
    shown = "".join(f"<div>{escape(reason)}</div>" for reason in reasons[:_REASONS_SHOWN])
    more = len(reasons) - _REASONS_SHOWN
    rest = f"<div>and {more} more</div>" if more > 0 else ""
    return f"<div style='color:{_AMBER}'>{shown}{rest}</div>"


def _pill(words: str, colour: str) -> str:
    return (
        f"<span style='background:{colour};color:#fff;border-radius:9px;padding:1px 9px;"
        f"margin-right:6px;font-weight:600'>{escape(words)}</span>"
    )


def _frame(inner: str) -> str:
    return f"<div style='padding:4px 12px;font-size:13px;line-height:1.5'>{inner}</div>"
