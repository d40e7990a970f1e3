"""Parameters as controls, separately in each browser, one group at a time.

A rig has about five hundred parameters. Controls are built only for the chosen group or for the
results of a search: a browser takes seconds to build all of them.
"""

import json
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from html import escape
from math import floor, isclose, log10
from typing import cast

import msgspec

from gazerig.robot.dashboard.requests.outbox import Outbox
from gazerig.robot.dashboard.widgets.html import note
from gazerig.robot.dashboard.widgets.widget import Checkbox, Choice, Slider, TextField
from gazerig.robot.dashboard.widgets.widgets import Container, Widgets
from gazerig.robot.model.parameter import Parameter

Put = Callable[[str, object], None]
"""Requests another value: key, value."""

_SLIDER_STEPS = 500
_FAR = 20.0
"""Ratio of range to value above which a number is typed instead of set by a slider."""


def param_tooltip(param: Parameter) -> str:
    """Return the tooltip of a parameter: description, range and default."""
    parts = [f"{param.key}: {param.description}" if param.description else param.key]
    unit = f" {param.unit}" if param.unit else ""
    if param.low is not None and param.high is not None:
        parts.append(f"from {param.low:g} to {param.high:g}{unit}")
    if param.choices:
        parts.append("one of " + ", ".join(map(str, param.choices)))
    if param.default is not None or param.optional:  # the shipped rig may have no such joint or bus
        parts.append(f"default {format_value(param, param.default)}{unit}")
    parts.append(f"takes effect at the {param.live}")
    return "; ".join(parts)


def param_label(param: Parameter, unsaved: bool, title: str = "") -> str:
    """Return the label of a control: a mark if the value is unsaved, its name and its unit.

    title: plain name without a unit; "": use the last parts of the key
    """
    unit = f" ({param.unit})" if param.unit and not title else ""
    name = title or ".".join(param.key.split(".")[-2:])
    return f"{'● ' if unsaved else ''}{name}{unit}"


def slider_step(low: float, high: float) -> float:
    """Return the step of a slider: 1, 2 or 5 times a power of ten, some hundred in the range."""
    fine = (high - low) / _SLIDER_STEPS
    ten = 10.0 ** floor(log10(fine))
    return next(n * ten for n in (1.0, 2.0, 5.0, 10.0) if n * ten >= fine * (1.0 - 1e-9))


def fits_slider(param: Parameter, value: object) -> bool:
    """Return whether a slider can set a parameter finely enough."""
    if param.kind not in ("number", "whole") or isinstance(value, bool):
        return False
    if param.optional and param.default is None:  # a slider cannot be null
        return False
    low, high = param.low, param.high
    if low is None or high is None or not low < high or not isinstance(value, int | float):
        return False
    usual = max(abs(v) for v in (value, param.default) if isinstance(v, int | float))
    return low <= value <= high and (usual == 0.0 or high - low <= _FAR * usual)


def format_value(param: Parameter, value: object) -> str:
    """Return a value as a person would type it: text unchanged, other values as in the file."""
    if isinstance(value, str) and param.kind in ("text", "choice"):
        return value
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        return f"{value:.1f}"
    return json.dumps(value)


def parse_value(param: Parameter, text: str) -> object:
    """Parse text that a person typed.

    Raises:
        ValueError: the type is wrong; the message describes valid values.
    """
    text = text.strip()
    if param.optional and text in ("null", ""):
        return None
    if param.kind in ("text", "choice"):
        return text
    try:
        return json.loads(text)
    except ValueError:
        like = format_value(param, param.default)
        raise ValueError(
            f"{param.key}: {text!r} is no {param.kind}; write it like {like}"
        ) from None


