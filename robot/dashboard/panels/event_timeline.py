"""Strip of the last half minute: targets, face parts, saccades, blinks, guard levels, turns."""

from collections import deque
from collections.abc import Iterable
from typing import NamedTuple

from gazerig.gaze.types import PART_NAMES
from gazerig.robot.dashboard.panels.package_panels import PagePanel
from gazerig.robot.dashboard.widgets.html import (
    LEVELS,
    LINE_PX,
    OTHER_TARGET,
    TARGETS,
    box,
    line,
    note,
    svg,
    text,
)
from gazerig.robot.model.types import SeenBlink, SeenEvent, SeenSaccade, Snapshot

STRIP_S = 30.0
"""Duration of the strip, s."""

_LEFT_PX = 64.0
_RIGHT_PX = LINE_PX - 4.0
_ROWS_PX = {
    "target": 2.0, "part": 25.0, "saccades": 46.0, "blinks": 86.0, "guard": 105.0, "head": 124.0,
    "people": 145.0,
}  # fmt: skip
_AXIS_PX = 166.0
_TURNS = {
    "listening": "translation", "thinking": "looming", "speaking": "ok", "interrupted": "saccade",
}  # fmt: skip
"""Colours of the turns of the head in a conversation."""
_SACCADE_PX, _LARGE_DEG = 34.0, 30.0
_LETTER_PX = 7.4


class _Interval(NamedTuple):
    """Interval with a constant value."""

    start_s: float
    end_s: float
    what: str
    kind: str


class Timeline(PagePanel):
    """Strip of the last half minute."""

    title = "the last 30 seconds"
    order = 3.0
    is_open = True
    period = 8

    def __init__(self) -> None:
        self._rows: dict[str, deque[_Interval]] = {
            "target": deque(), "part": deque(), "guard": deque(), "head": deque(), "people": deque(),
        }  # fmt: skip
        self._events: deque[SeenEvent] = deque()
        self._now_s: float | None = None

    def update(self, snapshot: Snapshot) -> None:
        """Add a snapshot; one with an earlier time than the last resets the strip."""
        t_s = snapshot.t_s
        if self._now_s is not None and t_s < self._now_s:
            self._events.clear()
            for stretches in self._rows.values():
                stretches.clear()
        self._now_s = t_s
        target = snapshot.target_name.partition(":")[0]
        self._extend("target", t_s, target, snapshot.target_kind)
        self._extend("part", t_s, snapshot.target_part or "", snapshot.target_part or "")
        level = "stopped" if snapshot.stopped else snapshot.worst
        self._extend("guard", t_s, level, level)
        turn = snapshot.talk.state
        self._extend("head", t_s, "" if turn == "idle" else turn, turn)
        speaking = sorted(face.id for face in snapshot.faces if face.speaks)
        names = ", ".join(map(str, speaking))
        self._extend("people", t_s, f"speaks: {names}" if names else "", "face" if names else "")
        self._events += snapshot.events
        for stretches in self._rows.values():
            while stretches[0].end_s < t_s - STRIP_S:
                stretches.popleft()
        while self._events and self._events[0][0] < t_s - STRIP_S:
            self._events.popleft()

    def _extend(self, row: str, t_s: float, what: str, kind: str) -> None:
        """Extend a row's last interval, or start a new one if the value has changed."""
        stretches = self._rows[row]
        if stretches and (stretches[-1].what, stretches[-1].kind) == (what, kind):
            stretches[-1] = stretches[-1]._replace(end_s=t_s)
            return
        stretches.append(_Interval(stretches[-1].end_s if stretches else t_s, t_s, what, kind))

    def drawing(self) -> str:
        """Return the strip as HTML."""
        now_s = self._now_s
        if now_s is None:
            return note("waiting for the rig")
        parts = [*_axes(), *self._bands(now_s), *self._marks(now_s)]
        targets = dict.fromkeys(stretch.what for stretch in self._rows["target"] if stretch.what)
        saccades = sum(isinstance(event, SeenSaccade) for event in self._events)
        blinks = sum(isinstance(event, SeenBlink) for event in self._events)
        levels = dict.fromkeys(stretch.kind for stretch in self._rows["guard"])
        turns = dict.fromkeys(stretch.what for stretch in self._rows["head"] if stretch.what)
        return svg(
            _AXIS_PX + 18.0,
            parts,
            (
                f"the last {STRIP_S:.0f} seconds: looked at {', '.join(targets) or 'nothing'}; "
                f"{saccades} saccades, {blinks} blinks; guard {', '.join(levels)}; turns "
                f"{', '.join(turns) or 'none'}"
            ),
        )

    def _bands(self, now_s: float) -> Iterable[str]:
        for stretch in self._rows["target"]:
            colour = stretch.kind if stretch.kind in TARGETS else OTHER_TARGET
            yield from _band("target", stretch, now_s, 20.0, colour, stretch.what)
        for stretch in self._rows["part"]:
            if stretch.kind:
                yield from _band("part", stretch, now_s, 18.0, f"part-{stretch.kind}", stretch.kind)
        for stretch in self._rows["guard"]:
            yield from _band("guard", stretch, now_s, 14.0, LEVELS[stretch.kind], "")
        for stretch in self._rows["head"]:
            if stretch.what:
                yield from _band("head", stretch, now_s, 17.0, _TURNS[stretch.kind], stretch.what)
        for stretch in self._rows["people"]:
            if stretch.what:
                yield from _band("people", stretch, now_s, 17.0, stretch.kind, stretch.what)

    def _marks(self, now_s: float) -> Iterable[str]:
        foot = _ROWS_PX["saccades"] + _SACCADE_PX
        for event in self._events:
            x = _x(event[0], now_s)
            if isinstance(event, SeenSaccade):
                size = min(1.0, event.amplitude_deg / _LARGE_DEG) ** 0.5
                says = f"{event.amplitude_deg:.1f} deg, {1e3 * event.duration_s:.0f} ms"
                high = 2.0 + (_SACCADE_PX - 2.0) * size
                yield box(x - 0.5, foot - high, 1.2, high, "saccade", says)
            elif isinstance(event, SeenBlink):
                wide = _x(event.start_s + event.duration_s, now_s) - x
                says = f"blink, {1e3 * event.duration_s:.0f} ms"
                yield box(x, _ROWS_PX["blinks"], max(wide, 1.5), 13.0, "calm", says)


