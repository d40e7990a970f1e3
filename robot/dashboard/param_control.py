"""One parameter as a control: a slider, a tick box, a choice or a line of text."""

import json
from collections.abc import Callable
from math import floor, isclose, log10
from typing import cast

import viser

from gazerig.robot.dashboard.widget import put
from gazerig.robot.remote.param_info import ParamInfo

Put = Callable[[str, object], None]
"""Asks for another value: key, value."""

_SLIDER_STEPS = 500
_FAR = 20.0
"""A range this many times wider than the value needs a number typed, not a slider."""


def hint(param: ParamInfo) -> str:
    """Return the tooltip of a parameter: description, range and default."""
    parts = [f"{param.key}: {param.description}" if param.description else param.key]
    unit = f" {param.unit}" if param.unit else ""
    if param.low is not None and param.high is not None:
        parts.append(f"from {param.low:g} to {param.high:g}{unit}")
    if param.choices:
        parts.append("one of " + ", ".join(map(str, param.choices)))
    if param.default is not None or param.optional:  # else the shipped rig has no such joint or bus
        parts.append(f"default {written(param, param.default)}{unit}")
    parts.append(f"in force at the {param.live}")
    return "; ".join(parts)


def label(param: ParamInfo, unsaved: bool) -> str:
    """Name a control: the last parts of the key, its unit, a mark where it is not saved."""
    unit = f" ({param.unit})" if param.unit else ""
    name = ".".join(param.key.split(".")[-2:])
    return f"{'● ' if unsaved else ''}{name}{unit}"


def step_of(low: float, high: float) -> float:
    """Return a slider's step: 1, 2 or 5 times a power of ten, some hundreds to the range."""
    fine = (high - low) / _SLIDER_STEPS
    ten = 10.0 ** floor(log10(fine))
    return next(n * ten for n in (1.0, 2.0, 5.0, 10.0) if n * ten >= fine * (1.0 - 1e-9))


def slides(param: ParamInfo, value: object) -> bool:
    """Return whether a slider can set a parameter finely enough."""
    if param.kind not in ("number", "whole") or isinstance(value, bool):
        return False
    if param.optional and param.default is None:  # a slider cannot be put back to null
        return False
    low, high = param.low, param.high
    if low is None or high is None or not low < high or not isinstance(value, int | float):
        return False
    usual = max(abs(v) for v in (value, param.default) if isinstance(v, int | float))
    return low <= value <= high and (usual == 0.0 or high - low <= _FAR * usual)


def written(param: ParamInfo, value: object) -> str:
    """Write a value as a person types it: text as it is, everything else as in the file."""
    if isinstance(value, str) and param.kind in ("text", "choice"):
        return value
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        return f"{value:.1f}"
    return json.dumps(value)


def read(param: ParamInfo, text: str) -> object:
    """Read what a person typed.

    Raises:
        ValueError: it is nothing of the kind; the message says what would be.
    """
    text = text.strip()
    if param.optional and text in ("null", ""):
        return None
    if param.kind in ("text", "choice"):
        return text
    try:
        return json.loads(text)
    except ValueError:
        like = written(param, param.default)
        raise ValueError(
            f"{param.key}: {text!r} is no {param.kind}; write it like {like}"
        ) from None


class ParamControl:
    """A parameter's control in one browser."""

    def __init__(
        self,
        gui: viser.GuiApi,
        param: ParamInfo,
        value: object,
        unsaved: bool,
        put: Put,
        refuse: Callable[[str], None],
        order: float,
    ) -> None:
        """Add the control where ``gui`` adds now.

        put: called when a person asks for another value; refuse: when it cannot be read
        """
        self.param = param
        self.order = order
        self._put = put
        self._refuse = refuse
        self._unsaved = unsaved
        self._form: viser.GuiFormHandle | None = None
        text = label(param, unsaved)
        self._handle = self._add(gui, text, value, order)
        if self._form is None:
            self._listen()
        else:
            self._listen_to_enter(self._form)

    def _add(
        self, gui: viser.GuiApi, text: str, value: object, order: float
    ) -> viser.GuiInputHandle[object]:
        param, tooltip = self.param, hint(self.param)
        handle: object
        if param.kind == "bool" and not param.optional:
            handle = gui.add_checkbox(text, bool(value), hint=tooltip, order=order)
        elif param.choices and not param.optional and value in param.choices:
            names = tuple(map(str, param.choices))
            handle = gui.add_dropdown(
                text, names, initial_value=str(value), hint=tooltip, order=order
            )
        elif slides(param, value):
            handle = self._slider(gui, text, value, order)
        else:
            # A number on its way to what is meant is another number: only Enter counts.
            self._form = gui.add_form(None, order=order)
            with self._form:
                handle = gui.add_text(text, written(param, value), hint=f"{tooltip}; Enter sets it")
        return cast("viser.GuiInputHandle[object]", handle)

    def _slider(self, gui: viser.GuiApi, text: str, value: object, order: float) -> object:
        param = self.param
        assert param.low is not None and param.high is not None  # slides() has seen to it
        if param.kind == "whole":
            low, high, now = int(param.low), int(param.high), int(cast(int, value))
            step: float = max(1, round(step_of(low, high))) if high - low > 500 else 1
            return gui.add_slider(text, low, high, int(step), now, hint=hint(param), order=order)
        low_, high_, now_ = float(param.low), float(param.high), float(cast(float, value))
        step = step_of(low_, high_)
        return gui.add_slider(text, low_, high_, step, now_, hint=hint(param), order=order)

    def _listen(self) -> None:
        @self._handle.on_update
        async def _(event: viser.GuiEvent[viser.GuiInputHandle[object]]) -> None:
            if event.client_id is not None:  # else it was set from here
                self._put(self.param.key, self._meant(event.target.value))

    def _listen_to_enter(self, form: viser.GuiFormHandle) -> None:
        @form.on_submit
        async def _(event: viser.GuiEvent[viser.GuiFormHandle]) -> None:
            try:
                value = read(self.param, str(self._handle.value))
            except ValueError as error:
                self._refuse(str(error))
            else:
                self._put(self.param.key, value)

    def _meant(self, shown: object) -> object:
        """Return the choice that a name stands for; anything else is itself."""
        return next((c for c in self.param.choices if str(c) == shown), shown)

    def show(self, value: object, unsaved: bool) -> None:
        """Show the value in force."""
        shown: object = value
        if self._form is not None:
            shown = written(self.param, value)
        elif self.param.choices:
            shown = str(value)
        now = self._handle.value
        near = (
            isinstance(shown, int | float)
            and isinstance(now, int | float)
            and isclose(shown, now, rel_tol=1e-12)
        )
        if shown is not None and not near and now != shown:
            put(self._handle, shown)
        if unsaved != self._unsaved:
            self._unsaved = unsaved
            self._handle.label = label(self.param, unsaved)

    def can_show(self, value: object) -> bool:
        """Return whether this control can show a value: a slider cannot show null."""
        return self._form is not None or value is not None

    def remove(self) -> None:
        """Remove the control."""
        (self._form or self._handle).remove()
