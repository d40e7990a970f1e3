"""The page's place for a recording: a time slider, play and pause, speed, steps, what happened.

What a person does is only told to the rig's side, which plays; what is shown here is what
it says back, so that every browser shows the same.
"""

from collections.abc import Callable, Mapping, Sequence
from html import escape
from typing import Any

import viser

from gazerig.robot.dashboard.page_process import MARK_KINDS, SPEEDS
from gazerig.robot.dashboard.widget import put

Tell = Callable[[int, Mapping[str, object]], None]
"""Hands what a person asks for to the rig's side: the browser's number, and the request."""

_WIDTH, _HEIGHT = 340, 26
_ROWS = (("saccade", "#e8590c", 0, 12), ("blink", "#1c7ed6", 13, 6), ("event", "#d02f2f", 20, 6))
_EVENTS_BEFORE, _EVENTS_AFTER = 2, 2
_STEP_S = 0.005
_WORDS = 90


class ReplayView:
    """The controls of a recording that is shown."""

    def __init__(self, gui: viser.GuiApi, tell: Tell, duration_s: float) -> None:
        self._tell = tell
        self._asked_s: float | None = None
        self._events: Sequence[tuple[float, str]] = ()
        self._duration_s = max(duration_s, _STEP_S)
        window = gui.add_panel()
        with window.add_tab("recording"):
            self._place = gui.add_html(_frame(""))
            self._slider = gui.add_slider("time, s", 0.0, self._duration_s, _STEP_S, 0.0)
            self._strip = gui.add_html("")
            self._play = gui.add_button("play", icon=viser.Icon.PLAYER_PLAY)
            self._speed = gui.add_dropdown(
                "speed", tuple(_speed_name(s) for s in SPEEDS), initial_value=_speed_name(1.0)
            )
            self._steps = [
                gui.add_button_group(way, MARK_KINDS, hint=f"stand still at the {way} one")
                for way in ("previous", "next")
            ]
            self._list = gui.add_html("")
        window.dock_below(gui.main_panel)
        self._playing = False
        self._listen()

    def _listen(self) -> None:
        @self._slider.on_update
        def _(event: viser.GuiEvent[viser.GuiSliderHandle[float]]) -> None:
            if event.client is not None:  # else it was moved by what is played
                self._asked_s = float(event.target.value)
                self._ask(event.client, {"seek_s": self._asked_s})

        @self._play.on_click
        def _(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            self._ask(event.client, {"play": not self._playing})

        @self._speed.on_update
        def _(event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
            if event.client is not None:
                self._ask(event.client, {"speed": float(event.target.value[:-1])})

        for group in self._steps:

            @group.on_click
            def _(event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
                self._ask(event.client, {"step": f"{event.target.label} {event.target.value}"})

    def _ask(self, client: viser.ClientHandle | None, asked: dict[str, object]) -> None:
        if client is not None:
            self._tell(client.client_id, {"replay": asked})

    def show(self, state: Mapping[str, Any]) -> None:
        """Show where it stands, as gazerig.robot.recording.replay writes it: a player's State.

        Once there are also marks, counts along the recording by kind, and events, (at_s, words).
        """
        if (marks := state.get("marks")) is not None:
            self._strip.content = strip(marks)
        if (events := state.get("events")) is not None:
            self._events = [(float(at_s), str(text)) for at_s, text in events]
        at_s, sought_s = float(state["at_s"]), state["sought_s"]
        # While a hand moves the slider, what is played is behind it and must not pull it back.
        if self._asked_s is None or sought_s == self._asked_s:
            self._asked_s = None
            put(self._slider, min(round(at_s, 3), self._duration_s))
        self._show_playing(bool(state["playing"]), float(state["speed"]))
        _put(self._place, place(at_s, self._duration_s, self._playing))
        _put(self._list, event_list(self._events, at_s))

    def _show_playing(self, playing: bool, speed: float) -> None:
        if playing != self._playing:
            self._playing = playing
            self._play.label = "pause" if playing else "play"
            self._play.icon = viser.Icon.PLAYER_PAUSE if playing else viser.Icon.PLAYER_PLAY
        name = _speed_name(speed)
        if name in self._speed.options:
            put(self._speed, name)


def strip(marks: Mapping[str, Sequence[int]]) -> str:
    """Draw how many saccades, blinks and events there are along the recording, as SVG.

    marks: counts of equal shares of the recording, by kind
    """
    bars = "".join(
        _bars(marks.get(kind, ()), colour, top, height) for kind, colour, top, height in _ROWS
    )
    legend = " &middot; ".join(
        f"<span style='color:{colour}'>{kind}s</span>" for kind, colour, _, _ in _ROWS
    )
    return _frame(
        f"<svg viewBox='0 0 {_WIDTH} {_HEIGHT}' width='100%' preserveAspectRatio='none' "
        f"style='display:block;height:{_HEIGHT}px;background:#8881'>{bars}</svg>"
        f"<div style='font-size:11px'>{legend}</div>"
    )


def _bars(counts: Sequence[int], colour: str, top: int, height: int) -> str:
    """Draw one row: a bar a share of the recording, the darker the more happened in it."""
    most, width = max(counts, default=0), _WIDTH / max(len(counts), 1)
    return "".join(
        f"<rect x='{i * width:.1f}' y='{top}' width='{width:.1f}' height='{height}' "
        f"fill='{colour}' fill-opacity='{0.25 + 0.75 * n / most:.2f}'/>"
        for i, n in enumerate(counts)
        if n
    )


def place(at_s: float, duration_s: float, playing: bool) -> str:
    """Show the present position in the recording."""
    word = "playing" if playing else "standing still"
    return _frame(
        f"{word}"
        f"<span style='float:right;font-variant-numeric:tabular-nums'>"
        f"{clock(at_s)} / {clock(duration_s)}</span>"
    )


def clock(seconds: float) -> str:
    """Write seconds as minutes and seconds, e.g. "1:02.345"."""
    thousandths = round(seconds * 1e3)
    return f"{thousandths // 60000}:{thousandths % 60000 / 1e3:06.3f}"


def event_list(events: Sequence[tuple[float, str]], at_s: float) -> str:
    """List the events about a time: the last two, and the next two paler."""
    past = [e for e in events if e[0] <= at_s + 1e-6][-_EVENTS_BEFORE:]
    coming = [e for e in events if e[0] > at_s + 1e-6][:_EVENTS_AFTER]
    rows = [_event(*event, 1.0) for event in past] + [_event(*event, 0.5) for event in coming]
    return _frame("".join(rows) or "no event")


def _event(at_s: float, text: str, opacity: float) -> str:
    shown = text if len(text) <= _WORDS else f"{text[: _WORDS - 1]}…"
    return (
        f"<div style='opacity:{opacity};font-size:11.5px'>"
        f"<span style='font-variant-numeric:tabular-nums'>{clock(at_s)}</span> "
        f"{escape(shown)}</div>"
    )


def _put(html: viser.GuiHtmlHandle, content: str) -> None:
    """Change words only where they differ: every change goes to every browser."""
    if html.content != content:
        html.content = content


def _speed_name(speed: float) -> str:
    return f"{speed:g}x"


def _frame(inner: str) -> str:
    return f"<div style='padding:2px 12px;font-size:13px;line-height:1.5'>{inner}</div>"
