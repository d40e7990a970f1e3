"""Controls of the parameters that a running rig applies; the others are changed in its file.

They are built once, for all browsers: the first ones, and in a fold a section for each group.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from html import escape
from math import floor, log10
from typing import Any

import msgspec

from gazerig.robot.dashboard.requests.outbox import Outbox
from gazerig.robot.dashboard.widgets.html import note
from gazerig.robot.dashboard.widgets.widget import Checkbox, Choice, Slider, TextField
from gazerig.robot.dashboard.widgets.widgets import Container, Widgets
from gazerig.robot.model.parameter import Parameter

Put = Callable[[str, object, str], object]
"""Requests another value: key, value, client."""

FIRST = {
    "gaze.scanpath.rate_scale": "liveliness",
    "gaze.scanpath.spot_height_mm": "time on the eyes",
    "gaze.lids.blinks_per_min": "blinks",
    "gaze.head.eye_only_range_deg": "range of the eyes alone",
}
"""Parameters with which Tune opens, and their plain names."""
ALL = "all live parameters"
SAVE, REVERT = "save", "revert to the file"

_SLIDER_STEPS = 100
_FAR = 20.0
"""Ratio of range to value above which a number is typed instead of set by a slider."""
_NO_TAKER = "the rig accepts no requests now"


def param_hint(param: Parameter) -> str:
    """Return the tooltip of a parameter: description, range and default."""
    parts = [f"{param.key}: {param.description}" if param.description else param.key]
    unit = f" {param.unit}" if param.unit else ""
    if param.low is not None and param.high is not None:
        parts.append(f"from {param.low:g} to {param.high:g}{unit}")
    if param.default is not None or param.optional:  # the shipped rig may have no such joint
        parts.append(f"default {format_value(param, param.default)}{unit}")
    return "; ".join(parts)


def format_value(param: Parameter, value: object) -> str:
    """Return a value as a person would type it: text unchanged, other values as in the file."""
    if isinstance(value, str) and param.kind in ("text", "choice"):
        return value
    return json.dumps(value)


def parse_value(param: Parameter, text: str) -> object:
    """Return the value that a person typed; the rig refuses a text that is none."""
    text = text.strip()
    if param.optional and text in ("null", ""):
        return None
    if param.kind in ("text", "choice"):
        return text
    try:
        return json.loads(text)
    except ValueError:
        return text


class ParamControl:
    """Control of a parameter: a checkbox, a menu, a slider or a text field.

    Args:
        place: Container of the control.
        param: The parameter.
        value: Present value.
        put: Called when a user sets another value.
        title: Plain name without a unit; "": use the last parts of the key.
        order: Position in the container.
    """

    def __init__(
        self,
        place: Container,
        param: Parameter,
        value: Any,
        put: Put,
        title: str = "",
        order: float = 0.0,
    ) -> None:
        unit = f" ({param.unit})" if param.unit else ""
        self._param = param
        self._title = title or ".".join(param.key.split(".")[-2:]) + unit
        self.field = self._add(place, value, order)

        def ask(shown: Any, client: str) -> None:
            is_text = isinstance(self.field, TextField)
            put(param.key, parse_value(param, shown) if is_text else shown, client)

        self.field.on_change(ask)

    def _add(
        self, place: Container, value: Any, order: float
    ) -> Checkbox | Choice | Slider | TextField:
        param, title, hint = self._param, self._title, param_hint(self._param)
        kind = "text" if param.optional else param.kind
        if kind == "bool":
            return place.checkbox(title, value, hint=hint, order=order)
        if kind == "choice":
            return place.choice(title, param.choices, value, hint=hint, order=order)
        low, high = param.low, param.high
        if (
            kind != "number"
            or low is None
            or high is None
            or high - low > _FAR * abs(value or high)
        ):
            return place.text(title, format_value(param, value), hint=hint, order=order)
        step = 10.0 ** floor(log10((high - low) / _SLIDER_STEPS))
        return place.slider(title, (low, high), step, value, hint=hint, order=order)

    def show(self, value: Any, unsaved: bool) -> None:
        """Show the present value, with a mark if it is not saved."""
        self.field.label = f"{'● ' if unsaved else ''}{self._title}"
        is_text = isinstance(self.field, TextField)
        self.field.value = format_value(self._param, value) if is_text else value


class ParamPanel:
    """Parameters of the drawer Tune.

    in_force: present values
    """

    def __init__(self, widgets: Widgets, place: Container, outbox: Outbox) -> None:
        self._widgets, self._place, self._outbox = widgets, place, outbox
        self._params: dict[str, Parameter] = {}
        self._controls: dict[str, list[ParamControl]] = {}
        self._groups: dict[str, Container] = {}
        self._unsaved: frozenset[str] = frozenset()
        self.in_force: dict[str, object] = {}
        self._all = place.section(ALL, is_open=False, order=10)
        self._words = self._all.html(note("no parameters have been received yet"))
        buttons = self._all.buttons("", (SAVE, REVERT))
        file = self._all.text(
            "save as", on="enter", hint="a new .yaml file in the rig's folder; Enter saves"
        )

        def save(path: str, client: str) -> None:
            self._ask({"do": "save", "path": path.strip() or None}, client)

        def press(button: str, client: str) -> None:
            if button == SAVE:
                save("", client)
            else:
                self._ask({"do": "revert"}, client)

        buttons.on_press(press)
        file.on_change(save)

    def add_params(self, params: Sequence[Mapping[str, object]]) -> None:
        """Add parameters; their controls are built with their first values."""
        for param in msgspec.convert(params, list[Parameter]):
            self._params[param.key] = param

    def update_values(self, state: Mapping[str, Any]) -> None:
        """Update changed values, unsaved values, and the file that save would write."""
        values = state.get("values", {})
        self.in_force.update(values)
        self._unsaved = frozenset(state.get("unsaved", ()))
        for key in values:
            if key in self._params and key not in self._controls:
                self._controls[key] = self._add(self._params[key])
        count = len(self._unsaved)
        saved = f"<b>● {count} not saved</b>" if count else "all saved"
        self._words.content = (
            f"<div>{len(self._controls)} parameters, {saved}</div>"
            f"<div>{escape(state.get('path') or '')}</div>"
        )
        self.show_values()

    def _add(self, param: Parameter) -> list[ParamControl]:
        group = param_group(param)
        if group not in self._groups:
            self._groups[group] = self._all.section(group, is_open=False)
        value = self.in_force[param.key]
        controls = [ParamControl(self._groups[group], param, value, self._put)]
        if (title := FIRST.get(param.key)) is not None:
            order = 1.0 + 0.1 * list(FIRST).index(param.key)
            controls.append(ParamControl(self._place, param, value, self._put, title, order))
        return controls

    def show_values(self) -> None:
        """Show all values in force, such as after a refused change."""
        for key in self._controls:
            self._show(key)

    def _show(self, key: str) -> None:
        for control in self._controls[key]:
            control.show(self.in_force[key], key in self._unsaved)

    def _put(self, key: str, value: object, client: str) -> None:
        if not self._ask({"do": "set", "changes": {key: value}}, client):
            self._show(key)

    def _ask(self, what: Mapping[str, object], client: str) -> bool:
        taken = self._outbox.ask(what, client)
        if not taken:
            self._widgets.notify(_NO_TAKER, client, refused=True)
        return taken


def param_group(param: Parameter) -> str:
    """Return the group of a parameter: its section of the file, at most two names deep."""
    return ".".join(param.group.split(".")[:2]) if param.group else "rig"
