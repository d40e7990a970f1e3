"""Panel of a recording: a time slider, play and pause, speed, steps, events.

Input of users is sent to the rig's process, which plays the recording. This panel shows only the
state that the process returns, so that every browser shows the same.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from html import escape
from typing import Any

from gazerig.robot.dashboard.feed.page_process import MARK_KINDS, SPEEDS
from gazerig.robot.dashboard.widgets.widgets import Container

Tell = Callable[[str, Mapping[str, object]], object]
"""Sends a user's request to the rig's process: the browser's tab, and the request."""

_WIDTH, _HEIGHT = 340, 26
_ROWS = (("saccade", "saccade", 0, 12), ("blink", "pursue", 13, 6), ("event", "alarm", 20, 6))
"""Kind of mark, its colour, and the position of its row."""
_EVENTS_BEFORE, _EVENTS_AFTER = 2, 2
_STEP_S = 0.005
_WORDS = 90
_PLAY, _PAUSE = "play", "pause"


class ReplayView:
    """Controls of a shown recording."""

    def __init__(self, place: Container, tell: Tell, duration_s: float) -> None:
        self._tell = tell
        self._asked_s: float | None = None
        self._events: Sequence[tuple[float, str]] = ()
        self._duration_s = max(duration_s, _STEP_S)
        self.place = place.html(order=1)
        self.slider = place.slider("time, s", (0.0, self._duration_s), _STEP_S, 0.0, order=2)
        self.strip = place.html(order=3)
        self.play = place.buttons("", (_PLAY,), order=4)
        speeds = tuple(_speed_name(speed) for speed in SPEEDS)
        self.speed = place.choice("speed", speeds, _speed_name(1.0), order=5)
        self.steps = {
            way: place.buttons(way, MARK_KINDS, hint=f"pause at the {way} one", order=6)
            for way in ("previous", "next")
        }
        self.events = place.section("events", order=7).html()
        self._playing = False
        self.slider.on_change(self._seek)
        self.play.on_press(lambda _, client: self._ask(client, {"play": not self._playing}))
        self.speed.on_change(
            lambda speed, client: self._ask(client, {"speed": float(speed.removesuffix("x"))})
        )

        def step(way: str, kind: str, client: str) -> None:
            self._ask(client, {"step": f"{way} {kind}"})

        for way, group in self.steps.items():
            group.on_press(partial(step, way))

    def _seek(self, at_s: float, client: str) -> None:
        self._asked_s = at_s
        self._ask(client, {"seek_s": at_s})

    def _ask(self, client: str, asked: dict[str, object]) -> None:
        self._tell(client, {"replay": asked})

    def show(self, state: Mapping[str, Any]) -> None:
        """Show the player's state, as gazerig.robot.recording.playback sends it.

        The first state also contains marks, which are counts along the recording by kind, and
        events, (at_s, words).
        """
        if (marks := state.get("marks")) is not None:
            self.strip.content = event_strip(marks)
        if (events := state.get("events")) is not None:
            self._events = [(float(at_s), str(text)) for at_s, text in events]
        at_s, sought_s = float(state["at_s"]), state["sought_s"]
        # The played position lags behind a slider that a user moves, and must not reset it.
        if self._asked_s is None or sought_s == self._asked_s:
            self._asked_s = None
            self.slider.value = min(round(at_s, 3), self._duration_s)
        if state["playing"] != self._playing:
            self._playing = bool(state["playing"])
            self.play.options = (_PAUSE if self._playing else _PLAY,)
        speed = _speed_name(float(state["speed"]))
        if speed in self.speed.options:
            self.speed.value = speed
        self.place.content = position_text(at_s, self._duration_s, self._playing)
        self.events.content = event_list(self._events, at_s)


def event_strip(marks: Mapping[str, Sequence[int]]) -> str:
    """Return the density of saccades, blinks and events along the recording, as SVG.

    marks: counts in equal parts of the recording, by kind
    """
    bars = ""
    for kind, colour, top, height in _ROWS:
        counts = marks.get(kind, ())
        most, width = max(counts, default=0), _WIDTH / max(len(counts), 1)
        bars += "".join(  # darker for parts with more marks
            f"<rect x='{i * width:.1f}' y='{top}' width='{width:.1f}' height='{height}' "
            f"fill='var(--{colour})' fill-opacity='{0.25 + 0.75 * n / most:.2f}'/>"
            for i, n in enumerate(counts)
            if n
        )
    legend = "".join(
        f"<span><span class='swatch ground-{colour}'></span>{kind}s</span>"
        for kind, colour, _, _ in _ROWS
    )
    said = ", ".join(f"{sum(marks.get(kind, ()))} {kind}s" for kind, *_ in _ROWS)
    return (
        f"<svg viewBox='0 0 {_WIDTH} {_HEIGHT}' preserveAspectRatio='none' class='strip' "
        f"role='img' aria-label='{said}'>{bars}</svg><div class='key'>{legend}</div>"
    )


def position_text(at_s: float, duration_s: float, playing: bool) -> str:
    """Show the present position in the recording."""
    word = "playing" if playing else "standing still"
    return f"<div class='ends'><span>{word}</span><span>{format_time(at_s)} / {format_time(duration_s)}</span></div>"


def format_time(seconds: float) -> str:
    """Return seconds as minutes and seconds, e.g. "1:02.345"."""
    thousandths = round(seconds * 1e3)
    return f"{thousandths // 60000}:{thousandths % 60000 / 1e3:06.3f}"


def event_list(events: Sequence[tuple[float, str]], at_s: float) -> str:
    """Return the events around a time as HTML: the last two, and the next two paler."""
    past = [e for e in events if e[0] <= at_s + 1e-6][-_EVENTS_BEFORE:]
    coming = [e for e in events if e[0] > at_s + 1e-6][:_EVENTS_AFTER]
    rows = [_event_line(*event, "past") for event in past]
    rows += [_event_line(*event, "quiet") for event in coming]
    return "".join(rows) or "no event"


def _event_line(at_s: float, text: str, kind: str) -> str:
    shown = text if len(text) <= _WORDS else f"{text[: _WORDS - 1]}…"
    return f"<div class='{kind}'>{format_time(at_s)} {escape(shown)}</div>"


def _speed_name(speed: float) -> str:
    return f"{speed:g}x"