def _x(t_s: float, now_s: float) -> float:
    """Return the x coordinate of a time, limited to the left edge."""
    ago = max(-STRIP_S, t_s - now_s)
    return _RIGHT_PX + ago * (_RIGHT_PX - _LEFT_PX) / STRIP_S


def _axes() -> Iterable[str]:
    """Return the names of the rows, their lines, and the axis of time."""
    for name, y in _ROWS_PX.items():
        yield text(1.0, y + (28.0 if name == "saccades" else 12.0), name)
    foot = _ROWS_PX["saccades"] + _SACCADE_PX + 0.5
    yield line(((_LEFT_PX, foot), (_RIGHT_PX, foot)), "grid")
    yield line(((_LEFT_PX, _AXIS_PX), (_RIGHT_PX, _AXIS_PX)), "axis")
    for ago_s in (-30, -20, -10, 0):
        x = _RIGHT_PX + ago_s * (_RIGHT_PX - _LEFT_PX) / STRIP_S
        yield line(((x, _AXIS_PX), (x, _AXIS_PX + 3.0)), "axis")
        anchor = "end" if ago_s == 0 else "middle"
        yield text(x, _AXIS_PX + 15.0, "now" if ago_s == 0 else f"{ago_s} s", anchor)


def _band(
    row: str, stretch: _Interval, now_s: float, high: float, colour: str, label: str
) -> Iterable[str]:
    """Return one interval as a bar, with its name if there is space."""
    x0, x1 = _x(stretch.start_s, now_s), _x(stretch.end_s, now_s)
    says = PART_NAMES.get(stretch.what, stretch.what)
    yield box(x0, _ROWS_PX[row], x1 - x0 - 0.3, high, colour, says)
    if label and x1 - x0 > _LETTER_PX * len(label) + 4.0:
        words = text(x0 + 3.0, _ROWS_PX[row] + high / 2 + 4.8, label)
        yield words.replace("svg-text", "svg-label")
