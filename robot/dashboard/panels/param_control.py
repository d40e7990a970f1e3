"""Control of one parameter: a slider, a checkbox, a choice or a line of text."""

import json
from collections.abc import Callable
from math import floor, isclose, log10
from typing import cast

from gazerig.robot.dashboard.widgets.widget import Checkbox, Choice, Slider, TextField
from gazerig.robot.dashboard.widgets.widgets import Container
from gazerig.robot.model.parameter import Parameter

Put = Callable[[str, object], None]
"""Requests another value: key, value."""

_SLIDER_STEPS = 500
_FAR = 20.0
"""Ratio of range to value from which a number is typed instead of set by a slider."""


def hint(param: Parameter) -> str:
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


def label(param: Parameter, unsaved: bool) -> str:
    """Return a control's label: the last parts of the key, its unit, a mark if it is unsaved."""
    unit = f" ({param.unit})" if param.unit else ""
    name = ".".join(param.key.split(".")[-2:])
    return f"{'● ' if unsaved else ''}{name}{unit}"


def slider_step(low: float, high: float) -> float:
    """Return a slider's step: 1, 2 or 5 times a power of ten, some hundreds in the range."""
    fine = (high - low) / _SLIDER_STEPS
    ten = 10.0 ** floor(log10(fine))
    return next(n * ten for n in (1.0, 2.0, 5.0, 10.0) if n * ten >= fine * (1.0 - 1e-9))


def fits_slider(param: Parameter, value: object) -> bool:
    """Return whether a slider can set a parameter finely enough."""
    if param.kind not in ("number", "whole") or isinstance(value, bool):
        return False
    if param.optional and param.default is None:  # a slider cannot be set to null
        return False
    low, high = param.low, param.high
    if low is None or high is None or not low < high or not isinstance(value, int | float):
        return False
    usual = max(abs(v) for v in (value, param.default) if isinstance(v, int | float))
    return low <= value <= high and (usual == 0.0 or high - low <= _FAR * usual)


def format_value(param: Parameter, value: object) -> str:
    """Return a value as a person types it: text unchanged, other values as in the file."""
    if isinstance(value, str) and param.kind in ("text", "choice"):
        return value
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        return f"{value:.1f}"
    return json.dumps(value)


def read(param: Parameter, text: str) -> object:
    """Parse text that a person typed.

    Raises:
        ValueError: it is not of the parameter's kind; the message describes valid values.
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
    """Control of a parameter in one browser.

    Args:
        place: Container of the control.
        param: the parameter.
        value: Present value.
        unsaved: Whether it differs from the file's.
        put: Called when a person sets another value.
        refuse: called with words when what was typed cannot be read.
        order: its place among the others.
    """

    def __init__(
        self,
        place: Container,
        param: Parameter,
        value: object,
        unsaved: bool,
        put: Put,
        refuse: Callable[[str], None],
        order: float,
    ) -> None:
        self.param, self.order = param, order
        self._put, self._refuse = put, refuse
        self.field = self._add(place, label(param, unsaved), value, order)
        self.field.on_change(lambda shown, _: self._ask(shown))

    def _add(
        self, place: Container, text: str, value: object, order: float
    ) -> Checkbox | Choice | Slider | TextField:
        param, tooltip = self.param, hint(self.param)
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
                text, (low, high), step, now, hint=hint(self.param), whole=whole, order=order
            )
        shown = format_value(param, value)
        return place.text(text, shown, hint=f"{tooltip}; Enter sets it", order=order)

    def _ask(self, shown: object) -> None:
        """Request what a person has set: the choice of a name, the value of a text, or a value."""
        value = next((c for c in self.param.choices if str(c) == shown), shown)
        if isinstance(self.field, TextField):
            try:
                value = read(self.param, str(shown))
            except ValueError as error:
                self._refuse(str(error))
                return
        self._put(self.param.key, value)

    def show(self, value: object, unsaved: bool) -> None:
        """Show the present value."""
        self.field.label = label(self.param, unsaved)
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