class ParamControl:
    """Control of a parameter in one browser."""

    def __init__(
        self,
        place: Container,
        param: Parameter,
        value: object,
        unsaved: bool,
        put: Put,
        refuse: Callable[[str], None],
        order: float,
        title: str = "",
    ) -> None:
        self.param, self.order, self.title = param, order, title
        self._put, self._refuse = put, refuse
        self.field = self._add(place, param_label(param, unsaved, title), value, order)
        self.field.on_change(lambda shown, _: self._ask(shown))

    def _add(
        self, place: Container, text: str, value: object, order: float
    ) -> Checkbox | Choice | Slider | TextField:
        param, tooltip = self.param, param_tooltip(self.param)
        if param.kind == "bool" and not param.optional:
            return place.checkbox(text, bool(value), hint=tooltip, order=order)
        if param.choices and not param.optional and value in param.choices:
            names = tuple(map(str, param.choices))
            return place.choice(text, names, str(value), hint=tooltip, order=order)
        if fits_slider(param, value):
            low, high = cast(float, self.param.low), cast(float, self.param.high)
            now, whole, step = (
                cast(float, value),
                self.param.kind == "whole",
                slider_step(low, high),
            )
            if whole:
                step = max(1, round(step)) if high - low > 500 else 1
            return place.slider(
                text,
                (low, high),
                step,
                now,
                hint=param_tooltip(self.param),
                whole=whole,
                order=order,
            )
        shown = format_value(param, value)
        return place.text(text, shown, hint=f"{tooltip}; Enter sets it", order=order)

    def _ask(self, shown: object) -> None:
        """Request the value that a person has set: a chosen name, a typed text, or a number."""
        value = next((c for c in self.param.choices if str(c) == shown), shown)
        if isinstance(self.field, TextField):
            try:
                value = parse_value(self.param, str(shown))
            except ValueError as error:
                self._refuse(str(error))
                return
        self._put(self.param.key, value)

    def show(self, value: object, unsaved: bool) -> None:
        """Show the present value."""
        self.field.label = param_label(self.param, unsaved, self.title)
        if isinstance(self.field, TextField):
            self.field.value = format_value(self.param, value)
        elif isinstance(self.field, Choice):
            self.field.value = str(value)
        elif isinstance(self.field, Checkbox):
            self.field.value = bool(value)
        elif isinstance(value, int | float) and not isclose(value, self.field.value, rel_tol=1e-12):
            self.field.value = value

    def can_show(self, value: object) -> bool:
        """Return whether this control can show a value: a slider cannot show null."""
        return isinstance(self.field, TextField) or value is not None

    def remove(self) -> None:
        """Remove the control."""
        self.field.remove()


FIRST = {
    "gaze.scanpath.rate_scale": "liveliness",
    "gaze.scanpath.spot_height_mm": "time on the eyes",
    "gaze.lids.blinks_per_min": "blinks",
    "gaze.head.eye_only_range_deg": "range of the eyes alone",
}
"""Parameters with which Tune opens, and their plain names."""
ALL = "all parameters"
MOST_SHOWN = 30
SAVE, REVERT = "save", "revert to the file"
NOTHING, UNSAVED, DIFFERENT = "choose a group ...", "what is not saved", "what differs from default"

_OF_TUNING = ":tuning"
_NO_TAKER = "the rig accepts no requests now"
_SAVE: dict[str, object] = {"do": "save", "path": None}
_REVERT: dict[str, object] = {"do": "revert"}


class ParamPanels:
    """Parameters, and one panel of controls for each browser."""

    def __init__(self, widgets: Widgets, place: Container, outbox: Outbox) -> None:
        self._widgets, self._place, self._outbox = widgets, place, outbox
        self._params: dict[str, Parameter] = {}
        self._panels: dict[str, ParamPanel] = {}
        # Input, and browsers that connect and disconnect, are handled in a separate thread.
        self._lock = threading.RLock()
        self.in_force: dict[str, object] = {}
        self._unsaved: frozenset[str] = frozenset()
        self._path = ""
        widgets.on_join(self._greet)
        widgets.on_leave(self._forget)

    def _greet(self, client: str) -> None:
        with self._lock:
            panel = ParamPanel(self._widgets, client, self._place, self._outbox, self._lock)
            panel.offer(self._params)
            panel.update_values(self.in_force, self._unsaved, self._path)
            self._panels[client] = panel

    def _forget(self, client: str) -> None:
        with self._lock:
            self._panels.pop(client, None)

    def add_params(self, params: Sequence[Mapping[str, object]]) -> None:
        """Add parameters that can be tuned."""
        with self._lock:
            for data in params:
                param = msgspec.convert(data, Parameter)
                self._params[param.key] = param
            for panel in self._panels.values():
                panel.offer(self._params)

    def update_values(self, state: Mapping[str, object]) -> None:
        """Update changed values, unsaved values, and the file that save would write."""
        with self._lock:
            self.in_force.update(cast(Mapping[str, object], state.get("values", {})))
            self._unsaved = frozenset(cast(Iterable[str], state.get("unsaved", ())))
            self._path = str(state.get("path") or "")
            for panel in self._panels.values():
                panel.update_values(self.in_force, self._unsaved, self._path)

    def record_answer(self, who: str) -> None:
        """Record that the rig has answered a browser's change."""
        client, _, of_tuning = who.partition(":")
        with self._lock:
            panel = self._panels.get(client)
            if panel is not None and of_tuning:
                panel.record_answer()


class ParamPanel:
    """Controls of one browser, built when a group is chosen."""

    def __init__(
        self,
        widgets: Widgets,
        client: str,
        place: Container,
        outbox: Outbox,
        lock: threading.RLock,
    ) -> None:
        self._widgets, self._client = widgets, client
        self._outbox = outbox
        self._lock = lock
        self._who = f"{client}{_OF_TUNING}"
        self._params: Mapping[str, Parameter] = {}
        self._values: Mapping[str, object] = {}
        self._unsaved: frozenset[str] = frozenset()
        self._controls: dict[str, ParamControl] = {}
        self._first: dict[str, ParamControl] = {}
        self._unanswered = self._known = 0
        self._top = place.for_client(client)
        place = self._top.section(ALL, is_open=False, order=10)
        self._find = place.text("find", on="key", hint="words of a key or its meaning", order=1)
        self._group = place.choice("group", (NOTHING,), order=2)
        self._found = place.section("parameters", order=3)
        self._rest = place.html(order=4)
        self._words = place.html(note("no parameters have been received yet"), order=0)
        self._buttons = place.buttons("", (SAVE, REVERT), order=0.5)
        self._file = place.text(
            "save as", on="enter", hint="a new .yaml file in the rig's folder; Enter saves", order=5
        )
        self._find.on_change(lambda text, _: self._show_chosen())
        self._group.on_change(lambda group, _: self._choose())
        self._buttons.on_press(lambda button, _: self._ask(_SAVE if button == SAVE else _REVERT))
        self._file.on_change(
            lambda path, _: self._ask({"do": "save", "path": path.strip() or None})
        )

    def _choose(self) -> None:
        self._find.value = ""
        self._show_chosen()

    def offer(self, params: Mapping[str, Parameter]) -> None:
        """Set the available parameters."""
        self._params = params
        groups = tuple(dict.fromkeys(param_group(param) for param in params.values()))
        self._group.options = (NOTHING, UNSAVED, DIFFERENT, *groups)

    def update_values(
        self, values: Mapping[str, object], unsaved: frozenset[str], path: str
    ) -> None:
        """Update the present values; a control that is being moved keeps its value."""
        self._values, self._unsaved = values, unsaved
        some = f"<b>● {len(unsaved)} not saved</b>" if unsaved else "all saved"
        self._words.content = (
            f"<div>{len(self._params)} parameters, {some}</div><div>{escape(path)}</div>"
        )
        if len(values) != self._known:  # the first arrive after the browser
            self._known = len(values)
            for order, (key, title) in enumerate(FIRST.items()):
                if key in values and key in self._params and key not in self._first:
                    self._first[key] = self._control(self._top, key, 1.0 + 0.1 * order, title)
            self._show_chosen()
        if not self._unanswered:
            self._refresh()

    def record_answer(self) -> None:
        """Record whether the rig has applied or refused a change."""
        self._unanswered = max(0, self._unanswered - 1)
        if not self._unanswered:
            self._refresh()

    def _refresh(self) -> None:
        with self._lock:
            for key, control in self._first.items():
                control.show(self._values[key], key in self._unsaved)
            for key, control in list(self._controls.items()):
                if control.can_show(self._values[key]):
                    control.show(self._values[key], key in self._unsaved)
                else:
                    control.remove()
                    self._controls[key] = self._control(self._found, key, control.order)

    def _ask(self, what: Mapping[str, object]) -> None:
        if not self._outbox.ask(what, self._who):
            self._say(_NO_TAKER)
            self._refresh()

    def _put(self, key: str, value: object) -> None:
        with self._lock:
            self._unanswered += 1
            if not self._outbox.ask({"do": "set", "changes": {key: value}}, self._who):
                self._unanswered -= 1
                self._say(_NO_TAKER)
                self._refresh()

    def _refuse(self, text: str) -> None:
        self._say(text)
        self._refresh()

    def _say(self, refusal: str) -> None:
        self._widgets.notify(refusal, self._client, refused=True)

    def _show_chosen(self) -> None:
        """Build the controls of the search result or of the chosen group."""
        with self._lock:
            known = [param for key, param in self._params.items() if key in self._values]
            group = self._group.value
            if self._find.value.strip():
                wanted = search_params(self._find.value, known)
            elif group == UNSAVED:
                wanted = [param.key for param in known if param.key in self._unsaved]
            elif group == DIFFERENT:
                wanted = [one.key for one in known if self._values[one.key] != one.default]
            else:
                wanted = [param.key for param in known if param_group(param) == group]
            for key in [key for key in self._controls if key not in wanted[:MOST_SHOWN]]:
                self._controls.pop(key).remove()
            for order, key in enumerate(wanted[:MOST_SHOWN]):
                if key not in self._controls:
                    self._controls[key] = self._control(self._found, key, float(order))
            more = len(wanted) - MOST_SHOWN
            self._rest.content = note(f"and {more} more: search for less") if more > 0 else ""

    def _control(self, place: Container, key: str, order: float, title: str = "") -> ParamControl:
        return ParamControl(
            place,
            self._params[key],
            self._values[key],
            key in self._unsaved,
            self._put,
            self._refuse,
            order,
            title,
        )


def param_group(param: Parameter) -> str:
    """Return the group of a parameter: its section of the file, at most two names deep."""
    return ".".join(param.group.split(".")[:2]) if param.group else "rig"


def search_params(text: str, params: Iterable[Parameter]) -> list[str]:
    """Return the keys that contain, with description and unit, every word of a text."""
    words = text.lower().split()
    return [
        param.key
        for param in params
        if all(word in f"{param.key} {param.description} {param.unit}".lower() for word in words)
    ]
